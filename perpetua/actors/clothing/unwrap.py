"""Texture coordinates in metres: sleeves and legs are unrolled around their own axes, the trunk in two panels."""

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32

from perpetua.actors.base.piece import Surface
from perpetua.actors.base.rig import joint_index
from perpetua.actors.base.wearer import template_joints

_TRUNK_RADIUS_M = 0.15
_TRUNK_DEPTH = 1.35
# The middle of the trunk from back to front at some heights.
_TRUNK_Z_M = (0.0, 0.06, 0.12, 0.18, 0.24, 0.36, 0.42, 0.48, 0.54, 0.60)
_TRUNK_CENTRE_M = (0.017, 0.016, 0.033, 0.046, 0.060, 0.063, 0.057, 0.034, 0.022, 0.019)
_YOKE_Z_M = 0.44


def unrolled(
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


def limbs(
    surface: Surface, chain: tuple[str, str, str], radius_m: float, seam: tuple[float, float, float]
) -> Float32[np.ndarray, "F 3 2"]:
    """Both sides' limbs unrolled along three joints; a face belongs to the side of the body that it is on.

    ``seam`` points to the left limb's seam; the right one's is its mirror image.
    """
    joints = template_joints()
    uv = np.empty((len(surface.faces), 3, 2), dtype=np.float32)
    left = surface.template_m[surface.faces, 1].mean(axis=1) > 0
    for side, chosen, mirror in (("left", left, 1.0), ("right", ~left, -1.0)):
        start, bend, end = (joints[joint_index(f"{side}_{name}")] for name in chain)
        towards = np.array(seam) * np.array([1.0, mirror, 1.0])
        straight_m = _straightened(surface.template_m, start, bend, end)
        uv[chosen] = unrolled(straight_m, surface.faces[chosen], start, end, towards, radius_m)
    return uv


def _straightened(
    template_m: Float64[np.ndarray, "P 3"],
    start_m: Float64[np.ndarray, "3"],
    bend_m: Float64[np.ndarray, "3"],
    end_m: Float64[np.ndarray, "3"],
) -> Float64[np.ndarray, "P 3"]:
    """A bent limb with its bones moved sideways on to the line from its first joint to its last."""
    length_m = float(np.linalg.norm(end_m - start_m))
    axis = (end_m - start_m) / length_m
    at_bend_m = float((bend_m - start_m) @ axis)
    aside_m = bend_m - start_m - at_bend_m * axis
    fraction = np.interp((template_m - start_m) @ axis, [0.0, at_bend_m, length_m], [0.0, 1.0, 0.0])
    return np.asarray(template_m - fraction[:, None] * aside_m)


def front_m(template_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """How far in front of the trunk's middle; the side and shoulder seams are where this is 0."""
    return np.asarray(template_m[:, 0] - np.interp(template_m[:, 2], _TRUNK_Z_M, _TRUNK_CENTRE_M))


def trunk(surface: Surface) -> Float32[np.ndarray, "F 3 2"]:
    """Front and back panel, joined at the sides; above the chest they bend over the shoulders to the seam there."""
    deep_m, side_m, height_m = front_m(surface.template_m), surface.template_m[:, 1], surface.template_m[:, 2]
    in_front = deep_m[surface.faces].mean(axis=1) > 0
    yoke = np.clip((height_m - 0.40) / 0.10, 0.0, 1.0)
    over = np.arctan2(np.abs(deep_m), np.maximum(height_m - _YOKE_Z_M, 1e-9))
    up_m = np.where(height_m > _YOKE_Z_M, _YOKE_Z_M + 0.12 * (0.5 * np.pi - over), height_m)
    half_turn = np.pi * _TRUNK_RADIUS_M
    panels = []
    for sign in (1.0, -1.0):
        round_m = _TRUNK_RADIUS_M * np.arctan2(side_m, sign * _TRUNK_DEPTH * deep_m)
        across_m = (1.0 - yoke) * round_m + yoke * 1.1 * side_m
        panels.append(np.stack([across_m if sign > 0 else half_turn - across_m, up_m], axis=1)[surface.faces])
    return _by_face(in_front, panels[0], panels[1])


def _by_face(
    first: Bool[np.ndarray, " F"], one: Float64[np.ndarray, "F 3 2"], other: Float64[np.ndarray, "F 3 2"]
) -> Float32[np.ndarray, "F 3 2"]:
    return np.where(first[:, None, None], one, other).astype(np.float32)
