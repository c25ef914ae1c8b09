"""What the navigation stage hands on."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64


@dataclass(frozen=True)
class NavGrid:
    """A 2.5D grid of where a person can stand.

    Cell (i, j) has its centre at ``origin_m + cell_m * (i, j)`` (x, y). ``floor_z_m`` is the height stood on;
    ``free`` is true where the body's axis may be (obstacles already grown by the body radius; one connected
    region); ``clearance_m`` is the distance from the cell's centre to the nearest obstacle, 0 on obstacles,
    before growing.
    """

    origin_m: Float64[np.ndarray, "2"]
    cell_m: float
    floor_z_m: Float32[np.ndarray, "X Y"]
    free: Bool[np.ndarray, "X Y"]
    clearance_m: Float32[np.ndarray, "X Y"]

    @property
    def free_floor_m2(self) -> float:
        """Area of the free region in square metres."""
        return float(self.free.sum()) * self.cell_m**2
