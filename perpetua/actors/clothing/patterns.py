"""Patterns: where garments are cut, as fields over the unshaped base mesh.

All lengths of a pattern are those of the base mesh (1.67 m tall); they follow each body's shape.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.actors.bodies.rig import joint_index
from perpetua.actors.clothing.wearer import along_arm_m, along_leg_m, arm_share

# Skin is hidden where cloth covers it by more than this: nobody looks further up a sleeve.
COVERED_MARGIN_M = 0.030
_FAR_M = 1.0
_NECK_HALF_WIDTH_M = 0.078
_NECK_Z_M = 0.600


@dataclass(frozen=True)
class TopPattern:
    """A top: length of the sleeves from the shoulder, height of the hem, neckline, and how loose it hangs.

    ``neck_drop_m`` is the neckline's depth in front, ``vee`` makes it pointed; ``collar`` is a key of the collars.
    """

    sleeve_m: float
    hem_z_m: float
    neck_drop_m: float
    vee: bool
    collar: str
    ease_m: float
    thickness_m: float


@dataclass(frozen=True)
class TrouserPattern:
    """Trousers: height of the waistband, length of the legs from the hip, and how loose they are at hip and hem."""

    waist_z_m: float
    leg_m: float
    hip_ease_m: float
    leg_ease_m: float
    thickness_m: float


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
    arm = arm_share(weights) > 0.4
    sleeve = np.where(arm, pattern.sleeve_m - along_arm_m(template_m), _FAR_M)
    hem = np.where(arm, _FAR_M, template_m[:, 2] - pattern.hem_z_m)
    head = weights[:, joint_index("head")] > 0.5
    inside = np.minimum(np.minimum(sleeve, hem), _neckline_field_m(pattern, template_m))
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


def trouser_field_m(
    pattern: TrouserPattern, template_m: Float64[np.ndarray, "P 3"], weights: Float64[np.ndarray, "P J"]
) -> Float64[np.ndarray, " P"]:
    """Metres inside the trousers' cut lines, on the base mesh; negative outside."""
    inside = np.minimum(pattern.waist_z_m - template_m[:, 2], pattern.leg_m - along_leg_m(template_m))
    return np.where(arm_share(weights) > 0.3, -_FAR_M, inside)


def skirt_field_m(
    pattern: SkirtPattern, template_m: Float64[np.ndarray, "P 3"], weights: Float64[np.ndarray, "P J"]
) -> Float64[np.ndarray, " P"]:
    """Metres inside the skirt's cut lines, on the base mesh; negative outside."""
    inside = np.minimum(pattern.waist_z_m - template_m[:, 2], template_m[:, 2] - pattern.hem_z_m)
    return np.where(arm_share(weights) > 0.3, -_FAR_M, inside)


def covered_by(field_m: Float64[np.ndarray, " P"]) -> Bool[np.ndarray, " P"]:
    """Vertices that a garment hides for good."""
    return np.asarray(field_m > COVERED_MARGIN_M)
