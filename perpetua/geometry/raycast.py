"""Rays and closest distances against triangles: Embree for rays, Warp for distances and for rays at moving meshes.

Both work in single precision (about 1e-6 of the scene's size); the distance of a ray's hit is computed again in
double precision from the triangle that was hit. Embree's hierarchy is the quicker one to ask and slow to build;
Warp's is refitted to moved vertices in milliseconds.
"""

import importlib
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, no_type_check

import numpy as np
from jaxtyping import Bool, Float64, Int32, Int64

from perpetua.geometry.mesh import TriMesh

NO_FACE = -1
# A box is widened by this, so that single precision loses no ray along its sides.
BOX_MARGIN_M = 1e-4
FAR_M = 1e6


@dataclass(frozen=True)
class RayHits:
    """The first triangle on each ray.

    ``distance_m`` is the length along the ray (infinite where nothing is hit), ``face`` the triangle's index
    (-1: nothing), ``barycentric`` the weights of its three corners (zeros where nothing is hit).
    """

    distance_m: Float64[np.ndarray, " N"]
    face: Int32[np.ndarray, " N"]
    barycentric: Float64[np.ndarray, "N 3"]

    @property
    def hit(self) -> Bool[np.ndarray, " N"]:
        """Which rays meet a triangle."""
        return np.asarray(self.face != NO_FACE)


class Caster:
    """Queries against one mesh. Structures are built at the first query that needs them, and kept."""

    def __init__(self, mesh: TriMesh) -> None:
        self.mesh = mesh

    def first_hit(self, origins_m: Float64[np.ndarray, "N 3"], directions: Float64[np.ndarray, "N 3"]) -> RayHits:
        """The first triangle, front or back side, that each ray meets; directions need not have unit length."""
        face = np.full(len(origins_m), NO_FACE, np.int32)
        distance_m = np.full(len(origins_m), np.inf)
        barycentric = np.zeros((len(origins_m), 3))
        if len(origins_m) == 0 or len(self.mesh.faces) == 0:
            return RayHits(distance_m, face, barycentric)
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        found = self._embree.run(_single(origins_m), _single(unit), output=1)
        # Embree's miss is the all-ones id, which reads as -1 here.
        face = np.where(found["primID"] >= 0, found["primID"], NO_FACE).astype(np.int32)
        hit = face != NO_FACE
        u, v = found["u"][hit].astype(np.float64), found["v"][hit].astype(np.float64)
        barycentric[hit] = np.stack([1.0 - u - v, u, v], axis=1)
        corners_m = self.mesh.vertices_m[self.mesh.faces[face[hit]]]
        distance_m[hit] = _plane_distance_m(origins_m[hit], unit[hit], corners_m, found["tfar"][hit].astype(np.float64))
        return RayHits(distance_m, face, barycentric)

    def clear(
        self, origins_m: Float64[np.ndarray, "N 3"], targets_m: Float64[np.ndarray, "N 3"]
    ) -> Bool[np.ndarray, " N"]:
        """Whether no triangle lies between an origin and its target."""
        if len(origins_m) == 0 or len(self.mesh.faces) == 0:
            return np.ones(len(origins_m), bool)
        offset = targets_m - origins_m
        length_m = np.linalg.norm(offset, axis=1)
        unit = offset / np.maximum(length_m, 1e-12)[:, None]
        blocker = self._embree.run(_single(origins_m), _single(unit), _single(length_m), query="OCCLUDED")
        return np.asarray(blocker < 0)

    def closest_distance(
        self, points_m: Float64[np.ndarray, "N 3"], max_distance_m: float = FAR_M
    ) -> Float64[np.ndarray, " N"]:
        """Distance of each point to the nearest triangle, or ``max_distance_m`` where none is nearer.

        A small ``max_distance_m`` makes the search several times as quick.
        """
        closest_m = self.closest_point(points_m, max_distance_m)
        distance_m = np.linalg.norm(closest_m - points_m, axis=1)
        return np.where(np.isnan(distance_m), max_distance_m, distance_m)

    def closest_point(
        self, points_m: Float64[np.ndarray, "N 3"], max_distance_m: float = FAR_M
    ) -> Float64[np.ndarray, "N 3"]:
        """The point of any triangle that is nearest to each point; NaN where none is within ``max_distance_m``."""
        if len(points_m) == 0 or len(self.mesh.faces) == 0:
            return np.full(points_m.shape, np.nan)
        warp, kernel = _nearest_kernel()
        points = warp.array(_single(points_m), dtype=warp.vec3, device="cpu")
        offset = warp.full(len(points_m), np.nan, dtype=warp.vec3, device="cpu")
        warp.launch(kernel, len(points_m), [self._warp_mesh.id, points, max_distance_m, offset], device="cpu")
        return np.asarray(points_m + offset.numpy())

    @cached_property
    def _embree(self) -> Any:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        scene = EmbreeScene()
        TriangleMesh(scene, _single(self.mesh.vertices_m)[self.mesh.faces])
        return scene

    @cached_property
    def _warp_mesh(self) -> Any:
        return _make_warp_mesh(self.mesh)


