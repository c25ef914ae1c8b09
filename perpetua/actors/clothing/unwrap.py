"""Texture coordinates in metres: each sleeve, leg and the trunk is unrolled around its own axis."""

import numpy as np
from jaxtyping import Float32, Float64, Int32


def around(
    template_m: Float64[np.ndarray, "P 3"],
    faces: Int32[np.ndarray, "F 3"],
    start_m: Float64[np.ndarray, "3"],
    end_m: Float64[np.ndarray, "3"],
    seam: Float64[np.ndarray, "3"],
    radius_m: float,
) -> Float32[np.ndarray, "F 3 2"]:
    """Unrolls faces around the axis from ``start_m`` (top) to ``end_m``; the seam lies where ``seam`` points.

    Returns:
        Per corner, metres around (at ``radius_m``) and metres up the axis.
    """
    axis = (end_m - start_m) / np.linalg.norm(end_m - start_m)
    back = seam - (seam @ axis) * axis
    back /= np.linalg.norm(back)
    side = np.cross(axis, back)
    from_start = template_m - start_m
    angle = np.arctan2(-from_start @ side, -from_start @ back)
    corner = angle[faces]
    # A face across the seam: keep its corners together.
    corner = np.where(corner - corner[:, :1] > np.pi, corner - 2.0 * np.pi, corner)
    corner = np.where(corner - corner[:, :1] < -np.pi, corner + 2.0 * np.pi, corner)
    up_m = -(from_start @ axis)[faces]
    return np.stack([corner * radius_m, up_m], axis=2).astype(np.float32)
