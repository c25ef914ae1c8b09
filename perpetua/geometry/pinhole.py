"""The pinhole camera: pixel (0, 0) is the centre of the top-left pixel; depth is Z along the optical axis."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64


@dataclass(frozen=True)
class Intrinsics:
    """A pinhole camera without distortion. Valid pixels satisfy -0.5 <= x < width_px - 0.5."""

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    width_px: int
    height_px: int

    @classmethod
    def centred(cls, width_px: int, height_px: int, horizontal_fov_rad: float) -> "Intrinsics":
        """Square pixels and a centred principal point, for a horizontal field of view in radians."""
        focal_px = 0.5 * width_px / np.tan(0.5 * horizontal_fov_rad)
        return cls(focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1), width_px, height_px)


def project(camera: Intrinsics, points_camera_m: Float64[np.ndarray, "*batch 3"]) -> Float64[np.ndarray, "*batch 2"]:
    """Pixel of points in camera coordinates; NaN where Z <= 0."""
    z = points_camera_m[..., 2]
    safe_z = np.where(z > 0, z, np.nan)
    x = camera.fx_px * points_camera_m[..., 0] / safe_z + camera.cx_px
    y = camera.fy_px * points_camera_m[..., 1] / safe_z + camera.cy_px
    return np.stack([x, y], axis=-1)


def unproject(
    camera: Intrinsics, pixel_px: Float64[np.ndarray, "*batch 2"], depth_m: Float64[np.ndarray, "*batch"]
) -> Float64[np.ndarray, "*batch 3"]:
    """Points in camera coordinates at a depth (Z, not ray length) along the rays of pixels."""
    x = (pixel_px[..., 0] - camera.cx_px) / camera.fx_px * depth_m
    y = (pixel_px[..., 1] - camera.cy_px) / camera.fy_px * depth_m
    return np.stack([x, y, depth_m], axis=-1)


def inside_image(camera: Intrinsics, pixel_px: Float64[np.ndarray, "*batch 2"]) -> Bool[np.ndarray, "*batch"]:
    """Whether pixels lie on the image; False for NaN."""
    x, y = pixel_px[..., 0], pixel_px[..., 1]
    return np.asarray(
        (x >= -0.5) & (x < camera.width_px - 0.5) & (y >= -0.5) & (y < camera.height_px - 0.5), dtype=bool
    )
