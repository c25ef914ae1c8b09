"""Locks of hair: ribbons that follow the skull and fall."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int32
from scipy.spatial import cKDTree

from perpetua.actors.base.base_mesh import BODY_VERTEX_COUNT, base_mesh
from perpetua.actors.base.piece import Surface
from perpetua.actors.base.surface import triangles, vertex_normals
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.bodies.hair_styles import HairStyle
from perpetua.actors.bodies.scalp import scalp_field_m

_SHORT_ROWS, _LONG_ROWS = 6, 11
_LONG_M = 0.12
# Locks this much farther from the skin than they must be hang in the air.
_CLOSE_M = 0.012
# The image of strands is this wide.
STRAND_TILE_M = 0.05
_LIE = np.array([0.0, 0.0, -0.15])
_FALL = np.array([0.0, 0.0, -1.0])
# Where tied hair is held, and the crown, on the base mesh.
TIE_M = np.array([-0.035, 0.0, 0.775])
CROWN_M = np.array([0.035, 0.0, 0.848])


def _roots(cap: Surface, count: int, rng: np.random.Generator) -> Int32[np.ndarray, " L"]:
    """Faces of the cap that carry a lock, spread evenly: each new one is the farthest of some random candidates."""
    middle = cap.template_m[cap.faces].mean(axis=1)
    chosen = [int(rng.integers(len(middle)))]
    distance = np.linalg.norm(middle - middle[chosen[0]], axis=1)
    for _ in range(count - 1):
        candidates = rng.integers(len(middle), size=24)
        best = int(candidates[np.argmax(distance[candidates])])
        chosen.append(best)
        distance = np.minimum(distance, np.linalg.norm(middle - middle[best], axis=1))
    return np.array(chosen, dtype=np.int32)


@dataclass(frozen=True)
class _Skull:
    """The skin that locks lie on: its points, normals and places on the base mesh, with a search tree."""

    places_m: Float64[np.ndarray, "P 3"]
    normals: Float64[np.ndarray, "P 3"]
    template_m: Float64[np.ndarray, "P 3"]
    tree: cKDTree


def _skull(wearer: Wearer) -> _Skull:
    template_m = base_mesh().vertices_m[:BODY_VERTEX_COUNT]
    faces = triangles(base_mesh().groups["body"].faces)
    normals = vertex_normals(wearer.vertices_m, faces)[:BODY_VERTEX_COUNT]
    # Locks lie over ears, not around them.
    upper = (template_m[:, 2] > 0.35) & ~(_near_ear(template_m) & (np.abs(template_m[:, 1]) > 0.079))
    places_m = wearer.vertices_m[:BODY_VERTEX_COUNT][upper]
    return _Skull(places_m, normals[upper], template_m[upper], cKDTree(places_m))


def _combed(
    template_m: Float64[np.ndarray, "L 3"],
    normal: Float64[np.ndarray, "L 3"],
    style: HairStyle,
    rng: np.random.Generator,
) -> Float64[np.ndarray, "L 3"]:
    """Directions in which locks leave their roots: away from the crown, swept and parted as the style has it."""
    front = np.clip((template_m[:, 0] - 0.05) / 0.06, 0.0, 1.0)[:, None]
    away = TIE_M - template_m if style.tied is not None else template_m - CROWN_M
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
    # What is swept back rises over the forehead first.
    away += (
        0.6
        * style.sweep
        * np.concatenate([np.ones_like(front), np.zeros_like(front), -front * (style.sweep < 0.0)], axis=1)
    )
    parted = np.sign(template_m[:, 1] - 0.025)[:, None]
    backward = -1.1 if style.length_m > _LONG_M else -0.45
    sideways = np.concatenate([np.full_like(parted, backward), 1.2 * parted, np.full_like(parted, -0.3)], axis=1)
    aside = style.part * front
    direction = (1.0 - aside) * away + aside * sideways
    direction -= np.sum(direction * normal, axis=1, keepdims=True) * normal
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-6)
    return np.asarray(direction + style.tousle * rng.standard_normal(direction.shape))


def _near_ear(template_m: Float64[np.ndarray, "P 3"]) -> Bool[np.ndarray, " P"]:
    x, side, z = template_m[:, 0], np.abs(template_m[:, 1]), template_m[:, 2]
    return np.asarray((side > 0.072) & (x > -0.005) & (x < 0.08) & (z > 0.68) & (z < 0.78))


def _settle(
    place: Float64[np.ndarray, "L 3"], skull: _Skull, clearance_m: Float64[np.ndarray, " L"], style: HairStyle
) -> tuple[Float64[np.ndarray, "L 3"], Float64[np.ndarray, "L 3"], Bool[np.ndarray, " L"]]:
    """Lays points on the skull at their clearance, keeps them off the face, and lets them hang clear elsewhere.

    Returns:
        The points, the directions of the skin that they lie on (zero where they hang in the air), and which of them
        lie on the scalp.
    """
    _, near = skull.tree.query(place)
    template_m = skull.template_m[near]
    curtain = style.length_m > _LONG_M
    face = curtain & (template_m[:, 0] > 0.07) & (template_m[:, 2] < 0.775) & (template_m[:, 2] > 0.58)
    # A fringe parts gradually, from the hairline down to the eyes.
    open_m = np.interp(template_m[:, 2], [0.72, 0.775], [0.068, 0.035])
    aside = np.where(face, np.maximum(open_m - np.abs(place[:, 1]), 0.0), 0.0)
    place = place + (np.sign(place[:, 1]) * aside)[:, None] * np.array([0.0, 1.0, 0.0])
    _, near = skull.tree.query(place)
    gap = np.sum((place - skull.places_m[near]) * skull.normals[near], axis=1)
    on_scalp = scalp_field_m(skull.template_m[near], style.line_shift_m) > -0.012
    # Over shoulders and back there is cloth between hair and skin; ears stand off the head.
    clearance_m = clearance_m + 0.018 * np.clip((0.57 - skull.template_m[near, 2]) / 0.03, 0.0, 1.0)
    ear = curtain & _near_ear(skull.template_m[near])
    clearance_m = clearance_m + np.where(ear, 0.010, 0.0)
    lift = np.where(on_scalp, clearance_m - gap, np.maximum(clearance_m - gap, 0.0))
    lies = on_scalp | (gap < clearance_m + _CLOSE_M)
    return place + lift[:, None] * skull.normals[near], skull.normals[near] * lies[:, None], on_scalp


def _inward(place: Float64[np.ndarray, "L 3"], root_m: Float64[np.ndarray, "L 3"]) -> Float64[np.ndarray, "L 3"]:
    """Which way hanging locks lean: towards the neck where the head is wider than it."""
    middle = root_m.mean(axis=0) - np.array([0.01, 0.0, 0.0])
    out = (place - middle) * np.array([1.0, 1.0, 0.0])
    reach_m = np.linalg.norm(out, axis=1, keepdims=True)
    above = np.clip((place[:, 2:] - middle[2] + 0.20) / 0.06, 0.0, 1.0)
    return np.asarray(-out / np.maximum(reach_m, 1e-6) * np.clip((reach_m - 0.09) / 0.06, 0.0, 0.4) * above)


def grow_spines(
    cap: Surface, cap_normal: np.ndarray, wearer: Wearer, style: HairStyle, rng: np.random.Generator
) -> tuple[Float64[np.ndarray, "L R 3"], Float64[np.ndarray, "L R 3"]]:
    """Spines of the locks and the directions of the skin under them."""
    faces = cap.faces[_roots(cap, style.locks, rng)]
    root_m, normal = cap.vertices_m[faces].mean(axis=1), cap_normal[faces].mean(axis=1)
    template_m = cap.template_m[faces].mean(axis=1)
    heading = _combed(template_m, normal, style, rng)
    front = np.clip((template_m[:, 0] - 0.06) / 0.06, 0.0, 1.0)
    length = style.length_m + (style.front_length_m - style.length_m) * front
    length = length * rng.uniform(0.8, 1.1, len(length))
    skull = _skull(wearer)
    clearance_m = style.cap_m * rng.uniform(0.6, 1.15, len(length)) + 0.003
    wave = rng.uniform(0.0, 2.0 * np.pi, len(length))
    spine, normals, held = [root_m - 0.004 * normal], [normal], np.ones(len(length), dtype=bool)
    lie = np.zeros(3) if style.tied is not None else _LIE
    rows = _LONG_ROWS if style.length_m > _LONG_M else _SHORT_ROWS
    for row in range(1, rows):
        # On the scalp locks keep their direction; beyond it they fall.
        heading = np.where(held[:, None], heading + lie, 0.2 * heading + _FALL + _inward(spine[-1], root_m))
        heading -= 0.9 * np.minimum(np.sum(heading * normals[-1], axis=1, keepdims=True), 0.0) * normals[-1]
        heading /= np.linalg.norm(heading, axis=1, keepdims=True)
        place = spine[-1] + heading * (length / (rows - 1))[:, None]
        place += style.curl_m * np.sin(1.9 * row + wave)[:, None] * np.cross(heading, normals[-1])
        rise_m = clearance_m + style.lift * length * (row / (rows - 1)) ** 1.5
        place, outward, held = _settle(place, skull, rise_m, style)
        heading = place - spine[-1]
        heading /= np.maximum(np.linalg.norm(heading, axis=1, keepdims=True), 1e-6)
        spine.append(place)
        normals.append(outward)
    return np.stack(spine, axis=1), np.stack(normals, axis=1)


def make_locks(
    spine: Float64[np.ndarray, "L R 3"],
    normal: Float64[np.ndarray, "L R 3"],
    style: HairStyle,
    rng: np.random.Generator,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Thin ribbons that lie on each other and taper to a tip."""
    locks, rows, _ = spine.shape
    along = np.gradient(spine, axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-9)
    # Where a lock hangs in the air its ribbon keeps facing as it did on the skin.
    facing = normal.copy()
    for row in range(1, rows):
        hangs = np.linalg.norm(facing[:, row], axis=1) < 0.5
        facing[hangs, row] = facing[hangs, row - 1] * np.array([1.0, 1.0, 0.3])
    across = np.cross(along, facing)
    across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), 1e-9)
    taper = np.interp(np.linspace(0.0, 1.0, rows), [0.0, 0.25, 0.7, 1.0], [0.8, 1.0, 0.9, 0.15])
    half = 0.5 * style.width_m * taper[None, :, None] * rng.uniform(0.7, 1.3, locks)[:, None, None]
    vertices = np.stack([spine - half * across, spine + half * across], axis=2)
    grid = np.arange(locks * rows * 2).reshape(locks, rows, 2)
    a, b = grid[:, :-1, 0].ravel(), grid[:, :-1, 1].ravel()
    c, d = grid[:, 1:, 1].ravel(), grid[:, 1:, 0].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]).astype(np.int32)
    start = rng.uniform(0.0, 1.0, locks)[:, None, None]
    u = np.broadcast_to(start + np.array([0.0, style.width_m / STRAND_TILE_M]), (locks, rows, 2))
    v = np.broadcast_to(np.linspace(1.0, 0.0, rows)[None, :, None] * style.length_m / 0.2 + start, (locks, rows, 2))
    flat = np.stack([u, v], axis=3).reshape(-1, 2)
    return vertices.reshape(-1, 3), faces, flat[faces].astype(np.float32)
