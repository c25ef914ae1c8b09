"""What the camera stage hands on."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.geometry.pinhole import Intrinsics


@dataclass(frozen=True)
class CameraPath:
    """One moving camera: OpenCV axes (X right, Y down, Z forward), intrinsics constant over frames."""

    camera: int
    world_from_camera: Float64[np.ndarray, "T 4 4"]
    intrinsics: Intrinsics
