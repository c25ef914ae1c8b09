"""Cushions, pillows, blankets and curtains: closed meshes of soft objects. All sizes in metres."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float64

from perpetua.geometry.mesh import TriMesh
from perpetua.rooms.procedural.furniture.parts import Point


def cushion(low_m: Point, high_m: Point, exponent: float = 5.0, counts: tuple[int, int, int] = (7, 7, 5)) -> TriMesh:
    """A superellipsoid that fills a box: 2 is an ellipsoid, larger exponents come nearer to the box."""
    low, high = np.array(low_m), np.array(high_m)
    unit = _soft_cube(exponent, counts)
    return TriMesh(0.5 * (low + high) + 0.5 * (high - low) * unit.vertices_m, unit.faces)


@lru_cache(maxsize=64)
def _soft_cube(exponent: float, counts: tuple[int, int, int]) -> TriMesh:
    cube = _grid_cube(counts)
    # Points nearer to the edges of the cube's faces, where the curvature will be.
    spread = np.sin(0.5 * np.pi * cube.vertices_m) * 0.5 + 0.5 * cube.vertices_m
    norm = (np.abs(spread) ** exponent).sum(1, keepdims=True) ** (1.0 / exponent)
    return TriMesh(spread / norm, cube.faces)


@lru_cache(maxsize=64)
def _grid_cube(counts: tuple[int, int, int]) -> TriMesh:
    """The surface of [-1, 1]^3, divided along each axis."""
    vertices, faces, offset = [], [], 0
    for axis in range(3):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        n, m = counts[first], counts[second]
        u, v = np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, m + 1), indexing="ij")
        for side in (-1.0, 1.0):
            points = np.empty((u.size, 3))
            points[:, axis], points[:, first], points[:, second] = side, u.ravel(), v.ravel()
            quads = _grid_faces(n, m)
            faces.append(offset + (quads if side > 0 else quads[:, ::-1]))
            vertices.append(points)
            offset += u.size
    return _welded(np.concatenate(vertices), np.concatenate(faces))


def _grid_faces(n: int, m: int) -> np.ndarray:
    """Two triangles for each cell of a grid of (n + 1) x (m + 1) points, counter-clockwise in (first, second).

    The diagonals run towards the middle, so that no triangle cuts off a corner of the grid.
    """
    i, j = (index.ravel() for index in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    a, b, c, d = i * (m + 1) + j, (i + 1) * (m + 1) + j, (i + 1) * (m + 1) + j + 1, i * (m + 1) + j + 1
    rising = ((2 * i < n) == (2 * j < m))[:, None]
    first = np.where(rising, np.stack([a, b, c], 1), np.stack([a, b, d], 1))
    second = np.where(rising, np.stack([a, c, d], 1), np.stack([b, c, d], 1))
    return np.concatenate([first, second])


def _welded(vertices_m: Float64[np.ndarray, "P 3"], faces: np.ndarray) -> TriMesh:
    """Points that lie on each other become one; triangles that collapse go."""
    # Adding 0 makes -0 and 0 the same.
    _, first, index = np.unique(vertices_m.round(7) + 0.0, axis=0, return_index=True, return_inverse=True)
    joined = index.ravel()[faces]
    whole = (joined != np.roll(joined, 1, axis=1)).all(axis=1)
    return TriMesh(vertices_m[first], joined[whole].astype(np.int32))


@lru_cache(maxsize=256)
def pillow(width_m: float, height_m: float, thick_m: float, cells: int = 9) -> TriMesh:
    """A stuffed pillow with pointed corners that stands upright in the plane y = 0, its middle at the origin."""
    steps = np.sin(0.5 * np.pi * np.linspace(-1, 1, cells + 1))
    u, v = np.meshgrid(steps, steps, indexing="ij")
    x = 0.5 * width_m * u * (1.0 - 0.10 * (1.0 - v**2) * u**2)
    z = 0.5 * height_m * v * (1.0 - 0.10 * (1.0 - u**2) * v**2)
    y = 0.5 * thick_m * np.maximum((1.0 - u**2) * (1.0 - v**2), 0.0) ** 0.42
    points = [np.stack([x, side * y, z], axis=-1).reshape(-1, 3) for side in (-1.0, 1.0)]
    faces = _grid_faces(cells, cells)
    return _welded(np.concatenate(points), np.concatenate([faces, (cells + 1) ** 2 + faces[:, ::-1]]))


def blanket(low_m: Point, high_m: Point, phase: tuple[float, ...]) -> TriMesh:
    """A thick blanket in a box: soft edges, wrinkles on top, folds down its sides; ``phase`` in [0, 1) varies them."""
    low, high = np.array(low_m), np.array(high_m)
    unit = _soft_cube(9.0, (22, 26, 4))
    half = 0.5 * (high - low)
    local = unit.vertices_m.copy()
    x, y = local[:, 0] * half[0], local[:, 1] * half[1]
    wave = np.zeros(len(local))
    for index, (k_x, k_y) in enumerate(((7.0, 3.0), (-5.0, 9.0), (13.0, -4.0), (3.0, 16.0))):
        wave += np.sin(k_x * x + k_y * y + 2 * np.pi * phase[index]) / (1.0 + index)
    top = np.clip(local[:, 2], 0.0, 1.0)
    fold = 0.5 + 0.5 * np.sin(24.0 * y + 18.0 * np.abs(x) + 2 * np.pi * phase[4])
    # Everything moves inwards, so that the blanket stays in its box.
    inward = np.array([0.016, 0.012, 0.0]) * fold[:, None] * np.clip(-local[:, 2:] + 0.6, 0.0, 1.0)
    moved = half * local - np.sign(local) * inward
    moved[:, 2] -= 0.011 * (wave - wave.min()) / (np.ptp(wave)) * top * 2.0
    return TriMesh(0.5 * (low + high) + moved, unit.faces)


def curtain(width_m: float, depth_m: float, high_z_m: float, count: int, phase: float) -> TriMesh:
    """A hanging cloth with ``count`` folds, centred on x = 0 between y = 0 and ``depth_m``, from z = 0 up."""
    columns, rows, thick_m = 8 * count, 7, 0.006
    u, z = np.meshgrid(np.linspace(0.0, 1.0, columns + 1), np.linspace(0.0, high_z_m, rows + 1), indexing="ij")
    down = 1.0 - z / high_z_m
    sway = 2 * np.pi * (count * u + phase) + 0.7 * down * np.sin(5.0 * u + 6.28 * phase)
    swing = np.sin(sway) * (0.62 + 0.38 * down) * (0.85 + 0.15 * np.sin(9.0 * u + 2.0 * down))
    x = (u - 0.5) * width_m * (0.93 + 0.07 * down)
    y = 0.5 * depth_m + 0.5 * (depth_m - thick_m) * swing
    sheets = [np.stack([x, y + side * 0.5 * thick_m, z], axis=-1).reshape(-1, 3) for side in (-1.0, 1.0)]
    faces, offset = _grid_faces(columns, rows), u.size
    edge = _border(columns, rows)
    there = np.roll(edge, -1)
    rim = np.concatenate(
        [np.stack([edge, offset + there, there], 1), np.stack([edge, offset + edge, offset + there], 1)]
    )
    return TriMesh(np.concatenate(sheets), np.concatenate([faces, offset + faces[:, ::-1], rim]).astype(np.int32))


def _border(n: int, m: int) -> np.ndarray:
    """The points around a grid of (n + 1) x (m + 1), in the order of its faces."""
    index = np.arange((n + 1) * (m + 1)).reshape(n + 1, m + 1)
    return np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])
