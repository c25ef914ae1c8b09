"""What the camera stage hands on."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64

from perpetua.geometry.pinhole import Intrinsics


@dataclass(frozen=True)
class SignedDistanceField:
    """Distance to the nearest surface at voxel centres ``origin_m + voxel_m * (i, j, k)``; positive in free space."""

    origin_m: Float64[np.ndarray, "3"]
    voxel_m: float
    distance_m: Float32[np.ndarray, "X Y Z"]


@dataclass(frozen=True)
class CameraPath:
    """One moving camera: OpenCV axes (X right, Y down, Z forward), intrinsics constant over frames."""

    camera: int
    world_from_camera: Float64[np.ndarray, "T 4 4"]
    intrinsics: Intrinsics
