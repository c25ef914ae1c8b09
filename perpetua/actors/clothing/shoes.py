"""Shoes: an upper lofted over the foot and a flat sole under it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int32

from perpetua.actors.base.base_mesh import BODY_VERTEX_COUNT, base_mesh
from perpetua.actors.base.images import tileable_noise, to_srgb
from perpetua.actors.base.piece import Piece
from perpetua.actors.base.rig import BONE_COUNT, base_weights, joint_index, rest_joints
from perpetua.actors.base.wearer import Wearer
from perpetua.scene.actor import ActorPart
from perpetua.scene.room import Material

_SECTIONS = 26
_ARCH = 15


@dataclass(frozen=True)
class ShoePattern:
    """``sole_m`` thickness of the sole, ``toe`` how square the toe is (2 round, 4 square), ``shaft_m`` height."""

    kind: str
    sole_m: float
    toe: float
    shaft_m: float
    upper: tuple[float, float, float]
    accent: tuple[float, float, float]
    sole: tuple[float, float, float]


@dataclass(frozen=True)
class Footing:
    """Where a pair of shoes meets the floor, in the body's rest pose.

    ``heel_m`` and ``toe_m`` are points of the left and right sole; ``floor_z_m`` the height of the soles.
    """

    heel_m: Float64[np.ndarray, "2 3"]
    toe_m: Float64[np.ndarray, "2 3"]
    floor_z_m: float


@dataclass(frozen=True)
class _Last:
    """A foot measured along its length: sections from heel to toe, widths to both sides and height above it."""

    origin_m: Float64[np.ndarray, "3"]
    forward: Float64[np.ndarray, "3"]
    left: Float64[np.ndarray, "3"]
    along_m: Float64[np.ndarray, " S"]
    to_left_m: Float64[np.ndarray, " S"]
    to_right_m: Float64[np.ndarray, " S"]
    top_m: Float64[np.ndarray, " S"]
    ball_m: float


def _smoothed(values: Float64[np.ndarray, " S"], passes: int) -> Float64[np.ndarray, " S"]:
    for _ in range(passes):
        padded = np.pad(values, 1, mode="edge")
        values = 0.25 * padded[:-2] + 0.5 * values + 0.25 * padded[2:]
    return values


def _measure(wearer: Wearer, side: str, pattern: ShoePattern) -> _Last:
    joints = rest_joints(wearer.vertices_m)
    ankle, ball = joints[joint_index(f"{side}_ankle")], joints[joint_index(f"{side}_foot")]
    columns = [joint_index(f"{side}_ankle"), joint_index(f"{side}_foot")]
    foot = base_weights()[:BODY_VERTEX_COUNT, columns].sum(axis=1) > 0.5
    points = wearer.vertices_m[:BODY_VERTEX_COUNT][foot]
    forward = (ball - ankle) * np.array([1.0, 1.0, 0.0])
    forward /= np.linalg.norm(forward)
    left = np.array([-forward[1], forward[0], 0.0])
    origin = np.array([ankle[0], ankle[1], points[:, 2].min()])
    local = (points - origin) @ np.stack([forward, left, [0.0, 0.0, 1.0]], axis=1)
    low = local[local[:, 2] < 0.055]
    start, end = low[:, 0].min() - 0.006, low[:, 0].max() + 0.012
    # Closer together at both ends, where the outline turns.
    fraction = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _SECTIONS))
    along = start + fraction * (end - start)
    reach = np.maximum(0.018, 0.06 * (end - start))
    lefts, rights, tops = np.empty(_SECTIONS), np.empty(_SECTIONS), np.empty(_SECTIONS)
    for index, place in enumerate(np.clip(along, low[:, 0].min() + reach, low[:, 0].max() - reach)):
        near = low[np.abs(low[:, 0] - place) < reach]
        lefts[index], rights[index] = near[:, 1].max() + 0.006, -near[:, 1].min() + 0.006
        above = local[np.abs(local[:, 0] - place) < 0.5 * reach]
        tops[index] = min(above[:, 2].max() + 0.008, pattern.shaft_m)
    ball_m = float((ball - origin) @ forward)
    return _Last(origin, forward, left, along, _smoothed(lefts, 2), _smoothed(rights, 2), _smoothed(tops, 2), ball_m)


def _outline(last: _Last, pattern: ShoePattern) -> Float64[np.ndarray, " S"]:
    """Shares of the full width at each section: round at the heel, ``toe`` at the front."""
    fraction = (last.along_m - last.along_m[0]) / (last.along_m[-1] - last.along_m[0])
    heel = np.clip(fraction / 0.16, 0.0, 1.0)
    front = np.clip((1.0 - fraction) / 0.26, 0.0, 1.0)
    rounded = (1.0 - (1.0 - heel) ** 2.2) ** (1.0 / 2.2)
    return np.asarray(rounded * (1.0 - (1.0 - front) ** pattern.toe) ** (1.0 / pattern.toe))


def _place(last: _Last, along: np.ndarray, across: np.ndarray, up: np.ndarray) -> Float64[np.ndarray, "N 3"]:
    offset = along[:, None] * last.forward + across[:, None] * last.left + up[:, None] * np.array([0.0, 0.0, 1.0])
    return np.asarray(last.origin_m + offset)


def _grid_faces(rows: int, columns: int) -> Int32[np.ndarray, "F 3"]:
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns - 1), indexing="ij")
    a = (row * columns + column).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]).astype(np.int32)


def _upper(last: _Last, pattern: ShoePattern) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces and UVs of the upper: one arch from side to side at each section."""
    outline = _outline(last, pattern)
    fraction = (last.along_m - last.along_m[0]) / (last.along_m[-1] - last.along_m[0])
    toe_box = np.interp(fraction, [0.0, 0.75, 0.9, 1.0], [1.0, 1.0, 0.90, 0.45])
    heel_box = np.interp(fraction, [0.0, 0.06, 0.14], [0.90, 0.98, 1.0])
    top = np.maximum(last.top_m, 0.040) * toe_box * heel_box
    angle = np.linspace(0.0, np.pi, _ARCH)
    squareness = 2.0 / np.interp(fraction, [0.0, 0.3, 1.0], [3.0, 2.6, 2.2])
    wide = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** squareness[:, None]
    high = np.sin(angle) ** squareness[:, None]
    width = np.where(wide > 0, last.to_right_m[:, None], last.to_left_m[:, None])
    across = -wide * width * np.maximum(outline, 0.04)[:, None]
    up = high * top[:, None] - 0.004
    along = np.repeat(last.along_m, _ARCH)
    vertices = _place(last, along, across.ravel(), up.ravel())
    # The loft's two ends are closed by fans.
    fan = np.stack([np.zeros(_ARCH - 2, int), np.arange(1, _ARCH - 1), np.arange(2, _ARCH)], axis=1)
    front = fan + (_SECTIONS - 1) * _ARCH
    faces = np.concatenate([_grid_faces(_SECTIONS, _ARCH), fan[:, ::-1], front]).astype(np.int32)
    flat = np.stack([np.repeat(fraction, _ARCH), np.tile(angle / np.pi, _SECTIONS)], axis=1)
    return vertices, faces, flat[faces].astype(np.float32)


