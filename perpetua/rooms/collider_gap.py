"""How far what is rendered lies from the collision meshes that a room was furnished with."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.geometry.mesh import TriMesh, face_areas_m2
from perpetua.geometry.raycast import Caster
from perpetua.navigation.raster import inside_polygon
from perpetua.scene.room import Room

SAMPLES = 20_000
FAR_M = 0.02
# The outer side of the walls, which nobody sees, lies further out than this.
SHELL_M = 0.05
# A search no wider than this is quick; what has no collider at all is counted as this far.
LIMIT_M = 0.5


@dataclass(frozen=True)
class ColliderGap:
    """Distances from points spread evenly over the surface inside a room to the nearest collision surface, metres.

    ``share_beyond_2_cm`` counts the points farther than 2 cm; no distance is counted as more than ``LIMIT_M``.
    """

    median_m: float
    p95_m: float
    p99_m: float
    max_m: float
    share_beyond_2_cm: float


def collider_gap(room: Room, colliders: TriMesh) -> ColliderGap:
    """Compares the rendered surface of a room with its collision meshes."""
    points_m = _spread(room.surfaces.mesh, SAMPLES)
    distance_m = Caster(colliders).closest_distance(points_m[_inside(points_m, room)], LIMIT_M)
    median_m, p95_m, p99_m = (round(float(value), 5) for value in np.quantile(distance_m, (0.5, 0.95, 0.99)))
    fraction = round(float((distance_m > FAR_M).mean()), 5)
    return ColliderGap(median_m, p95_m, p99_m, round(float(distance_m.max()), 5), fraction)


def _inside(points_m: Float64[np.ndarray, "N 3"], room: Room) -> Bool[np.ndarray, " N"]:
    """Which points lie on or within the inner sides of floor, walls and ceiling."""
    half_m = 0.5 * np.ptp(room.floor_polygon_m, axis=0)
    grown_m = room.floor_polygon_m * (1.0 + SHELL_M / half_m)
    level = (points_m[:, 2] > -SHELL_M) & (points_m[:, 2] < room.height_m + SHELL_M)
    return np.asarray(level & inside_polygon(points_m[:, :2], grown_m))


def _spread(mesh: TriMesh, count: int) -> Float64[np.ndarray, "N 3"]:
    """Points at equal steps of area along the list of triangles, inside each by an additive recurrence.

    No randomness is needed: the recurrence (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences")
    fills each triangle evenly.
    """
    area_m2 = np.cumsum(face_areas_m2(mesh.vertices_m, mesh.faces))
    k = np.arange(count)
    face = np.searchsorted(area_m2, (k + 0.5) * area_m2[-1] / count)
    u, v = (k * 0.7548776662466927) % 1.0, (k * 0.5698402909980532) % 1.0
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    weights = np.stack([1.0 - u - v, u, v], axis=1)
    return np.einsum("nc,ncx->nx", weights, mesh.vertices_m[mesh.faces[face]])
