"""Closed meshes that furniture and walls are built from. All sizes in metres."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float64
from scipy.spatial import ConvexHull

from perpetua.geometry.mesh import TriMesh
from perpetua.rooms.types import Material

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Part:
    """What one material covers of a piece of furniture; ``label`` is empty for the piece's main part."""

    label: str
    mesh: TriMesh
    material: Material


def block(low_m: Point, high_m: Point, bevel_m: float = 0.004, segments: int = 1) -> TriMesh:
    """A box between two corners with bevelled (``segments`` = 1) or rounded edges."""
    low, high = np.array(low_m), np.array(high_m)
    size = high - low
    bevel = min(bevel_m, 0.49 * float(size.min()))
    mesh = _rounded_box((float(size[0]), float(size[1]), float(size[2])), bevel, segments)
    return TriMesh(mesh.vertices_m + 0.5 * (low + high), mesh.faces)


@lru_cache(maxsize=1024)
def _rounded_box(size_m: Point, radius_m: float, segments: int) -> TriMesh:
    angles = np.linspace(0.0, np.pi / 2, segments + 1)
    up, around = np.meshgrid(angles, angles, indexing="ij")
    directions = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)
    octant = radius_m * np.unique(directions.reshape(-1, 3).round(9), axis=0) + 0.5 * np.array(size_m) - radius_m
    signs = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1], indexing="ij"), axis=-1).reshape(-1, 1, 3)
    return hull((signs * octant).reshape(-1, 3))


def hull(points_m: Float64[np.ndarray, "N 3"]) -> TriMesh:
    """The convex hull of points as a closed mesh."""
    convex = ConvexHull(points_m)
    faces = convex.simplices.copy()
    corners = points_m[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normal * convex.equations[:, :3]).sum(1) < 0
    faces[inward] = faces[inward][:, ::-1]
    used, index = np.unique(faces, return_inverse=True)
    return TriMesh(points_m[used], index.reshape(faces.shape).astype(np.int32))


def lathe(profile_m: list[tuple[float, float]], centre_m: tuple[float, float] = (0.0, 0.0), sides: int = 20) -> TriMesh:
    """A profile of (radius, z), from the lower to the upper end of the outside, turned around a vertical axis.

    The profile must start and end on the axis (radius 0) and have no other point there.
    """
    bottom, *rings, top = profile_m
    angles = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    vertices = [np.array([[*centre_m, bottom[1]]])]
    for radius, z in rings:
        vertices.append(np.column_stack([centre_m + radius * circle, np.full(sides, z)]))
    vertices.append(np.array([[*centre_m, top[1]]]))
    here = np.arange(sides)
    there = (here + 1) % sides
    last = 1 + sides * len(rings)
    faces = [np.stack([np.zeros(sides, int), 1 + there, 1 + here], axis=1)]
    for ring in range(len(rings) - 1):
        low, high = 1 + sides * ring, 1 + sides * (ring + 1)
        faces.append(np.stack([low + here, low + there, high + there], axis=1))
        faces.append(np.stack([low + here, high + there, high + here], axis=1))
    faces.append(np.stack([np.full(sides, last), last - sides + here, last - sides + there], axis=1))
    return TriMesh(np.concatenate(vertices), np.concatenate(faces).astype(np.int32))


def post(centre_m: tuple[float, float], radius_m: float, low_z_m: float, high_z_m: float, sides: int = 14) -> TriMesh:
    """A vertical cylinder."""
    return lathe([(0.0, low_z_m), (radius_m, low_z_m), (radius_m, high_z_m), (0.0, high_z_m)], centre_m, sides)


def bar(start_m: Point, end_m: Point, radius_m: float, sides: int = 10) -> TriMesh:
    """A cylinder between two points."""
    axis = np.array(end_m) - np.array(start_m)
    length = float(np.linalg.norm(axis))
    upright = post((0.0, 0.0), radius_m, 0.0, length, sides)
    forward = axis / length
    helper = np.array([1.0, 0.0, 0.0]) if abs(forward[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    side = np.cross(forward, helper)
    side /= np.linalg.norm(side)
    world_from_bar = np.stack([side, np.cross(forward, side), forward], axis=1)
    return TriMesh(upright.vertices_m @ world_from_bar.T + np.array(start_m), upright.faces)


def folds(width_m: float, depth_m: float, low_z_m: float, high_z_m: float, count: int) -> TriMesh:
    """A hanging cloth with vertical folds, centred on x = 0, its back on y = 0."""
    columns = 8 * count + 1
    x = np.linspace(-0.5 * width_m, 0.5 * width_m, columns)
    thickness = 0.2 * depth_m
    y = 0.5 * (depth_m - thickness) * (1.0 - np.cos(2 * np.pi * count * np.linspace(0.0, 1.0, columns)))
    outline = np.concatenate([np.stack([x, y], axis=1), np.stack([x, y + thickness], axis=1)[::-1]])
    return _prism(outline, low_z_m, high_z_m)


def _prism(outline_m: Float64[np.ndarray, "K 2"], low_z_m: float, high_z_m: float) -> TriMesh:
    """A prism over a band: the second half of the counter-clockwise outline runs back along the first."""
    count = len(outline_m)
    low = np.column_stack([outline_m, np.full(count, low_z_m)])
    high = np.column_stack([outline_m, np.full(count, high_z_m)])
    here = np.arange(count)
    there = (here + 1) % count
    sides = np.concatenate(
        [np.stack([here, there, count + there], axis=1), np.stack([here, count + there, count + here], axis=1)]
    )
    first = np.arange(count // 2 - 1)
    back = count - 1 - first
    top = np.concatenate([np.stack([first, first + 1, back], 1), np.stack([first + 1, back - 1, back], 1)])
    faces = np.concatenate([sides, top[:, ::-1], count + top])
    return TriMesh(np.concatenate([low, high]), faces.astype(np.int32))


def turned(mesh: TriMesh, turn_rad: float, shift_m: Point) -> TriMesh:
    """The mesh turned about the vertical axis, then shifted."""
    cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
    world_from_piece = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return TriMesh(mesh.vertices_m @ world_from_piece.T + np.array(shift_m), mesh.faces)