def _sole(last: _Last, pattern: ShoePattern) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces and UVs of the sole: bottom, wall, and a rim that meets the upper."""
    outline = np.maximum(_outline(last, pattern), 0.04)
    rows = []
    for inset_m, up_m in ((0.004, 0.0), (0.0, 0.004), (-0.003, 0.6 * pattern.sole_m), (0.0, pattern.sole_m + 0.002)):
        rims = []
        for width, sign in ((last.to_left_m, 1.0), (last.to_right_m, -1.0)):
            across = sign * np.maximum(width * outline + 0.004 - inset_m, 0.002)
            rims.append(_place(last, last.along_m, across, np.full(_SECTIONS, up_m - pattern.sole_m)))
        # Once around: the left side from heel to toe, the right side back.
        rows.append(np.concatenate([rims[0], rims[1][::-1], rims[0][:1]]))
    columns = 2 * _SECTIONS + 1
    wall = _grid_faces(len(rows), columns)[:, ::-1]
    index = np.arange(_SECTIONS - 1)
    a, b = index, index + 1
    c, d = 2 * _SECTIONS - 2 - index, 2 * _SECTIONS - 1 - index
    bottom = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    vertices = np.concatenate(rows)
    faces = np.concatenate([wall, bottom]).astype(np.int32)
    along_edge = np.tile(np.linspace(0.0, 4.0, columns), len(rows))
    flat = np.stack([along_edge, np.repeat(np.linspace(0.0, 0.3, len(rows)), columns)], axis=1)
    return vertices, faces, flat[faces].astype(np.float32)


def _weights(last: _Last, vertices_m: Float64[np.ndarray, "P 3"], side: str) -> Float64[np.ndarray, "P J"]:
    """Rigid with ankle and foot joints, but for a short bend at the ball of the foot."""
    along = (vertices_m - last.origin_m) @ last.forward - last.ball_m
    toe = np.clip(along / 0.036 + 0.5, 0.0, 1.0)
    toe = toe * toe * (3.0 - 2.0 * toe)
    weights = np.zeros((len(vertices_m), BONE_COUNT))
    weights[:, joint_index(f"{side}_foot")] = toe
    weights[:, joint_index(f"{side}_ankle")] = 1.0 - toe
    return weights


def _upper_image(pattern: ShoePattern, rng: np.random.Generator) -> np.ndarray:
    """Leather or canvas with a toe cap, a heel patch, seams and laces; u runs from heel to toe."""
    size = 256
    axis = (np.arange(size) + 0.5) / size
    u, v = np.meshgrid(axis, axis)
    grain = 1.0 + 0.05 * tileable_noise(rng, size, 30, 3) + 0.05 * tileable_noise(rng, size, 4, 2)
    colour = np.broadcast_to(np.array(pattern.upper), (size, size, 3)) * grain[..., None]
    accent = np.array(pattern.accent) * grain[..., None]
    patches = (u < 0.13) | (u > 0.84)
    if pattern.kind == "runner":
        patches |= (np.abs(v - 0.5) > 0.22) & (np.abs((u + np.abs(v - 0.5) * 0.5) % 0.14 - 0.07) < 0.02) & (u < 0.75)
    colour = np.where(patches[..., None], accent, colour)
    seam = np.minimum(np.abs(u - 0.13), np.abs(u - 0.84)) < 0.006
    tongue = (np.abs(v - 0.5) < 0.085) & (u > 0.36) & (u < 0.72)
    seam |= (np.abs(np.abs(v - 0.5) - 0.085) < 0.006) & (u > 0.36) & (u < 0.72)
    colour = np.where(tongue[..., None], 0.75 * colour, colour)
    laces = tongue & (np.abs((u * 15.0) % 1.0 - 0.5) < 0.2)
    lace = np.full(3, 0.75) if pattern.kind != "leather" else np.array(pattern.upper) * 0.5
    colour = np.where(laces[..., None], lace, colour)
    return to_srgb(np.where(seam[..., None], 0.55 * colour, colour))


def _sole_image(pattern: ShoePattern, rng: np.random.Generator) -> np.ndarray:
    ribs = 1.0 - 0.12 * (np.arange(128) % 16 < 3)[None, :] + 0.04 * tileable_noise(rng, 128, 12, 3)
    return to_srgb(np.array(pattern.sole) * ribs[..., None])


def make_shoes(wearer: Wearer, pattern: ShoePattern, rng: np.random.Generator) -> tuple[Piece, Footing]:
    """A pair of shoes on this body's feet, and where they stand."""
    upper_image, sole_image = _upper_image(pattern, rng), _sole_image(pattern, rng)
    leather = Material(
        "shoe upper", pattern.upper, roughness=0.45 if pattern.kind == "leather" else 0.7, image=upper_image
    )
    rubber = Material("shoe sole", pattern.sole, roughness=0.8, image=sole_image)
    vertices: list[np.ndarray] = []
    weights: list[np.ndarray] = []
    parts: list[ActorPart] = []
    heels: list[np.ndarray] = []
    toes: list[np.ndarray] = []
    offset, floor_z_m = 0, 0.0
    for side in ("left", "right"):
        last = _measure(wearer, side, pattern)
        for name, shade, made in (
            (f"{side} shoe", leather, _upper(last, pattern)),
            (f"{side} sole", rubber, _sole(last, pattern)),
        ):
            places, faces, uv = made
            vertices.append(places)
            weights.append(_weights(last, places, side))
            parts.append(ActorPart(name, (faces + offset).astype(np.int32), uv, shade))
            offset += len(places)
        length = last.along_m[-1] - last.along_m[0]
        under = np.array([-pattern.sole_m])
        middle = 0.5 * (last.to_left_m - last.to_right_m)
        for points, fraction in ((heels, 0.03), (toes, 0.88)):
            along = np.array([last.along_m[0] + fraction * length])
            points.append(_place(last, along, np.interp(along, last.along_m, middle), under)[0])
        floor_z_m += 0.5 * float(last.origin_m[2] - pattern.sole_m)
    piece = Piece(np.concatenate(vertices), np.concatenate(weights), tuple(parts))
    return piece, Footing(np.stack(heels), np.stack(toes), floor_z_m)


def shoe_field_m(pattern: ShoePattern, template_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """Metres below the edge of the shoes on the base mesh."""
    floor_z_m = float(base_mesh().vertices_m[:BODY_VERTEX_COUNT, 2].min())
    return np.asarray(floor_z_m + pattern.shaft_m - template_m[:, 2])
