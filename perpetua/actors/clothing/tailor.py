"""Tops, trousers and skirts, cut from the base mesh's tights and skirt and laid on a body."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial import cKDTree

from perpetua.actors.base.piece import Piece, Surface
from perpetua.actors.base.rig import joint_index
from perpetua.actors.base.surface import averaging, border_edges, positive, split
from perpetua.actors.base.wearer import Wearer, along_arm_m, along_leg_m, arm_weight, refined_group
from perpetua.actors.clothing.collar import collar
from perpetua.actors.clothing.details import back_pockets_m, buttons, chest_pocket_m, joined, patch, placket
from perpetua.actors.clothing.drape import Drape, draped, hemmed, smooth_normals
from perpetua.actors.clothing.fabrics import Fabric
from perpetua.actors.clothing.folds import skirt_folds, top_folds, trouser_folds
from perpetua.actors.clothing.patterns import (
    SkirtPattern,
    TopPattern,
    TrouserPattern,
    skirt_field_m,
    top_field_m,
    trouser_field_m,
)
from perpetua.actors.clothing.unwrap import front_m, limbs, trunk, unrolled
from perpetua.scene.actor import ActorPart
from perpetua.scene.room import Material

_HEM_M = 0.022
_SHORT_SLEEVE_M = 0.30
_ARM_RADIUS_M = 0.055
_LEG_RADIUS_M = 0.085
_SKIRT_RADIUS_M = 0.19
# What a top covers by more than this is left out of trousers: it cannot show, and must not poke through.
_TUCKED_M = 0.025


_BUTTON = Material("button", (0.6, 0.58, 0.52), roughness=0.35, image=np.full((8, 8, 3), (205, 200, 190), np.uint8))

# Cuffs do not turn with the hand, and a hem hangs from the waist a little more than what it covers; one at the waist
# does not follow the thighs at all.
_CUFF_MOVE = ("forearm", 0.9)
_HEM_MOVES = {True: ("pelvis", 1.0), False: ("pelvis", 0.12)}
_AT_WAIST_Z_M = 0.05


def _material(name: str, fabric: Fabric) -> Material:
    return Material(name=name, base_color=(0.5, 0.5, 0.5), roughness=fabric.roughness, image=fabric.image)


def _onto(weights: Float64[np.ndarray, "P J"], moves: dict[str, tuple[str, float]]) -> Float64[np.ndarray, "P J"]:
    """Moves a fraction of one joint's weight to another joint of its side, or to the pelvis."""
    moved = weights.copy()
    for source, (goal, fraction) in moves.items():
        for side in ("left", "right"):
            part = fraction * moved[:, joint_index(f"{side}_{source}")]
            moved[:, joint_index(f"{side}_{source}")] -= part
            moved[:, joint_index(goal if goal == "pelvis" else f"{side}_{goal}")] += part
    return moved


def _eased_weights(surface: Surface, passes: int) -> Float64[np.ndarray, "P J"]:
    """Cloth bends over a longer stretch than the skin under it."""
    mean = averaging(surface.faces, len(surface.weights))
    weights = surface.weights
    for _ in range(passes):
        weights = np.asarray(0.5 * (weights + mean @ weights))
    return weights


def _edged(surface: Surface, field_m: Float64[np.ndarray, " P"]) -> Float64[np.ndarray, " P"]:
    """The field with exact zeros on the cut edges and nowhere else."""
    edged = np.maximum(field_m, 1e-5)
    edged[border_edges(surface.faces).ravel()] = 0.0
    return edged


def _top_ease_m(pattern: TopPattern, surface: Surface) -> Float64[np.ndarray, " P"]:
    """Snug on the shoulders, looser below the chest, wider towards the ends of short sleeves."""
    height = surface.template_m[:, 2]
    body = np.interp(height, [0.0, 0.2, 0.4, 0.48, 0.54], [1.35, 1.5, 0.8, 0.4, 0.2])
    along = along_arm_m(surface.template_m) / max(pattern.sleeve_m, 0.1)
    end = 0.85 if pattern.sleeve_m < _SHORT_SLEEVE_M else 0.45
    sleeve = np.interp(along, [0.0, 0.3, 0.7, 1.0], [0.25, 0.7, 0.9, end])
    arm = arm_weight(surface.weights)
    return pattern.ease_m * ((1.0 - arm) * body + arm * sleeve)


def _top_hold(pattern: TopPattern, surface: Surface, field_m: Float64[np.ndarray, " P"]) -> Float64[np.ndarray, " P"]:
    """Tops hang from the shoulders; ribbed hems and cuffs stay where they are, others hardly."""
    shoulders = np.interp(surface.template_m[:, 2], [0.38, 0.50], [0.06, 0.30])
    cuff = np.clip(1.0 - field_m / 0.04, 0.0, 1.0) * (pattern.sleeve_m > _SHORT_SLEEVE_M) * arm_weight(surface.weights)
    band = np.clip(1.0 - field_m / 0.04, 0.0, 1.0) * (1.0 - arm_weight(surface.weights)) * (pattern.thickness_m > 0.004)
    return np.maximum(shoulders, 0.25 * np.maximum(cuff, band))


