"""Hair: a cap over the scalp under locks that follow the skull and fall."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int32
from scipy.spatial import cKDTree

from perpetua.actors.base.base_mesh import base_mesh
from perpetua.actors.base.piece import Piece, Surface
from perpetua.actors.base.rig import BONE_COUNT, base_weights, joint_index
from perpetua.actors.base.surface import catmull_clark, positive, triangles, vertex_normals
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.clothing.fabrics import tileable_noise, to_srgb
from perpetua.actors.clothing.unwrap import unrolled
from perpetua.scene.actor import ActorPart
from perpetua.scene.room import Material

_BODY_VERTICES = 13380
_SHORT_ROWS, _LONG_ROWS = 6, 11
_LONG_M = 0.12
_STUBBLE_INSET_M = 0.009
# Locks this much farther from the skin than they must be hang in the air.
_CLOSE_M = 0.012
# The image of strands is this wide.
_STRAND_TILE_M = 0.05
_LIE = np.array([0.0, 0.0, -0.15])
_FALL = np.array([0.0, 0.0, -1.0])
# Where tied hair is held, on the base mesh.
_TIE_M = np.array([-0.035, 0.0, 0.775])
_CROWN_M = np.array([0.035, 0.0, 0.848])
# Height of the hairline on the base mesh, from the nape forward: over the ear, down the temple, across the forehead.
_LINE_X_M = (-0.02, 0.005, 0.022, 0.036, 0.058, 0.070, 0.082, 0.100, 0.125, 0.150)
_LINE_Z_M = (0.652, 0.668, 0.700, 0.752, 0.762, 0.738, 0.742, 0.785, 0.801, 0.806)


@dataclass(frozen=True)
class HairStyle:
    """``length_m`` and number of locks, ``lift`` off the skull, ``sweep`` forward (+) or back (-), ``cap_m`` volume.

    ``tousle`` is how much neighbours differ in direction; ``curl_m`` waves the locks; ``front_length_m`` is the
    length above the forehead.
    """

    name: str
    locks: int
    length_m: float
    front_length_m: float
    width_m: float
    lift: float
    sweep: float
    part: float
    cap_m: float
    bumps_m: float
    curl_m: float
    line_shift_m: float
    tousle: float


STYLES = {
    "cropped": HairStyle("cropped", 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "buzzed": HairStyle("buzzed", 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.004, 0.0004, 0.0, 0.0, 0.0),
    "short": HairStyle("short", 620, 0.036, 0.046, 0.0085, 0.05, 0.5, 0.0, 0.009, 0.001, 0.001, 0.0, 0.16),
    "side-parted": HairStyle("side-parted", 620, 0.046, 0.075, 0.0090, 0.04, 0.0, 0.9, 0.011, 0.001, 0.001, 0.0, 0.09),
    "swept-back": HairStyle("swept-back", 620, 0.050, 0.080, 0.0090, 0.05, -1.4, 0.0, 0.013, 0.001, 0.001, 0.003, 0.07),
    "bob": HairStyle("bob", 560, 0.200, 0.215, 0.0140, 0.0, 0.0, 1.0, 0.013, 0.001, 0.001, 0.0, 0.04),
    "long": HairStyle("long", 560, 0.340, 0.350, 0.0140, 0.0, -0.3, 1.0, 0.012, 0.001, 0.003, 0.0, 0.04),
    "wavy": HairStyle("wavy", 560, 0.280, 0.290, 0.0150, 0.0, -0.1, 1.0, 0.014, 0.001, 0.007, 0.0, 0.07),
    "curly": HairStyle("curly", 700, 0.040, 0.040, 0.0110, 0.30, 0.2, 0.0, 0.020, 0.005, 0.006, 0.0, 0.8),
    "afro": HairStyle("afro", 800, 0.022, 0.022, 0.011, 0.5, 0.0, 0.0, 0.042, 0.005, 0.004, 0.002, 1.0),
    "tied-up": HairStyle("tied-up", 420, 0.060, 0.070, 0.0090, 0.0, 0.0, 0.0, 0.009, 0.0005, 0.0, 0.0, 0.03),
    "ponytail": HairStyle("ponytail", 420, 0.060, 0.070, 0.0090, 0.0, 0.0, 0.0, 0.009, 0.0005, 0.0, 0.0, 0.03),
}


def scalp_field_m(template_m: Float[np.ndarray, "*shape 3"], shift_m: float) -> Float64[np.ndarray, "*shape"]:
    """Metres above the hairline on the base mesh; ears and everything below the head are far outside."""
    x, side, z = template_m[..., 0], np.abs(template_m[..., 1]), template_m[..., 2]
    line = np.interp(x, _LINE_X_M, _LINE_Z_M) + shift_m
    ear = (side > 0.079) & (x > 0.005) & (x < 0.075) & (z < 0.775)
    return np.asarray(np.where(ear, -0.05, z - line))


@lru_cache(maxsize=1)
def _head_quads() -> Int32[np.ndarray, "F 4"]:
    quads = base_mesh().groups["body"].faces
    template_m = base_mesh().vertices_m
    head = (base_weights()[:, joint_index("head")] > 0.3) | (base_weights()[:, joint_index("neck")] > 0.5)
    inside = (scalp_field_m(template_m, 0.0) > -0.04) & head
    return quads[np.all(inside[quads], axis=1)]


def _scalp(wearer: Wearer, style: HairStyle) -> tuple[Surface, Float64[np.ndarray, " P"]]:
    used, local = np.unique(_head_quads(), return_inverse=True)
    operator, quads = catmull_clark(local.reshape(-1, 4), len(used))
    surface = Surface(
        np.asarray(operator @ base_mesh().vertices_m[used]),
        np.asarray(operator @ wearer.vertices_m[used]),
        np.asarray(operator @ base_weights()[used]),
        triangles(quads),
    )
    # Stubble begins in the shade that is painted on the skin.
    inset_m = _STUBBLE_INSET_M if style.locks == 0 else 0.0
    return positive(surface, scalp_field_m(surface.template_m, style.line_shift_m) - inset_m)


def _bumpy(template_m: Float64[np.ndarray, "P 3"], rng: np.random.Generator) -> Float64[np.ndarray, " P"]:
    total = np.zeros(len(template_m))
    for _ in range(8):
        direction = rng.standard_normal(3)
        direction *= 2.0 * np.pi / rng.uniform(0.015, 0.04) / np.linalg.norm(direction)
        total += np.sin(template_m @ direction + rng.uniform(0.0, 2.0 * np.pi))
    return total / 4.0


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
    template_m = base_mesh().vertices_m[:_BODY_VERTICES]
    faces = triangles(base_mesh().groups["body"].faces)
    normals = vertex_normals(wearer.vertices_m, faces)[:_BODY_VERTICES]
    # Locks lie over ears, not around them.
    upper = (template_m[:, 2] > 0.35) & ~(_near_ear(template_m) & (np.abs(template_m[:, 1]) > 0.079))
    places_m = wearer.vertices_m[:_BODY_VERTICES][upper]
    return _Skull(places_m, normals[upper], template_m[upper], cKDTree(places_m))


def _combed(
    template_m: Float64[np.ndarray, "L 3"],
    normal: Float64[np.ndarray, "L 3"],
    style: HairStyle,
    rng: np.random.Generator,
) -> Float64[np.ndarray, "L 3"]:
    """Directions in which locks leave their roots: away from the crown, swept and parted as the style has it."""
    front = np.clip((template_m[:, 0] - 0.05) / 0.06, 0.0, 1.0)[:, None]
    away = _TIE_M - template_m if style.name in _TIED else template_m - _CROWN_M
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


def _grow(
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
    lie = np.zeros(3) if style.name in _TIED else _LIE
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


def _locks(
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
    u = np.broadcast_to(start + np.array([0.0, style.width_m / _STRAND_TILE_M]), (locks, rows, 2))
    v = np.broadcast_to(np.linspace(1.0, 0.0, rows)[None, :, None] * style.length_m / 0.2 + start, (locks, rows, 2))
    flat = np.stack([u, v], axis=3).reshape(-1, 2)
    return vertices.reshape(-1, 3), faces, flat[faces].astype(np.float32)


def _hanging_weights(template_like_m: Float64[np.ndarray, "P 3"], chin_z_m: float) -> Float64[np.ndarray, "P J"]:
    """The head carries hair; what hangs below the chin follows neck and chest."""
    below = np.clip((chin_z_m - template_like_m[:, 2]) / 0.12, 0.0, 1.0)
    weights = np.zeros((len(template_like_m), BONE_COUNT))
    weights[:, joint_index("head")] = 1.0 - below
    weights[:, joint_index("neck")] = below * (1.0 - 0.7 * below)
    weights[:, joint_index("spine3")] = 0.7 * below * below
    return weights


def hair_image(colour: tuple[float, float, float], rng: np.random.Generator) -> np.ndarray:
    """Strands along v: fine streaks with lighter and darker ones."""
    size = 256
    strands = rng.normal(0.0, 1.0, size)
    broad = np.convolve(np.tile(rng.normal(0.0, 1.0, size), 3), np.ones(9) / 3.0, mode="same")[size : 2 * size]
    drift = 0.12 * tileable_noise(rng, size, 6, 3)
    light = np.clip(0.95 + 0.26 * strands[None, :] + 0.16 * broad[None, :] + drift, 0.35, 1.9)
    return to_srgb(np.array(colour) * light[..., None] + 0.004)


def curl_image(colour: tuple[float, float, float], rng: np.random.Generator) -> np.ndarray:
    """Tight curls: small bright rims with dark gaps."""
    curls = np.abs(tileable_noise(rng, 256, 40, 2))
    light = np.clip(0.35 + 0.9 * curls + 0.1 * tileable_noise(rng, 256, 6, 2), 0.2, 2.0)
    return to_srgb(np.array(colour) * light[..., None] + 0.003)


def _bun(cap: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A ball of hair at the back of the head."""
    back = cap.vertices_m[np.argmin(np.linalg.norm(cap.template_m - _TIE_M, axis=1))]
    centre = back + np.array([-0.028, 0.0, 0.018])
    rows, columns = 11, 18
    polar, turn = np.meshgrid(
        np.linspace(0.02, np.pi - 0.02, rows), np.linspace(0.0, 2.0 * np.pi, columns), indexing="ij"
    )
    twist = 1.0 + 0.06 * np.sin(5.0 * turn + 4.0 * polar)
    ball = np.stack([np.cos(polar) * 0.8, np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn)], axis=2)
    vertices = centre - 0.042 * twist[..., None] * ball
    grid = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]))
    faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)]).astype(np.int32)
    flat = np.stack([turn / np.pi + 0.4 * polar, polar / np.pi], axis=2).reshape(-1, 2)
    return vertices.reshape(-1, 3), faces, flat[faces].astype(np.float32)


