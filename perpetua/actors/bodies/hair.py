"""Hair: a cap over the scalp under locks that follow the skull and fall."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int32
from scipy.spatial import cKDTree

from perpetua.actors.bodies.makehuman import base_mesh
from perpetua.actors.bodies.rig import BONE_COUNT, base_weights, joint_index
from perpetua.actors.clothing.fabrics import tileable_noise, to_srgb
from perpetua.actors.clothing.piece import Piece, Surface
from perpetua.actors.clothing.surface import catmull_clark, positive, triangles, vertex_normals
from perpetua.actors.clothing.unwrap import around
from perpetua.actors.clothing.wearer import Wearer
from perpetua.actors.types import ActorPart
from perpetua.rooms.types import Material

_BODY_VERTICES = 13380
_SHORT_ROWS, _LONG_ROWS = 6, 11
_LONG_M = 0.12
_LIE = np.array([0.0, 0.0, -0.15])
_FALL = np.array([0.0, 0.0, -1.0])
_CROWN_M = np.array([0.035, 0.0, 0.848])
# Height of the hairline on the base mesh, from the nape forward: over the ear, down the temple, across the forehead.
_LINE_X_M = (-0.02, 0.005, 0.022, 0.036, 0.058, 0.070, 0.082, 0.100, 0.125, 0.150)
_LINE_Z_M = (0.652, 0.668, 0.700, 0.752, 0.762, 0.738, 0.742, 0.785, 0.801, 0.806)


@dataclass(frozen=True)
class HairStyle:
    """``length_m`` and number of locks, ``lift`` off the skull, ``sweep`` forward (+) or back (-), ``cap_m`` volume.

    ``curl_m`` waves the locks; ``front_length_m`` is the length above the forehead.
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


STYLES = {
    "cropped": HairStyle("cropped", 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    "short": HairStyle("short", 230, 0.040, 0.045, 0.019, 0.10, 0.5, 0.0, 0.010, 0.002, 0.002, 0.0),
    "side-parted": HairStyle("side-parted", 230, 0.050, 0.080, 0.020, 0.08, 0.0, 0.9, 0.012, 0.002, 0.002, 0.0),
    "swept-back": HairStyle("swept-back", 230, 0.055, 0.085, 0.019, 0.10, -1.4, 0.0, 0.014, 0.002, 0.003, 0.003),
    "chin-length": HairStyle("chin-length", 190, 0.200, 0.215, 0.028, 0.0, 0.0, 1.0, 0.014, 0.002, 0.002, 0.0),
    "long": HairStyle("long", 190, 0.330, 0.345, 0.030, 0.0, -0.3, 1.0, 0.013, 0.002, 0.006, 0.0),
    "curly": HairStyle("curly", 300, 0.055, 0.055, 0.022, 0.30, 0.2, 0.0, 0.020, 0.006, 0.010, 0.0),
    "afro": HairStyle("afro", 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.045, 0.005, 0.0, 0.002),
    "tied-up": HairStyle("tied-up", 0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.012, 0.001, 0.0, 0.0),
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
    return positive(surface, scalp_field_m(surface.template_m, style.line_shift_m))


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
    upper = template_m[:, 2] > 0.35
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
    away = template_m - _CROWN_M
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-6)
    away[:, 0] += 0.6 * style.sweep
    parted = np.sign(template_m[:, 1] - 0.025)[:, None]
    sideways = np.concatenate([np.full_like(parted, -0.45), 1.2 * parted, np.full_like(parted, -0.3)], axis=1)
    aside = style.part * front
    direction = (1.0 - aside) * away + aside * sideways
    direction -= np.sum(direction * normal, axis=1, keepdims=True) * normal
    direction /= np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-6)
    return np.asarray(direction + 0.12 * rng.standard_normal(direction.shape))


