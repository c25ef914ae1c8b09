"""Patterns: where garments are cut, as fields over the unshaped base mesh.

All lengths of a pattern are those of the base mesh (1.67 m tall); they follow each body's shape.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.actors.base.rig import joint_index
from perpetua.actors.base.wearer import along_arm_m, along_leg_m, arm_weight, template_joints

# Skin is hidden where cloth covers it by more than this: nobody looks further up a sleeve.
COVERED_MARGIN_M = 0.030
_FAR_M = 1.0
_NECK_HALF_WIDTH_M = 0.078
_NECK_Z_M = 0.600
_FRONT_X_M = 0.03
_LOWEST_HEM_Z_M = -0.785


@dataclass(frozen=True)
class TopPattern:
    """A top: length of the sleeves from the shoulder, height of the hem, neckline, and how loose it hangs.

    ``neck_drop_m`` is the neckline's depth in front, ``vee`` makes it pointed; ``collar`` is a key of the collars.
    ``fold_m`` is the depth of folds; ``open_m`` half the width of an open front, 0 where it is closed;
    ``buttons_to_z_m`` gives it a placket with buttons down to that height, ``pocket`` a pocket on the chest.
    """

    sleeve_m: float
    hem_z_m: float
    neck_drop_m: float
    vee: bool
    collar: str
    ease_m: float
    thickness_m: float
    fold_m: float = 0.009
    open_m: float = 0.0
    buttons_to_z_m: float | None = None
    pocket: bool = False


@dataclass(frozen=True)
class TrouserPattern:
    """Trousers: height of the waistband, length of the legs from the hip, and how loose they are at hip and hem.

    ``fold_m`` is the depth of folds; ``pockets`` are sewn on behind.
    """

    waist_z_m: float
    leg_m: float
    hip_ease_m: float
    leg_ease_m: float
    thickness_m: float
    fold_m: float = 0.006
    pockets: bool = False


@dataclass(frozen=True)
class SkirtPattern:
    """A skirt: height of the waistband and of the hem, and how loose it is at the hip."""

    waist_z_m: float
    hem_z_m: float
    hip_ease_m: float
    thickness_m: float


def top_field_m(
    pattern: TopPattern, template_m: Float64[np.ndarray, "P 3"], weights: Float64[np.ndarray, "P J"]
) -> Float64[np.ndarray, " P"]:
    """Metres inside the top's cut lines, on the base mesh; negative outside."""
    arm = arm_weight(weights) > 0.4
    sleeve = np.where(arm, pattern.sleeve_m - along_arm_m(template_m), _FAR_M)
    hem = np.where(arm, _FAR_M, template_m[:, 2] - pattern.hem_z_m)
    head = weights[:, joint_index("head")] > 0.5
    inside = np.minimum(np.minimum(sleeve, hem), _neckline_field_m(pattern, template_m))
    if pattern.open_m > 0.0:
        inside = np.minimum(inside, np.where(arm, _FAR_M, _open_front_m(pattern.open_m, template_m)))
    return np.where(head, -_FAR_M, inside)


def _neckline_field_m(pattern: TopPattern, template_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """About metres outside an opening around the neck that is deeper in front than at the nape."""
    side = np.abs(template_m[:, 1]) / _NECK_HALF_WIDTH_M
    front = np.clip((template_m[:, 0] + 0.06) / 0.13, 0.0, 1.0)
    drop_m = 0.012 + (pattern.neck_drop_m - 0.012) * front * front * (3.0 - 2.0 * front)
    below = np.maximum(_NECK_Z_M - template_m[:, 2], 0.0) / drop_m
    opening = np.hypot(side, below)
    if pattern.vee:
        opening = (1.0 - front) * opening + front * (side + below)
    return np.asarray((opening - 1.0) * _NECK_HALF_WIDTH_M)


def _open_front_m(open_m: float, template_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """Metres beside an opening down the front that widens towards the hem and the neck."""
    half_m = open_m * np.interp(template_m[:, 2], [0.0, 0.15, 0.30, 0.50], [1.5, 1.0, 1.0, 1.6])
    return np.where(template_m[:, 0] > _FRONT_X_M, np.abs(template_m[:, 1]) - half_m, _FAR_M)


def trouser_field_m(
    pattern: TrouserPattern, template_m: Float64[np.ndarray, "P 3"], weights: Float64[np.ndarray, "P J"]
) -> Float64[np.ndarray, " P"]:
    """Metres inside the trousers' cut lines, on the base mesh; negative outside."""
    inside = np.minimum(pattern.waist_z_m - template_m[:, 2], pattern.leg_m - along_leg_m(template_m))
    # Long legs end above the floor, in front above the instep.
    ahead_m = np.maximum(template_m[:, 0] - template_joints()[joint_index("left_ankle"), 0] - 0.02, 0.0)
    inside = np.minimum(inside, template_m[:, 2] - _LOWEST_HEM_Z_M - 0.55 * ahead_m)
    return np.where(arm_weight(weights) > 0.3, -_FAR_M, inside)


def skirt_field_m(
    pattern: SkirtPattern, template_m: Float64[np.ndarray, "P 3"], weights: Float64[np.ndarray, "P J"]
) -> Float64[np.ndarray, " P"]:
    """Metres inside the skirt's cut lines, on the base mesh; negative outside."""
    inside = np.minimum(pattern.waist_z_m - template_m[:, 2], template_m[:, 2] - pattern.hem_z_m)
    return np.where(arm_weight(weights) > 0.3, -_FAR_M, inside)


def covered_by(fields_m: tuple[Float64[np.ndarray, " P"], ...]) -> Bool[np.ndarray, " P"]:
    """Vertices that garments hide for good: well inside one of them, or inside two at once.

    Args:
        fields_m: metres inside each garment's cut lines.
    """
    inside = np.stack(fields_m)
    return np.asarray(np.any(inside > COVERED_MARGIN_M, axis=0) | (np.sum(inside > 0.0, axis=0) > 1))
