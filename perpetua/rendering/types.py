"""What the render stage hands on."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, UInt16


@dataclass(frozen=True)
class RenderedView:
    """One view: ``jpeg`` as the camera file would hold it, planar depth (0: no surface), object index (0: none)."""

    camera: int
    jpeg: tuple[bytes, ...]
    depth_m: Float32[np.ndarray, "T H W"]
    object_index: UInt16[np.ndarray, "T H W"]
