"""Tops and trousers, cut from the base mesh's tights along lines drawn on the unshaped body.

All lengths of a pattern are those of the base mesh (1.67 m tall); they follow each body's shape.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32

from perpetua.actors.bodies.rig import joint_index
from perpetua.actors.clothing.collar import collar
from perpetua.actors.clothing.drape import Drape, draped, hemmed, smooth_normals, wrinkles
from perpetua.actors.clothing.fabrics import Fabric
from perpetua.actors.clothing.piece import Piece, Surface
from perpetua.actors.clothing.surface import averaging, positive, split
from perpetua.actors.clothing.unwrap import around
from perpetua.actors.clothing.wearer import Wearer, along_arm_m, arm_share, refined_group, template_joints
from perpetua.actors.types import ActorPart
from perpetua.rooms.types import Material

# Skin is hidden where cloth covers it by more than this: nobody looks further up a sleeve.
COVERED_MARGIN_M = 0.030
_HEM_M = 0.022
_FAR_M = 1.0
_NECK_HALF_WIDTH_M = 0.078
_NECK_Z_M = 0.600
_SHORT_SLEEVE_M = 0.30
# The middle of the trunk from back to front at some heights.
_TRUNK_Z_M = (0.0, 0.06, 0.12, 0.18, 0.24, 0.36, 0.42, 0.48, 0.54, 0.60)
_TRUNK_CENTRE_M = (0.017, 0.016, 0.033, 0.046, 0.060, 0.063, 0.057, 0.034, 0.022, 0.019)
_TRUNK_RADIUS_M = 0.15
_ARM_RADIUS_M = 0.055
_LEG_RADIUS_M = 0.085


@dataclass(frozen=True)
class TopPattern:
    """A top: length of the sleeves from the shoulder, height of the hem, neckline, and how loose it hangs."""

    sleeve_m: float
    hem_z_m: float
    neck_drop_m: float
    vee: bool
    collar: str
    ease_m: float
    thickness_m: float


@dataclass(frozen=True)
class TrouserPattern:
    """Trousers: height of waistband and of the legs' ends, and how loose they are at hip and hem."""

    waist_z_m: float
    leg_z_m: float
    hip_ease_m: float
    leg_ease_m: float
    thickness_m: float


def top_field_m(
    pattern: TopPattern, template_m: Float64[np.ndarray, "P 3"], weights: Float64[np.ndarray, "P J"]
) -> Float64[np.ndarray, " P"]:
    """Metres inside the top's cut lines, on the base mesh; negative outside."""
    arm = arm_share(weights)
    sleeve = np.where(arm > 0.4, pattern.sleeve_m - along_arm_m(template_m), _FAR_M)
    hem = np.where(arm > 0.4, _FAR_M, template_m[:, 2] - pattern.hem_z_m)
    neck = _neckline_field_m(pattern, template_m)
    return np.minimum(np.minimum(sleeve, hem), neck)


