"""Rigid transforms, named ``b_from_a`` so that neighbours cancel: ``c_from_b @ b_from_a``."""

import numpy as np
from jaxtyping import Float64


def invert_rigid(b_from_a: Float64[np.ndarray, "*batch 4 4"]) -> Float64[np.ndarray, "*batch 4 4"]:
    """Inverse of rotations and translations, without a general matrix inverse."""
    rotation = np.swapaxes(b_from_a[..., :3, :3], -1, -2)
    a_from_b = np.zeros_like(b_from_a)
    a_from_b[..., :3, :3] = rotation
    a_from_b[..., :3, 3] = -np.einsum("...ij,...j->...i", rotation, b_from_a[..., :3, 3])
    a_from_b[..., 3, 3] = 1.0
    return a_from_b


def transform_points(
    b_from_a: Float64[np.ndarray, "*batch 4 4"], points_a: Float64[np.ndarray, "*batch N 3"]
) -> Float64[np.ndarray, "*batch N 3"]:
    """Points of frame a in frame b."""
    moved = np.einsum("...ij,...nj->...ni", b_from_a[..., :3, :3], points_a)
    return np.asarray(moved + b_from_a[..., None, :3, 3])


def look_at(
    position_m: Float64[np.ndarray, "*batch 3"], target_m: Float64[np.ndarray, "*batch 3"]
) -> Float64[np.ndarray, "*batch 4 4"]:
    """``world_from_camera`` of a level camera (OpenCV axes) at ``position_m`` that looks at ``target_m``.

    The view direction must not be vertical.
    """
    forward = target_m - position_m
    forward = forward / np.linalg.norm(forward, axis=-1, keepdims=True)
    right = np.cross(forward, np.array([0.0, 0.0, 1.0]))
    right = right / np.linalg.norm(right, axis=-1, keepdims=True)
    world_from_camera = np.zeros((*position_m.shape[:-1], 4, 4))
    world_from_camera[..., :3, 0] = right
    world_from_camera[..., :3, 1] = np.cross(forward, right)
    world_from_camera[..., :3, 2] = forward
    world_from_camera[..., :3, 3] = position_m
    world_from_camera[..., 3, 3] = 1.0
    return world_from_camera