class MovingCaster:
    """First hits on one mesh whose vertices move; ``move_to`` comes before every change of place."""

    def __init__(self, mesh: TriMesh) -> None:
        self.mesh = mesh
        self._warp_mesh = _make_warp_mesh(mesh)

    def move_to(self, vertices_m: Float64[np.ndarray, "P 3"]) -> None:
        """Puts the mesh's vertices elsewhere."""
        self.mesh = TriMesh(vertices_m, self.mesh.faces)
        self._warp_mesh.points.assign(_single(vertices_m))
        self._warp_mesh.refit()

    def first_hit(self, origins_m: Float64[np.ndarray, "N 3"], directions: Float64[np.ndarray, "N 3"]) -> RayHits:
        """The first triangle, front or back side, that each ray meets; directions need not have unit length."""
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        distance_m, face = np.full(len(unit), np.inf), np.full(len(unit), NO_FACE, np.int32)
        near = self._may_meet(origins_m, unit)
        found = self._cast(origins_m[near], unit[near])
        hit = found.face != NO_FACE
        corners_m = self.mesh.vertices_m[self.mesh.faces[found.face[hit]]]
        barycentric = np.zeros((len(unit), 3))
        face[near], barycentric[near] = found.face, found.barycentric
        distance_m[near[hit]] = _plane_distance_m(
            origins_m[near[hit]], unit[near[hit]], corners_m, found.distance_m[hit]
        )
        return RayHits(distance_m, face, barycentric)

    def _may_meet(
        self, origins_m: Float64[np.ndarray, "N 3"], unit: Float64[np.ndarray, "N 3"]
    ) -> Int64[np.ndarray, " M"]:
        """Rays that meet the mesh's box (the slab test of Kay and Kajiya 1986)."""
        low_m, high_m = self.mesh.vertices_m.min(axis=0) - BOX_MARGIN_M, self.mesh.vertices_m.max(axis=0) + BOX_MARGIN_M
        with np.errstate(divide="ignore", invalid="ignore"):
            first, second = (low_m - origins_m) / unit, (high_m - origins_m) / unit
        enter_m = np.nan_to_num(np.minimum(first, second), nan=-np.inf).max(axis=1)
        leave_m = np.nan_to_num(np.maximum(first, second), nan=np.inf).min(axis=1)
        return np.flatnonzero((leave_m >= enter_m) & (leave_m >= 0.0))

    def _cast(self, origins_m: Float64[np.ndarray, "N 3"], unit: Float64[np.ndarray, "N 3"]) -> RayHits:
        if len(unit) == 0:
            return RayHits(np.zeros(0), np.zeros(0, np.int32), np.zeros((0, 3)))
        warp, kernel = _first_hit_kernel()
        origins, directions = (warp.array(_single(given), dtype=warp.vec3, device="cpu") for given in (origins_m, unit))
        face = warp.full(len(unit), NO_FACE, dtype=int, device="cpu")
        place = warp.zeros(len(unit), dtype=warp.vec3, device="cpu")
        warp.launch(kernel, len(unit), [self._warp_mesh.id, origins, directions, face, place], device="cpu")
        reach = place.numpy().astype(np.float64)
        weights = np.stack([reach[:, 1], reach[:, 2], 1.0 - reach[:, 1] - reach[:, 2]], axis=1)
        hit = face.numpy() != NO_FACE
        return RayHits(np.where(hit, reach[:, 0], np.inf), face.numpy().astype(np.int32), weights * hit[:, None])


def _plane_distance_m(
    origins_m: Float64[np.ndarray, "N 3"],
    unit: Float64[np.ndarray, "N 3"],
    corners_m: Float64[np.ndarray, "N 3 3"],
    coarse_m: Float64[np.ndarray, " N"],
) -> Float64[np.ndarray, " N"]:
    normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    slope = np.einsum("ni,ni->n", normal, unit)
    # On a triangle seen edge-on its plane says nothing about where it was hit.
    grazing = np.abs(slope) < 1e-3 * np.linalg.norm(normal, axis=1)
    height = np.einsum("ni,ni->n", normal, corners_m[:, 0] - origins_m)
    return np.where(grazing, coarse_m, height / np.where(grazing, 1.0, slope))


def _single(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values, dtype=np.float32)


def _make_warp_mesh(mesh: TriMesh) -> Any:
    warp = _warp()
    points = warp.array(_single(mesh.vertices_m), dtype=warp.vec3, device="cpu")
    indices = warp.array(np.ascontiguousarray(mesh.faces.ravel()), dtype=int, device="cpu")
    return warp.Mesh(points=points, indices=indices, bvh_constructor="median")


@cache
def _warp() -> Any:
    """Warp, imported at the first query that needs it."""
    warp: Any = importlib.import_module("warp")
    # Its greeting, and its warning where there is no GPU, say nothing about these searches, which run on the CPU.
    warp.config.log_level = warp.LOG_ERROR
    return warp


@cache
def _nearest_kernel() -> tuple[Any, Any]:
    warp = _warp()

    # Warp compiles the function's source; its annotations are Warp's types, not Python's.
    @no_type_check
    def nearest(
        mesh: warp.uint64, points: warp.array(dtype=warp.vec3), limit: float, offset: warp.array(dtype=warp.vec3)
    ):
        i = warp.tid()
        query = warp.mesh_query_point_no_sign(mesh, points[i], limit)
        if query.result:
            offset[i] = warp.mesh_eval_position(mesh, query.face, query.u, query.v) - points[i]

    return warp, warp.kernel(nearest)


@cache
def _first_hit_kernel() -> tuple[Any, Any]:
    """``place`` gets the distance and the weights of the triangle's first two corners."""
    warp = _warp()

    @no_type_check
    def first_hit(
        mesh: warp.uint64,
        origins: warp.array(dtype=warp.vec3),
        directions: warp.array(dtype=warp.vec3),
        face: warp.array(dtype=int),
        place: warp.array(dtype=warp.vec3),
    ):
        i = warp.tid()
        query = warp.mesh_query_ray(mesh, origins[i], directions[i], 1.0e6)
        if query.result:
            face[i] = query.face
            place[i] = warp.vec3(query.t, query.u, query.v)

    return warp, warp.kernel(first_hit)