def _neckline_field_m(pattern: TopPattern, template_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """About metres outside an opening around the neck that is deeper in front than at the nape."""
    side = np.abs(template_m[:, 1]) / _NECK_HALF_WIDTH_M
    front = np.clip((template_m[:, 0] + 0.06) / 0.13, 0.0, 1.0)
    drop_m = 0.012 + (pattern.neck_drop_m - 0.012) * front * front * (3.0 - 2.0 * front)
    below = np.maximum(_NECK_Z_M - template_m[:, 2], 0.0) / drop_m
    round_, pointed = np.hypot(side, below), side + below
    opening = (1.0 - front) * round_ + front * pointed if pattern.vee else round_
    return np.asarray((opening - 1.0) * _NECK_HALF_WIDTH_M)


def trouser_field_m(
    pattern: TrouserPattern, template_m: Float64[np.ndarray, "P 3"], weights: Float64[np.ndarray, "P J"]
) -> Float64[np.ndarray, " P"]:
    """Metres inside the trousers' cut lines, on the base mesh; negative outside."""
    height = template_m[:, 2]
    inside = np.minimum(pattern.waist_z_m - height, height - pattern.leg_z_m)
    return np.where(arm_share(weights) > 0.3, -_FAR_M, inside)


def covered_by(field_m: Float64[np.ndarray, " P"]) -> Bool[np.ndarray, " P"]:
    """Vertices that a garment hides for good."""
    return np.asarray(field_m > COVERED_MARGIN_M)


def material(name: str, fabric: Fabric) -> Material:
    """The material of a fabric; meshes' UVs are in tiles of it."""
    return Material(name=name, base_color=(0.5, 0.5, 0.5), roughness=fabric.roughness, image=fabric.image)


def _onto(weights: Float64[np.ndarray, "P J"], moves: dict[str, tuple[str, float]]) -> Float64[np.ndarray, "P J"]:
    """Moves a share of one joint's weight to another joint, on both sides."""
    moved = weights.copy()
    for source, (goal, share) in moves.items():
        for side in ("left", "right"):
            part = share * moved[:, joint_index(f"{side}_{source}")]
            moved[:, joint_index(f"{side}_{source}")] -= part
            moved[:, joint_index(f"{side}_{goal}")] += part
    return moved


def _eased_weights(surface: Surface, passes: int) -> Float64[np.ndarray, "P J"]:
    """Cloth bends over a longer stretch than the skin under it."""
    mean = averaging(surface.faces, len(surface.weights))
    weights = surface.weights
    for _ in range(passes):
        weights = np.asarray(0.5 * (weights + mean @ weights))
    return weights


def _side(template_m: Float64[np.ndarray, "P 3"], faces: Int32[np.ndarray, "F 3"]) -> Bool[np.ndarray, " F"]:
    return np.asarray(template_m[faces, 1].mean(axis=1) > 0)


def _limb_uv(surface: Surface, chain: tuple[str, str], radius_m: float, seam: Float64[np.ndarray, "3"]) -> np.ndarray:
    """Both sides' limbs unrolled; a face belongs to the side of the body it is on."""
    joints = template_joints()
    uv = np.empty((len(surface.faces), 3, 2), dtype=np.float32)
    left = _side(surface.template_m, surface.faces)
    for side, chosen, mirror in (("left", left, 1.0), ("right", ~left, -1.0)):
        start, end = (joints[joint_index(f"{side}_{name}")] for name in chain)
        unrolled = around(
            surface.template_m, surface.faces[chosen], start, end, seam * np.array([1.0, mirror, 1.0]), radius_m
        )
        uv[chosen] = unrolled
    return uv


def _top_uv(surface: Surface, arm: Bool[np.ndarray, " F"]) -> Float32[np.ndarray, "F 3 2"]:
    # As if the trunk were a straight cylinder: centred at each height, as deep as wide.
    centre_m = np.interp(surface.template_m[:, 2], _TRUNK_Z_M, _TRUNK_CENTRE_M)
    straight_m = surface.template_m.copy()
    straight_m[:, 0] = (straight_m[:, 0] - centre_m) * 1.35
    hips, neck = np.zeros(3), np.array([0.0, 0.0, 0.6])
    uv = around(straight_m, surface.faces, neck, hips, np.array([-1.0, 0.0, 0.0]), _TRUNK_RADIUS_M)
    uv[arm] = _limb_uv(surface, ("shoulder", "wrist"), _ARM_RADIUS_M, np.array([0.0, -0.7, -0.7]))[arm]
    return uv


def _top_ease(pattern: TopPattern, surface: Surface) -> Float64[np.ndarray, " P"]:
    """Snug on the shoulders, looser below the chest, wider towards the sleeves' ends."""
    height = surface.template_m[:, 2]
    trunk = np.interp(height, [0.0, 0.2, 0.4, 0.52], [1.25, 1.5, 0.8, 0.3])
    along = along_arm_m(surface.template_m) / max(pattern.sleeve_m, 0.1)
    end = 0.85 if pattern.sleeve_m < _SHORT_SLEEVE_M else 0.45
    sleeve = np.interp(along, [0.0, 0.3, 0.7, 1.0], [0.3, 0.7, 0.9, end])
    arm = arm_share(surface.weights)
    return pattern.ease_m * ((1.0 - arm) * trunk + arm * sleeve)


def sew_top(wearer: Wearer, pattern: TopPattern, fabric: Fabric, rng: np.random.Generator) -> Piece:
    """A top on this body."""
    tights = refined_group(wearer, "helper-tights")
    cut, _ = positive(tights, top_field_m(pattern, tights.template_m, tights.weights))
    # The armhole is a seam: the cloth is cut there so that each side has its own grain.
    seamed, arm_field = split(cut, arm_share(cut.weights) - 0.5)
    field_m = np.maximum(top_field_m(pattern, seamed.template_m, seamed.weights), 0.0)
    ease_m = _top_ease(pattern, seamed)
    cloth_m = draped(seamed, ease_m, Drape(gap_m=0.35 * pattern.ease_m + 0.002, passes=40, hold=0.06))
    folds = wrinkles(seamed.template_m, np.array([0.2, 0.3, 0.9]), rng)
    depth_m = 0.28 * ease_m * np.clip(field_m / 0.05, 0.0, 1.0)
    cloth_m += (folds * depth_m)[:, None] * smooth_normals(replace(seamed, vertices_m=cloth_m))
    weights = _onto(_eased_weights(seamed, 6), {"wrist": ("forearm", 0.9)})
    outside = Surface(seamed.template_m, cloth_m, weights, seamed.faces)
    field_m = _edge_field(outside, field_m)
    sewn, _, outer = hemmed(outside, field_m, _HEM_M, pattern.thickness_m)
    arm_faces = np.zeros(len(sewn.faces), dtype=bool)
    on_arm = np.concatenate([arm_field, np.zeros(len(sewn.vertices_m) - len(arm_field))])
    arm_faces[:outer] = on_arm[sewn.faces[:outer]].mean(axis=1) > 0
    arm_faces[outer:] = arm_share(sewn.weights)[sewn.faces[outer:]].mean(axis=1) > 0.5
    uv = _top_uv(sewn, arm_faces) / np.float32(fabric.tile_m)
    top = Piece(sewn.vertices_m, sewn.weights, (ActorPart("top", sewn.faces, uv, material("top", fabric)),))
    return collar(top, outside, field_m, pattern.collar, fabric)


def _edge_field(surface: Surface, field_m: Float64[np.ndarray, " P"]) -> Float64[np.ndarray, " P"]:
    """The field with zeros on every border vertex, so that hems are turned in all along."""
    exact = field_m.copy()
    exact[np.abs(exact) < 1e-6] = 0.0
    return exact


def sew_trousers(wearer: Wearer, pattern: TrouserPattern, fabric: Fabric, rng: np.random.Generator) -> Piece:
    """Trousers (or shorts) on this body."""
    tights = refined_group(wearer, "helper-tights")
    cut, _ = positive(tights, trouser_field_m(pattern, tights.template_m, tights.weights))
    seamed, _ = split(cut, cut.template_m[:, 1])
    field_m = np.maximum(trouser_field_m(pattern, seamed.template_m, seamed.weights), 0.0)
    height = seamed.template_m[:, 2]
    hip, leg = pattern.hip_ease_m, pattern.leg_ease_m
    ease_m = np.interp(height, [-0.75, -0.5, -0.25, -0.02, 0.15], [1.15 * leg, leg, 0.8 * leg, hip, 0.5 * hip])
    cloth_m = draped(seamed, ease_m, Drape(gap_m=0.4 * hip, passes=60, hold=0.04))
    depth_m = np.interp(height, [-0.76, -0.66, -0.5, -0.36, -0.2, 0.0], [0.005, 0.004, 0.0015, 0.004, 0.001, 0.002])
    folds = wrinkles(seamed.template_m, np.array([0.25, 0.15, 0.9]), rng)
    depth_m *= np.clip(field_m / 0.04, 0.0, 1.0) * leg / 0.02
    cloth_m += (folds * depth_m)[:, None] * smooth_normals(replace(seamed, vertices_m=cloth_m))
    weights = _onto(_eased_weights(seamed, 6), {"foot": ("ankle", 1.0), "ankle": ("knee", 0.75)})
    outside = Surface(seamed.template_m, cloth_m, weights, seamed.faces)
    sewn, _, _ = hemmed(outside, _edge_field(outside, field_m), _HEM_M, pattern.thickness_m)
    uv = _limb_uv(sewn, ("hip", "ankle"), _LEG_RADIUS_M, np.array([0.1, -1.0, 0.0])) / np.float32(fabric.tile_m)
    return Piece(sewn.vertices_m, sewn.weights, (ActorPart("trousers", sewn.faces, uv, material("trousers", fabric)),))


def without(piece: Piece, hidden: Bool[np.ndarray, " P"]) -> Piece:
    """The piece without faces that lie wholly among hidden vertices."""
    parts = []
    for part in piece.parts:
        seen = ~np.all(hidden[part.faces], axis=1)
        parts.append(ActorPart(part.name, part.faces[seen], part.uv[seen], part.material))
    return Piece(piece.vertices_m, piece.weights, tuple(parts))
