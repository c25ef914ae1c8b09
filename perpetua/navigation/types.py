"""What the navigation stage hands on."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64
from scipy import ndimage

from perpetua.scene.actor import Seat


@dataclass(frozen=True)
class NavGrid:
    """A 2.5D grid of where a person can stand.

    Cell (i, j) has its centre at ``origin_m + cell_m * (i, j)`` (x, y). ``floor_z_m`` is the height stood on;
    ``free`` is true where the body's axis may be (obstacles already grown by the body radius; one or more
    connected regions); ``clearance_m`` is the distance from the cell's centre to the nearest obstacle, 0 on
    obstacles, before growing.
    """

    origin_m: Float64[np.ndarray, "2"]
    cell_m: float
    floor_z_m: Float32[np.ndarray, "X Y"]
    free: Bool[np.ndarray, "X Y"]
    clearance_m: Float32[np.ndarray, "X Y"]

    @property
    def free_floor_m2(self) -> float:
        """Area of the largest connected free region in square metres."""
        labels, count = ndimage.label(self.free)
        return float(np.bincount(labels.ravel())[1:].max()) * self.cell_m**2 if count else 0.0


@dataclass(frozen=True)
class Spot:
    """A place worth a pause: where one stands, which way one faces, and what for.

    ``purpose`` is "look" (at ``target_m``), "stand" (at a worktop, ``target_m`` on it) or "sit" (with the back to
    the ``seat``, ``target_m`` its middle). ``object_index`` is what it is about.
    """

    place_m: tuple[float, float]
    facing_rad: float
    purpose: str
    object_index: int
    target_m: tuple[float, float, float]
    seat: Seat | None = None