def _ponytail(cap: Surface) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A tail of hair that falls from the back of the head."""
    tie = cap.vertices_m[np.argmin(np.linalg.norm(cap.template_m - _TIE_M, axis=1))]
    rows, columns = 12, 14
    fraction = np.linspace(0.0, 1.0, rows)
    back_m = np.interp(fraction, [0.0, 0.12, 0.3, 1.0], [0.004, -0.030, -0.042, -0.022])
    down_m = np.interp(fraction, [0.0, 0.12, 0.3, 1.0], [0.008, 0.004, -0.045, -0.24])
    radius_m = np.interp(fraction, [0.0, 0.10, 0.35, 0.75, 1.0], [0.012, 0.012, 0.026, 0.022, 0.004])
    turn = np.linspace(0.0, 2.0 * np.pi, columns)
    ripple = 1.0 + 0.10 * np.sin(5.0 * turn)[None, :] + 0.05 * np.sin(9.0 * turn + 1.0)[None, :]
    round_m = radius_m[:, None] * ripple
    x = back_m[:, None] + round_m * np.cos(turn) * 0.8
    vertices = tie + np.stack([x, round_m * np.sin(turn), np.broadcast_to(down_m[:, None], x.shape)], axis=2)
    grid = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]))
    faces = np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)]).astype(np.int32)
    flat = np.stack(np.broadcast_arrays(turn[None, :] / np.pi, fraction[:, None]), axis=2).reshape(-1, 2)
    return vertices.reshape(-1, 3), faces, flat[faces].astype(np.float32)


_TIED = {"tied-up": _bun, "ponytail": _ponytail}


def make_hair(wearer: Wearer, style: HairStyle, colour: tuple[float, float, float], rng: np.random.Generator) -> Piece:
    """Hair of one style on this head; cropped hair is painted on the skin alone."""
    if style.cap_m == 0.0:
        return Piece(np.zeros((0, 3)), np.zeros((0, BONE_COUNT)), ())
    scalp, field_m = _scalp(wearer, style)
    normal = vertex_normals(scalp.vertices_m, scalp.faces)
    rise = np.clip(field_m / max(1.6 * style.cap_m, 0.012), 0.0, 1.0)
    rise = np.sqrt(rise * (2.0 - rise))
    height_m = 0.0015 + rise * (style.cap_m + style.bumps_m * _bumpy(scalp.template_m, rng))
    cap_m = scalp.vertices_m + height_m[:, None] * normal
    cap = Surface(scalp.template_m, cap_m, scalp.weights, scalp.faces)
    cap_uv: Float32[np.ndarray, "F 3 2"] = unrolled(
        scalp.template_m, scalp.faces, _CROWN_M, _CROWN_M - np.array([0.0, 0.0, 0.2]), np.array([-1.0, 0.0, 0.0]), 0.16
    ) / np.float32(0.2)
    vertices, faces, uvs = [cap_m], [scalp.faces], [cap_uv]
    if style.locks > 0:
        spine, normals = _grow(cap, vertex_normals(cap_m, cap.faces), wearer, style, rng)
        made = _locks(spine, normals, style, rng)
        vertices.append(made[0])
        faces.append(made[1] + len(cap_m))
        uvs.append(made[2])
    if style.name in _TIED:
        made = _TIED[style.name](cap)
        vertices.append(made[0])
        faces.append(made[1] + len(cap_m))
        uvs.append(made[2])
    all_m = np.concatenate(vertices)
    chin_z_m = float(
        wearer.vertices_m[:_BODY_VERTICES][base_weights()[:_BODY_VERTICES, joint_index("head")] > 0.9, 2].min()
    )
    image = curl_image(colour, rng) if style.name in ("afro", "curly", "buzzed") else hair_image(colour, rng)
    shade = Material("hair", colour, roughness=0.7, image=image)
    part = ActorPart("hair", np.concatenate(faces).astype(np.int32), np.concatenate(uvs).astype(np.float32), shade)
    return Piece(all_m, _hanging_weights(all_m, chin_z_m), (part,))