def sew_top(
    wearer: Wearer, pattern: TopPattern, fabric: Fabric, rng: np.random.Generator, over: TopPattern | None = None
) -> Piece:
    """A top on this body, without what another one worn over it hides."""
    tights = refined_group(wearer, "helper-tights")
    cut, _ = positive(tights, top_field_m(pattern, tights.template_m, tights.weights))
    # Armholes, sides and shoulders are seams: cloth is cut there, so that each panel has its own grain.
    cut, _ = split(cut, arm_weight(cut.weights) - 0.5)
    seamed, _ = split(cut, front_m(cut.template_m))
    field_m = _edged(seamed, top_field_m(pattern, seamed.template_m, seamed.weights))
    ease_m = _top_ease_m(pattern, seamed)
    gap_m = 0.30 * pattern.ease_m + 0.002 + 0.007 * np.clip((0.16 - seamed.template_m[:, 2]) / 0.08, 0.0, 1.0)
    edge = np.clip(field_m / 0.03, 0.0, 1.0)
    arm = arm_weight(seamed.weights)
    long_sleeves = pattern.sleeve_m > _SHORT_SLEEVE_M
    fold_m = pattern.fold_m * (0.35 + 0.65 * edge) * top_folds(seamed.template_m, arm, long_sleeves, rng)
    # Below the chest a top spans hollows; sleeves and shoulders fit.
    bridge = np.interp(seamed.template_m[:, 2], [0.12, 0.30], [0.85, 0.0]) * (arm < 0.3)
    how = Drape(gap_m, _top_hold(pattern, seamed, field_m), fold_m, bridge)
    cloth_m = draped(seamed, ease_m, how)
    moves = {"wrist": _CUFF_MOVE, "hip": _HEM_MOVES[pattern.hem_z_m > _AT_WAIST_Z_M]}
    outside = replace(seamed, vertices_m=cloth_m, weights=_onto(_eased_weights(seamed, 6), moves))
    sewn = hemmed(outside, field_m, _HEM_M, pattern.thickness_m)
    on_arm = arm_weight(_template_weights(sewn, seamed))[sewn.faces].mean(axis=1) > 0.5
    uv = trunk(sewn)
    uv[on_arm] = limbs(sewn, ("shoulder", "elbow", "wrist"), _ARM_RADIUS_M, (0.0, -0.7, -0.7))[on_arm]
    shown = np.ones(len(sewn.faces), dtype=bool) if over is None else ~_hidden_by(over, sewn)
    part = ActorPart("top", sewn.faces[shown], uv[shown] / np.float32(fabric.tile_m), _material("top", fabric))
    finished = collar(Piece(sewn.vertices_m, sewn.weights, (part,)), outside, pattern.collar, fabric)
    return joined((finished, *_top_details(pattern, outside, fabric)))


def _top_details(pattern: TopPattern, outside: Surface, fabric: Fabric) -> tuple[Piece, ...]:
    """Placket, buttons and pocket."""
    shade = _material("top", fabric)
    pieces: list[Piece] = []
    if pattern.buttons_to_z_m is not None:
        strip, template_m = placket(outside, front_m(outside.template_m), pattern.buttons_to_z_m, shade, fabric.tile_m)
        pieces += [strip, buttons(strip, template_m, _BUTTON)]
    if pattern.pocket:
        pieces.append(patch(outside, chest_pocket_m(outside.template_m), 0.0018, "pocket", shade, fabric.tile_m)[0])
    return tuple(pieces)


def _template_weights(sewn: Surface, seamed: Surface) -> Float64[np.ndarray, "P J"]:
    """The sewn cloth's weights before they were eased, on its outer side; armholes are seams of those."""
    return np.concatenate([seamed.weights, sewn.weights[len(seamed.weights) :]])


def sew_trousers(
    wearer: Wearer, pattern: TrouserPattern, top: TopPattern, fabric: Fabric, rng: np.random.Generator
) -> Piece:
    """Trousers (or shorts) on this body, worn under the top."""
    tights = refined_group(wearer, "helper-tights")
    cut, _ = positive(tights, trouser_field_m(pattern, tights.template_m, tights.weights))
    # One leg each side of the middle seam.
    seamed, _ = split(cut, cut.template_m[:, 1])
    field_m = _edged(seamed, trouser_field_m(pattern, seamed.template_m, seamed.weights))
    hip, leg = pattern.hip_ease_m, pattern.leg_ease_m
    below = along_leg_m(seamed.template_m)
    # Legs are cut straight: at the ankle there is most room.
    ease_m = np.interp(
        below,
        [-0.1, 0.05, 0.25, 0.42, 0.55, 0.68, 0.80],
        [0.5 * hip, hip, 0.8 * leg, leg, 0.8 * leg, 1.3 * leg, 1.6 * leg],
    )
    hold = np.maximum(np.interp(below, [-0.02, 0.02], [0.25, 0.0]), 0.2 * np.clip(1.0 - field_m / 0.03, 0.0, 1.0))
    edge = np.clip(field_m / 0.03, 0.0, 1.0)
    fold_m = pattern.fold_m * (0.35 + 0.65 * edge) * trouser_folds(seamed.template_m, rng)
    snug = _tucked_in(top, seamed)
    gap_m = 0.4 * hip * snug
    how = Drape(gap_m, np.maximum(hold, 0.5 * (1.0 - snug)), snug * fold_m, np.zeros(len(gap_m)))
    cloth_m = draped(seamed, snug * ease_m, how)
    folded = replace(seamed, vertices_m=cloth_m)
    weights = _onto(_eased_weights(seamed, 6), {"foot": ("ankle", 1.0), "ankle": ("knee", 0.75)})
    sewn = hemmed(replace(folded, weights=weights), field_m, _HEM_M, pattern.thickness_m)
    legs = _under(top, sewn, limbs(sewn, ("hip", "knee", "ankle"), _LEG_RADIUS_M, (0.1, -1.0, 0.0)), fabric, "trousers")
    if not pattern.pockets:
        return legs
    outside = replace(folded, weights=weights)
    pockets, _ = patch(
        outside, back_pockets_m(outside.template_m), 0.002, "pockets", _material("trousers", fabric), fabric.tile_m
    )
    return joined((legs, pockets))


