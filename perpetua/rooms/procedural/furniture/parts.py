"""Closed meshes that furniture and walls are built from. All sizes in metres."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float64
from scipy.interpolate import PchipInterpolator
from scipy.spatial import ConvexHull

from perpetua.geometry.mesh import TriMesh
from perpetua.scene.room import Material

Point = tuple[float, float, float]
Profile = list[tuple[float, float]]


@dataclass(frozen=True)
class Part:
    """What one material covers of a piece of furniture.

    ``label`` is empty for the piece's main part. ``category`` is None where the part is what the piece is.
    """

    label: str
    mesh: TriMesh
    material: Material
    category: str | None = None


def block(low_m: Point, high_m: Point, bevel_m: float = 0.004, segments: int = 1) -> TriMesh:
    """A box between two corners with bevelled (``segments`` = 1) or rounded edges."""
    low, high = np.array(low_m), np.array(high_m)
    size = high - low
    bevel = min(bevel_m, 0.49 * float(size.min()))
    mesh = _rounded_box((float(size[0]), float(size[1]), float(size[2])), bevel, segments)
    return TriMesh(mesh.vertices_m + 0.5 * (low + high), mesh.faces)


@lru_cache(maxsize=16)
def _unit_octants(segments: int) -> tuple[Float64[np.ndarray, "P 3"], Float64[np.ndarray, "P 3"], TriMesh]:
    """Of a rounded box: directions from the middles of its rounded corners, those corners' signs, and faces."""
    angles = np.linspace(0.0, np.pi / 2, segments + 1)
    up, around = np.meshgrid(angles, angles, indexing="ij")
    directions = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)
    octant = np.unique(directions.reshape(-1, 3).round(9), axis=0)
    signs = np.stack(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0], indexing="ij"), axis=-1).reshape(-1, 1, 3)
    all_directions = (signs * octant).reshape(-1, 3)
    all_signs = np.broadcast_to(signs, (8, len(octant), 3)).reshape(-1, 3)
    return all_directions, all_signs, hull(all_signs + 0.3 * all_directions)


@lru_cache(maxsize=4096)
def _rounded_box(size_m: Point, radius_m: float, segments: int) -> TriMesh:
    directions, signs, unit = _unit_octants(segments)
    # All rounded boxes have the same faces: only their middles move.
    return TriMesh(signs * (0.5 * np.array(size_m) - radius_m) + radius_m * directions, unit.faces)


def hull(points_m: Float64[np.ndarray, "N 3"]) -> TriMesh:
    """The convex hull of points, all of them on it, as a closed mesh."""
    convex = ConvexHull(points_m)
    faces = convex.simplices.copy()
    corners = points_m[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normal * convex.equations[:, :3]).sum(1) < 0
    faces[inward] = faces[inward][:, ::-1]
    return TriMesh(points_m, faces.astype(np.int32))


def loft(rings_m: Float64[np.ndarray, "R K 3"]) -> TriMesh:
    """A skin over rings of points, closed at both ends; each ring runs counter-clockwise seen against the path."""
    rings, sides = rings_m.shape[:2]
    here, there = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = []
    for ring in range(rings - 1):
        low, high = sides * ring, sides * (ring + 1)
        faces.append(np.stack([low + here, low + there, high + there], axis=1))
        faces.append(np.stack([low + here, high + there, high + here], axis=1))
    first, last, top = rings * sides, rings * sides + 1, sides * (rings - 1)
    faces.append(np.stack([np.full(sides, first), there, here], axis=1))
    faces.append(np.stack([np.full(sides, last), top + here, top + there], axis=1))
    ends = np.stack([rings_m[0].mean(0), rings_m[-1].mean(0)])
    return TriMesh(np.concatenate([rings_m.reshape(-1, 3), ends]), np.concatenate(faces).astype(np.int32))


