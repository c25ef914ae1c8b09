"""Rotations as matrices, for arrays of angles. A positive angle about Y pitches a body that faces +X nose down."""

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation


def about_x(angle_rad: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, "N 3 3"]:
    """Rotations about X (roll: +Y towards +Z)."""
    return _about(0, angle_rad)


def about_y(angle_rad: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, "N 3 3"]:
    """Rotations about Y (pitch: +X towards -Z)."""
    return _about(1, angle_rad)


def about_z(angle_rad: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, "N 3 3"]:
    """Rotations about Z (yaw: +X towards +Y)."""
    return _about(2, angle_rad)


def _about(axis: int, angle_rad: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, "N 3 3"]:
    if len(angle_rad) == 0:
        return np.zeros((0, 3, 3))
    return np.asarray(Rotation.from_rotvec(angle_rad[:, None] * np.eye(3)[axis]).as_matrix())


def blend(
    start: Float64[np.ndarray, "N 3 3"], end: Float64[np.ndarray, "N 3 3"], weight: float | Float64[np.ndarray, " N"]
) -> Float64[np.ndarray, "N 3 3"]:
    """Rotations a fraction of the way (0 to 1) from ``start`` to ``end`` along the shortest turn."""
    turn = Rotation.from_matrix(np.swapaxes(start, 1, 2) @ end).as_rotvec()
    return np.asarray(start @ Rotation.from_rotvec(np.reshape(weight, (-1, 1)) * turn).as_matrix())


def rotate(rotation: Float64[np.ndarray, "N 3 3"], vector: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "N 3"]:
    """One vector turned by each rotation."""
    return np.asarray(rotation @ vector)


def frames_along(
    along: Float64[np.ndarray, "N 3"], towards: Float64[np.ndarray, "N 3"]
) -> Float64[np.ndarray, "N 3 3"]:
    """Orthonormal frames: first column along ``along``, second as near to ``towards`` as can be."""
    first = along / np.linalg.norm(along, axis=1, keepdims=True)
    second = towards - np.sum(towards * first, axis=1, keepdims=True) * first
    second = second / np.linalg.norm(second, axis=1, keepdims=True)
    return np.stack([first, second, np.cross(first, second)], axis=2)


def smoothstep(weight: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    """From 0 to 1 without corners, and constant beyond."""
    inside = np.clip(weight, 0.0, 1.0)
    return np.clip(inside**3 * (10.0 - 15.0 * inside + 6.0 * inside**2), 0.0, 1.0)