def _tucked_in(top: TopPattern, surface: Surface) -> Float64[np.ndarray, " P"]:
    """Share of its room that a garment keeps where a top goes over it, which must have space: less from the hem up."""
    inside_m = top_field_m(top, surface.template_m, surface.weights)
    return np.interp(inside_m, [-0.035, 0.0, _TUCKED_M], [1.0, 0.35, 0.15])


def _hidden_by(top: TopPattern, sewn: Surface) -> Bool[np.ndarray, " F"]:
    """Faces of a garment that lie well under a top."""
    tucked = top_field_m(top, sewn.template_m, sewn.weights) > _TUCKED_M
    return np.asarray(np.all(tucked[sewn.faces], axis=1))


def _under(top: TopPattern, sewn: Surface, uv: np.ndarray, fabric: Fabric, name: str) -> Piece:
    """A finished garment without the faces that the top hides."""
    shown = ~_hidden_by(top, sewn)
    part = ActorPart(name, sewn.faces[shown], uv[shown] / np.float32(fabric.tile_m), _material(name, fabric))
    return Piece(sewn.vertices_m, sewn.weights, (part,))


def sew_skirt(
    wearer: Wearer, pattern: SkirtPattern, top: TopPattern, fabric: Fabric, rng: np.random.Generator
) -> Piece:
    """A skirt on this body, worn under the top."""
    helper = refined_group(wearer, "helper-skirt")
    cut, _ = positive(helper, skirt_field_m(pattern, helper.template_m, helper.weights))
    field_m = _edged(cut, skirt_field_m(pattern, cut.template_m, cut.weights))
    outward = smooth_normals(cut)
    snug = _tucked_in(top, cut)
    eased_m = _fitted(wearer, cut) + (snug * pattern.hip_ease_m)[:, None] * outward
    height_m = 0.013 * snug * skirt_folds(cut.template_m, pattern.hem_z_m, rng)
    folded = replace(cut, vertices_m=eased_m + height_m[:, None] * outward)
    sewn = hemmed(replace(folded, weights=_skirt_weights(cut)), field_m, _HEM_M, pattern.thickness_m)
    middle = np.array([0.02, 0.0, 0.1])
    uv = unrolled(
        sewn.template_m,
        sewn.faces,
        middle,
        middle - np.array([0.0, 0.0, 1.0]),
        np.array([-1.0, 0.0, 0.0]),
        _SKIRT_RADIUS_M,
    )
    return _under(top, sewn, uv, fabric, "skirt")


def _fitted(wearer: Wearer, skirt: Surface) -> Float64[np.ndarray, "P 3"]:
    """The skirt drawn in to the hips above the thighs, where the top goes over it."""
    tights = refined_group(wearer, "helper-tights")
    normal = smooth_normals(tights)
    _, near = cKDTree(tights.vertices_m).query(skirt.vertices_m)
    gap_m = np.einsum("pa,pa->p", skirt.vertices_m - tights.vertices_m[near], normal[near])
    allowed_m = np.interp(skirt.template_m[:, 2], [-0.14, -0.02], [0.20, 0.001])
    return np.asarray(skirt.vertices_m - np.maximum(gap_m - allowed_m, 0.0)[:, None] * normal[near])


def _skirt_weights(surface: Surface) -> Float64[np.ndarray, "P J"]:
    """A skirt hangs from the pelvis and is carried along by both thighs, on each side mostly by its own."""
    down = np.clip((0.02 - surface.template_m[:, 2]) / 0.30, 0.0, 1.0)
    left = np.clip(0.5 + surface.template_m[:, 1] / 0.16, 0.0, 1.0)
    weights = np.zeros_like(surface.weights)
    weights[:, joint_index("pelvis")] = 1.0 - 0.9 * down
    weights[:, joint_index("left_hip")] = 0.9 * down * left
    weights[:, joint_index("right_hip")] = 0.9 * down * (1.0 - left)
    return weights
