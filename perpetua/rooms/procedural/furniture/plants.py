"""Plants in pots, in each piece's own frame."""

import numpy as np
from jaxtyping import Float64

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.finish.palette import Palette
from perpetua.rooms.procedural.furniture.parts import Part, Point, curve, lathe, loft, post, tube
from perpetua.rooms.procedural.layout.plan import Piece

Vector = Float64[np.ndarray, "3"]


def build_plant(piece: Piece, palette: Palette) -> list[Part]:
    """A pot with a plant: broad leaves on stalks, upright swords, or a small tree."""
    width, depth, height = piece.size_m
    reach, centre = 0.5 * min(width, depth), (0.0, 0.5 * depth)
    pot_z, pot_radius = min(0.36, 0.36 * height), min(0.62 * reach, 0.19)
    parts = _pot(piece, palette, centre, pot_radius, pot_z)
    soil = np.array([*centre, pot_z - 0.015])
    rng = np.random.default_rng(int(1e9 * piece.detail[0]))
    manner = piece.detail[2]
    leaf = palette.leaf if piece.detail[3] < 0.6 else palette.second_leaf
    if manner < 0.4:
        leaves = [mesh for turn in range(16) for mesh in _stalk(rng, soil, height - float(soil[2]), reach, 2.4 * turn)]
        return [*parts, Part("leaves", join(leaves), leaf)]
    if manner < 0.65:
        swords = [_sword(rng, soil, height - float(soil[2]), reach, pot_radius, 2.4 * turn) for turn in range(15)]
        return [*parts, Part("leaves", join(swords), leaf)]
    trunk, crown = _tree(rng, soil, height - float(soil[2]), reach)
    return [*parts, Part("trunk", trunk, palette.bark), Part("leaves", crown, leaf)]


def _pot(piece: Piece, palette: Palette, centre: tuple[float, float], radius: float, height: float) -> list[Part]:
    if piece.detail[4] < 0.5:
        outside = [(0.70 * radius, 0.0), (0.94 * radius, 0.82 * height), (radius, 0.83 * height), (radius, height)]
    else:
        outside = curve(
            [(0.62 * radius, 0.0), (0.95 * radius, 0.35 * height), (radius, 0.7 * height), (0.88 * radius, height)], 10
        )
    rim = 0.9 * outside[-1][0]
    body = lathe([(0.0, 0.0), *outside, (rim, height), (0.97 * rim, height - 0.035), (0.0, height - 0.035)], centre, 26)
    soil = post(centre, 0.98 * rim, height - 0.04, height - 0.012, 20)
    if piece.detail[5] < 0.25:
        material = palette.wicker
    else:
        material = palette.ceramic if piece.detail[5] < 0.5 else palette.accents[int(5 * piece.detail[6])]
    return [Part("", body, material), Part("soil", soil, palette.soil)]


def _blade(path: Float64[np.ndarray, "N 3"], half_m: Float64[np.ndarray, " N"], fold: float = 0.25) -> TriMesh:
    """A leaf along its midrib: thin, widest as told, its halves folded up by ``fold`` of their width."""
    forward = np.gradient(path, axis=0)
    side = np.cross(forward, np.array([0.0, 0.0, 1.0]))
    length = np.linalg.norm(side, axis=1, keepdims=True)
    side = np.where(length > 1e-6, side / np.maximum(length, 1e-9), np.array([1.0, 0.0, 0.0]))
    up = np.cross(side, forward)
    up /= np.linalg.norm(up, axis=1, keepdims=True)
    half = np.maximum(half_m, 0.0012)[:, None]
    thick = 0.0018
    left, right = path - half * side + fold * half * up, path + half * side + fold * half * up
    # Seen against the path, counter-clockwise: rib below, left, rib above, right.
    return loft(np.stack([path - thick * up, left, path + thick * up, right], axis=1))


def _bow(start: Vector, rise: float, out: Vector, droop: float, count: int) -> Float64[np.ndarray, "N 3"]:
    """A path that leaves upwards, bends outwards and droops at its end."""
    t = np.linspace(0.0, 1.0, count)[:, None]
    height = rise * (1.0 - (1.0 - t) ** 2) - droop * t**3
    return start + out * t**1.5 + height * np.array([0.0, 0.0, 1.0])


