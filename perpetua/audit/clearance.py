"""Exact distances of bodies and cameras to triangles, by FCL; shares no code with what plans routes and cameras.

The Flexible Collision Library (Pan, Chitta and Manocha, ICRA 2012) measures shapes against a bounding volume
hierarchy of triangles in double precision. Only triangles near the way are put into it: a room has millions.
"""

import fcl
import numpy as np
import trimesh
from jaxtyping import Float32, Float64, Int32
from scipy.spatial import KDTree

from perpetua.geometry.mesh import TriMesh

# Larger distances are given as this one.
FAR_M = 1.0
# FCL measures solids: points are spheres and lines are cylinders of this radius.
THIN_M = 1e-3
# The longest edge of a moving mesh is measured in every 24th frame, and multiplied by this factor.
EDGE_FRAMES, EDGE_SLACK = 24, 1.25


def points_to_mesh_m(points_m: Float64[np.ndarray, "N 3"], mesh: TriMesh) -> Float64[np.ndarray, " N"]:
    """Distance of each point to the nearest triangle, at most ``FAR_M``."""
    near = _near(mesh, points_m, (0, 1, 2))
    return _distances_m(fcl.Sphere(THIN_M), points_m, near)


def pillars_to_mesh_m(
    feet_m: Float64[np.ndarray, "N 3"], low_m: float, high_m: float, mesh: TriMesh
) -> Float64[np.ndarray, " N"]:
    """Distance of upright lines from ``low_m`` to ``high_m`` above each foot point to the nearest triangle."""
    # Triangles low enough to step over, or above the head, are no obstacles.
    height_m = mesh.vertices_m[mesh.faces][:, :, 2]
    beside = (height_m.max(axis=1) > feet_m[:, 2].min() + low_m) & (height_m.min(axis=1) < feet_m[:, 2].max() + high_m)
    near = _near(TriMesh(mesh.vertices_m, mesh.faces[beside]), feet_m, (0, 1))
    middle_m = feet_m + np.array([0.0, 0.0, 0.5 * (low_m + high_m)])
    return _distances_m(fcl.Cylinder(THIN_M, high_m - low_m - 2 * THIN_M), middle_m, near)


def _near(mesh: TriMesh, way_m: Float64[np.ndarray, "N 3"], axes: tuple[int, ...]) -> TriMesh:
    """The triangles that may be within ``FAR_M`` of the positions, measured along these axes."""
    corners_m = mesh.vertices_m[mesh.faces][:, :, axes]
    middle_m = corners_m.mean(axis=1)
    reach_m = np.linalg.norm(corners_m - middle_m[:, None], axis=2).max(axis=1, initial=0.0)
    apart_m, _ = KDTree(way_m[:, axes]).query(middle_m)
    faces = mesh.faces[apart_m <= reach_m + FAR_M]
    used, renumbered = np.unique(faces, return_inverse=True)
    return TriMesh(mesh.vertices_m[used], renumbered.reshape(-1, 3).astype(np.int32))


def _distances_m(
    shape: fcl.CollisionGeometry, places_m: Float64[np.ndarray, "N 3"], mesh: TriMesh
) -> Float64[np.ndarray, " N"]:
    distance_m = np.full(len(places_m), FAR_M)
    if not len(mesh.faces):
        return distance_m
    model = fcl.BVHModel()
    model.beginModel(len(mesh.vertices_m), len(mesh.faces))
    model.addSubModel(mesh.vertices_m, mesh.faces)
    model.endModel()
    scene, body = fcl.CollisionObject(model), fcl.CollisionObject(shape)
    for index, place_m in enumerate(places_m):
        body.setTranslation(place_m)
        # FCL returns -1 where they overlap.
        found_m = fcl.distance(body, scene, fcl.DistanceRequest(), fcl.DistanceResult())
        distance_m[index] = min(FAR_M, max(0.0, found_m + THIN_M if found_m > 0 else 0.0))
    return distance_m


def points_to_moving_mesh_m(
    points_m: Float64[np.ndarray, "N 3"],
    time: Float64[np.ndarray, " N"],
    vertices_m: Float32[np.ndarray, "T P 3"],
    faces: Int32[np.ndarray, "F 3"],
) -> Float64[np.ndarray, " N"]:
    """Distance of each point to a deforming mesh at its own time, at most ``FAR_M``.

    Args:
        points_m: where.
        time: when, in frames; between frames vertices move on straight lines.
        vertices_m: the mesh at each frame.
        faces: its triangles.
    """
    frame = np.minimum(time.astype(int), len(vertices_m) - 2)
    low_m, high_m = vertices_m.min(axis=1), vertices_m.max(axis=1)
    low_m, high_m = np.minimum(low_m[frame], low_m[frame + 1]), np.maximum(high_m[frame], high_m[frame + 1])
    beyond_m = np.maximum(np.maximum(low_m - points_m, points_m - high_m), 0.0)
    near = np.flatnonzero(np.linalg.norm(beyond_m, axis=1) < FAR_M)
    distance_m = np.full(len(points_m), FAR_M)
    longest_m = _longest_edge_m(vertices_m, faces) if len(near) else 0.0
    for index in near:
        fraction = time[index] - frame[index]
        before_m, after_m = vertices_m[frame[index] : frame[index] + 2].astype(np.float64)
        at_time_m = (1.0 - fraction) * before_m + fraction * after_m
        distance_m[index] = _to_triangles_m(points_m[index], at_time_m, faces, longest_m)
    return np.minimum(distance_m, FAR_M)


def _longest_edge_m(vertices_m: Float32[np.ndarray, "T P 3"], faces: Int32[np.ndarray, "F 3"]) -> float:
    """An upper bound of the edges at all times: bodies do not stretch by the slack between the measured frames."""
    longest_m = 0.0
    for placed_m in vertices_m[::EDGE_FRAMES]:
        corners_m = placed_m[faces]
        longest_m = max(longest_m, *(float(np.abs(corners_m[:, k] - corners_m[:, k - 1]).max()) for k in range(3)))
    return float(np.sqrt(3.0)) * EDGE_SLACK * longest_m


def _to_triangles_m(
    point_m: Float64[np.ndarray, "3"],
    vertices_m: Float64[np.ndarray, "P 3"],
    faces: Int32[np.ndarray, "F 3"],
    longest_m: float,
) -> float:
    """Distance of a point to the nearest triangle.

    A triangle is no nearer than its nearest corner less its longest edge, so only few have to be measured.
    """
    offset_m = vertices_m - point_m
    to_vertex_m = np.sqrt(np.einsum("pc,pc->p", offset_m, offset_m))
    least_m = to_vertex_m.min()
    some = faces[(to_vertex_m <= least_m + longest_m)[faces].any(axis=1)]
    corners_m = vertices_m[some]
    edge_m = np.max([np.linalg.norm(corners_m[:, k] - corners_m[:, k - 1], axis=1) for k in range(3)], axis=0)
    close = corners_m[to_vertex_m[some].min(axis=1) - edge_m <= least_m]
    closest_m = trimesh.triangles.closest_point(close, np.repeat(point_m[None], len(close), axis=0))
    return float(np.linalg.norm(closest_m - point_m, axis=1).min())