def _settle(
    place: Float64[np.ndarray, "L 3"], skull: _Skull, clearance_m: Float64[np.ndarray, " L"], style: HairStyle
) -> tuple[Float64[np.ndarray, "L 3"], Float64[np.ndarray, "L 3"], Bool[np.ndarray, " L"]]:
    """Lays points on the skull at their clearance, keeps them off the face, and lets them hang clear elsewhere.

    Returns:
        The points, the directions of the skin nearest to them, and which of them lie on the scalp.
    """
    _, near = skull.tree.query(place)
    template_m = skull.template_m[near]
    curtain = style.length_m > _LONG_M
    face = curtain & (template_m[:, 0] > 0.07) & (template_m[:, 2] < 0.775) & (template_m[:, 2] > 0.58)
    aside = np.where(face, np.maximum(0.070 - np.abs(template_m[:, 1]), 0.0), 0.0)
    place = place + (np.sign(place[:, 1]) * aside)[:, None] * np.array([0.0, 1.0, 0.0])
    _, near = skull.tree.query(place)
    gap = np.sum((place - skull.places_m[near]) * skull.normals[near], axis=1)
    on_scalp = scalp_field_m(skull.template_m[near], style.line_shift_m) > -0.012
    lift = np.where(on_scalp, clearance_m - gap, np.maximum(clearance_m - gap, 0.0))
    return place + lift[:, None] * skull.normals[near], skull.normals[near], on_scalp


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
    rows = _LONG_ROWS if style.length_m > _LONG_M else _SHORT_ROWS
    for row in range(1, rows):
        # On the scalp locks keep their direction; beyond it they fall.
        heading = np.where(held[:, None], heading + _LIE, 0.35 * heading + _FALL)
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
    """Ribbons, raised along their middle, that taper to a tip."""
    locks, rows, _ = spine.shape
    along = np.gradient(spine, axis=1)
    along /= np.maximum(np.linalg.norm(along, axis=2, keepdims=True), 1e-9)
    across = np.cross(along, normal)
    across /= np.maximum(np.linalg.norm(across, axis=2, keepdims=True), 1e-9)
    above = np.cross(across, along)
    taper = np.interp(np.linspace(0.0, 1.0, rows), [0.0, 0.25, 0.7, 1.0], [0.8, 1.0, 0.95, 0.30])
    half = 0.5 * style.width_m * taper[None, :, None] * rng.uniform(0.8, 1.25, locks)[:, None, None]
    middle = spine + 0.35 * half * above
    vertices = np.stack([spine - half * across, middle, spine + half * across], axis=2)
    grid = np.arange(locks * rows * 3).reshape(locks, rows, 3)
    a, b = grid[:, :-1, :-1].ravel(), grid[:, :-1, 1:].ravel()
    c, d = grid[:, 1:, 1:].ravel(), grid[:, 1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]).astype(np.int32)
    start = rng.uniform(0.0, 1.0, locks)[:, None, None]
    u = np.broadcast_to(start + np.array([0.0, 0.06, 0.12]), (locks, rows, 3))
    v = np.broadcast_to(np.linspace(1.0, 0.0, rows)[None, :, None] * style.length_m / 0.2 + start, (locks, rows, 3))
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
    light = np.clip(0.95 + 0.16 * strands[None, :] + 0.16 * broad[None, :] + drift, 0.45, 1.7)
    return to_srgb(np.array(colour) * light[..., None] + 0.004)


def curl_image(colour: tuple[float, float, float], rng: np.random.Generator) -> np.ndarray:
    """Tight curls: small bright rims with dark gaps."""
    curls = np.abs(tileable_noise(rng, 256, 40, 2))
    light = np.clip(0.35 + 0.9 * curls + 0.1 * tileable_noise(rng, 256, 6, 2), 0.2, 2.0)
    return to_srgb(np.array(colour) * light[..., None] + 0.003)


def _bun(cap: Surface, style: HairStyle) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A ball of hair at the back of the head."""
    back = cap.vertices_m[np.argmin(np.linalg.norm(cap.template_m - np.array([-0.035, 0.0, 0.775]), axis=1))]
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


def make_hair(wearer: Wearer, style: HairStyle, colour: tuple[float, float, float], rng: np.random.Generator) -> Piece:
    """Hair of one style on this head; cropped hair is painted on the skin alone."""
    if style.cap_m == 0.0:
        return Piece(np.zeros((0, 3)), np.zeros((0, BONE_COUNT)), ())
    scalp, field_m = _scalp(wearer, style)
    normal = vertex_normals(scalp.vertices_m, scalp.faces)
    rise = np.clip(field_m / max(0.9 * style.cap_m, 0.012), 0.0, 1.0)
    rise = np.sqrt(rise * (2.0 - rise))
    height_m = 0.0015 + rise * (style.cap_m + style.bumps_m * _bumpy(scalp.template_m, rng))
    cap_m = scalp.vertices_m + height_m[:, None] * normal
    cap = Surface(scalp.template_m, cap_m, scalp.weights, scalp.faces)
    cap_uv: Float32[np.ndarray, "F 3 2"] = around(
        scalp.template_m, scalp.faces, _CROWN_M, _CROWN_M - np.array([0.0, 0.0, 0.2]), np.array([-1.0, 0.0, 0.0]), 0.16
    )
    vertices, faces, uvs = [cap_m], [scalp.faces], [cap_uv]
    if style.locks > 0:
        spine, normals = _grow(cap, vertex_normals(cap_m, cap.faces), wearer, style, rng)
        made = _locks(spine, normals, style, rng)
        vertices.append(made[0])
        faces.append(made[1] + len(cap_m))
        uvs.append(made[2])
    if style.name == "tied-up":
        made = _bun(cap, style)
        vertices.append(made[0])
        faces.append(made[1] + len(cap_m))
        uvs.append(made[2])
    all_m = np.concatenate(vertices)
    chin_z_m = float(
        wearer.vertices_m[:_BODY_VERTICES][base_weights()[:_BODY_VERTICES, joint_index("head")] > 0.9, 2].min()
    )
    image = curl_image(colour, rng) if style.name == "afro" else hair_image(colour, rng)
    shade = Material("hair", colour, roughness=0.6, image=image)
    part = ActorPart("hair", np.concatenate(faces).astype(np.int32), np.concatenate(uvs).astype(np.float32), shade)
    return Piece(all_m, _hanging_weights(all_m, chin_z_m), (part,))