def lathe(profile_m: Profile, centre_m: tuple[float, float] = (0.0, 0.0), sides: int = 20) -> TriMesh:
    """A profile of (radius, z), from the lower to the upper end of the outside, turned around a vertical axis.

    The profile must start and end on the axis (radius 0) and have no other point there.
    """
    bottom, *middle, top = profile_m
    angles = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings = np.stack(
        [np.column_stack([np.array(centre_m) + radius * circle, np.full(sides, z)]) for radius, z in middle]
    )
    mesh = loft(rings)
    mesh.vertices_m[-2:] = (*centre_m, bottom[1]), (*centre_m, top[1])
    return mesh


def curve(points: Profile, count: int) -> Profile:
    """A smooth profile of (radius, z) through points of rising z, without overshoot."""
    radius, z = np.array(points).T
    fine = np.linspace(z[0], z[-1], count)
    return [(float(r), float(h)) for r, h in zip(PchipInterpolator(z, radius)(fine), fine, strict=True)]


def post(
    centre_m: tuple[float, float],
    radius_m: float,
    low_z_m: float,
    high_z_m: float,
    sides: int = 14,
    bevel_m: float = 0.0,
) -> TriMesh:
    """A vertical cylinder, its edges bevelled if asked."""
    if bevel_m == 0.0:
        return lathe([(0.0, low_z_m), (radius_m, low_z_m), (radius_m, high_z_m), (0.0, high_z_m)], centre_m, sides)
    inner = radius_m - bevel_m
    side = [(radius_m, low_z_m + bevel_m), (radius_m, high_z_m - bevel_m)]
    return lathe([(0.0, low_z_m), (inner, low_z_m), *side, (inner, high_z_m), (0.0, high_z_m)], centre_m, sides)


def tube(path_m: list[Point], radius_m: float | list[float], sides: int = 10) -> TriMesh:
    """A round rod along a path, of one radius or of one at each point."""
    path = np.array(path_m)
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    helper = np.eye(3)[np.abs(tangent).sum(0).argmin()]
    angles = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)[:, None]
    rings = []
    for point, forward, radius in zip(path, tangent, np.broadcast_to(radius_m, len(path)), strict=True):
        side = np.cross(helper, forward)
        side /= np.linalg.norm(side)
        rings.append(point + radius * (np.cos(angles) * side + np.sin(angles) * np.cross(forward, side)))
    return loft(np.stack(rings))


def bar(start_m: Point, end_m: Point, radius_m: float, sides: int = 10) -> TriMesh:
    """A cylinder between two points."""
    return tube([start_m, end_m], radius_m, sides)


def prism(outline_m: Float64[np.ndarray, "K 2"], low_z_m: float, high_z_m: float, apex: int = 0) -> TriMesh:
    """A prism over a counter-clockwise outline that is all in view of its corner number ``apex``."""
    outline = np.roll(outline_m, -apex, axis=0)
    count = len(outline)
    here, there = np.arange(count), (np.arange(count) + 1) % count
    fan = np.stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)], axis=1)
    sides = [np.stack([here, there, count + there], 1), np.stack([here, count + there, count + here], 1)]
    vertices = [np.column_stack([outline, np.full(count, z)]) for z in (low_z_m, high_z_m)]
    return TriMesh(np.concatenate(vertices), np.concatenate([*sides, fan[:, ::-1], count + fan]).astype(np.int32))


def turned(mesh: TriMesh, turn: tuple[float, float], shift_m: Point) -> TriMesh:
    """The mesh turned about the vertical axis by the angle of this cosine and sine, then shifted."""
    cosine, sine = turn
    world_from_piece = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return TriMesh(mesh.vertices_m @ world_from_piece.T + np.array(shift_m), mesh.faces)


def tilted(mesh: TriMesh, angle_rad: float, hinge_m: tuple[float, float]) -> TriMesh:
    """The mesh turned about the line along x through ``hinge_m`` (y, z); a positive angle leans its top to -y."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    hinge = np.array([0.0, *hinge_m])
    turn = np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
    return TriMesh((mesh.vertices_m - hinge) @ turn.T + hinge, mesh.faces)


def moved(mesh: TriMesh, shift_m: Point) -> TriMesh:
    """The mesh shifted."""
    return TriMesh(mesh.vertices_m + np.array(shift_m), mesh.faces)