def _stalk(rng: np.random.Generator, soil: Vector, height: float, reach: float, turn: float) -> list[TriMesh]:
    """A stalk with one broad leaf."""
    outward = np.array([np.cos(turn), np.sin(turn), 0.0])
    far, tall = reach * rng.uniform(0.25, 0.5), height * rng.uniform(0.35, 0.86)
    path = _bow(soil + 0.02 * outward, tall, far * outward, 0.0, 6)
    length = min(reach - far - 0.01, rng.uniform(0.16, 0.28) * max(0.6, height))
    length = max(length, 0.05)
    tip = outward * length
    t = np.linspace(0.0, 1.0, 9)
    leaf = path[-1] + t[:, None] * tip + np.column_stack([0 * t, 0 * t, 0.30 * length * t - 0.55 * length * t**2])
    half = 0.36 * length * np.sin(np.pi * t**0.75) ** 0.8
    stem: list[Point] = [(float(x), float(y), float(z)) for x, y, z in path]
    return [tube(stem, 0.005, 5), _blade(leaf, half)]


def _sword(
    rng: np.random.Generator, soil: Vector, height: float, reach: float, pot_radius: float, turn: float
) -> TriMesh:
    """A stiff upright leaf."""
    outward = np.array([np.cos(turn), np.sin(turn), 0.0])
    start = soil + 0.55 * pot_radius * rng.uniform(0.1, 0.9) * outward
    lean = min(0.75 * reach, 0.3 * height) * rng.uniform(0.2, 1.0)
    path = _bow(start, height * rng.uniform(0.55, 0.98), lean * outward, 0.0, 8)
    t = np.linspace(0.0, 1.0, 8)
    return _blade(path, 0.032 * (0.6 + 0.6 * t) * np.sqrt(1.0 - t**3) + 0.001, 0.35)


def _tree(rng: np.random.Generator, soil: Vector, height: float, reach: float) -> tuple[TriMesh, TriMesh]:
    """A bent trunk with twigs, and small leaves about them."""
    trunk_z = 0.55 * height
    bend = rng.uniform(-0.06, 0.06, 2) * reach / 0.35
    points = [soil + np.array([*(bend * np.sin(2.2 * t)), trunk_z * t]) for t in np.linspace(0.0, 1.0, 6)]
    wood = [tube([(float(x), float(y), float(z)) for x, y, z in points], [0.02, 0.018, 0.016, 0.015, 0.014, 0.012], 8)]
    leaves = []
    for twig in range(9):
        turn, t = 2.4 * twig, rng.uniform(0.55, 1.0)
        outward = np.array([np.cos(turn), np.sin(turn), 0.0])
        start = points[3] + (points[5] - points[3]) * (t - 0.55) / 0.45
        rise = (height - float(start[2] - soil[2])) * rng.uniform(0.45, 0.85)
        path = _bow(start, rise, 0.62 * reach * rng.uniform(0.4, 1.0) * outward, 0.0, 5)
        wood.append(tube([(float(x), float(y), float(z)) for x, y, z in path], [0.008, 0.007, 0.006, 0.004, 0.003], 5))
        for index in range(13):
            along = (0.25 + 0.75 * (index + 1) / 13) * 4.0
            low = min(3, int(along))
            root = path[low] + (along - low) * (path[low + 1] - path[low])
            leaves.append(_small_leaf(rng, root, min(0.09, 0.28 * reach), turn + 2.4 * index))
    return join(wood), join(leaves)


def _small_leaf(rng: np.random.Generator, root: Vector, length: float, turn: float) -> TriMesh:
    outward = np.array([np.cos(turn), np.sin(turn), rng.uniform(-0.35, 0.5)])
    t = np.linspace(0.0, 1.0, 4)
    path = root + t[:, None] * length * outward - np.column_stack([0 * t, 0 * t, 0.25 * length * t**2])
    return _blade(path, 0.3 * length * np.array([0.12, 0.9, 0.8, 0.0]), 0.3)
