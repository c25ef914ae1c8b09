"""Rays and closest distances against triangles: Embree for rays, Warp for distances and for rays at moving meshes.

Both work in single precision (about 1e-6 of the scene's size); the distance of a ray's hit is computed again in
double precision from the triangle that was hit (``meet`` leaves that to its caller). Embree's hierarchy is the
quicker one to ask and slow to build; Warp's is refitted to moved vertices in milliseconds.
"""

import importlib
import os
import sys
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any, no_type_check

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int32

from perpetua.geometry.mesh import TriMesh

NO_FACE = -1
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


@dataclass(frozen=True)
class RoughHits:
    """The first triangle on each ray, in single precision: length along the ray (infinite where nothing is hit) and
    the triangle's index (-1: nothing)."""

    distance_m: Float32[np.ndarray, " N"]
    face: Int32[np.ndarray, " N"]


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

    def meet(self, origins: Float32[np.ndarray, "N 3"], unit: Float32[np.ndarray, "N 3"]) -> RoughHits:
        """The first triangle, front or back side, on each ray in a direction of unit length."""
        if len(unit) == 0 or len(self.mesh.faces) == 0:
            return RoughHits(np.full(len(unit), np.inf, np.float32), np.full(len(unit), NO_FACE, np.int32))
        found = self._embree.run(_single(origins), _single(unit), output=1)
        face = np.maximum(found["primID"], NO_FACE).astype(np.int32)
        return RoughHits(np.where(face == NO_FACE, np.float32(np.inf), found["tfar"]), face)

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
        return _make_warp_mesh(self.mesh.vertices_m, self.mesh.faces)


class MovingCaster:
    """First hits on one mesh whose vertices move; ``move_to`` comes before every change of place."""

    def __init__(self, vertices_m: Float32[np.ndarray, "P 3"], faces: Int32[np.ndarray, "F 3"]) -> None:
        self.vertices_m, self.faces = vertices_m, faces
        self._warp_mesh = _make_warp_mesh(vertices_m, faces, "sah") if len(faces) else None

    def move_to(self, vertices_m: Float32[np.ndarray, "P 3"]) -> None:
        """Puts the mesh's vertices elsewhere."""
        self.vertices_m = vertices_m
        if self._warp_mesh is not None:
            self._warp_mesh.points.assign(_single(vertices_m))
            self._warp_mesh.refit()

    def corner_m(self, face: Int32[np.ndarray, " M"]) -> Float64[np.ndarray, "M 3 3"]:
        """Where the corners of triangles are."""
        return self.vertices_m[self.faces[face]].astype(np.float64)

    def meet(
        self,
        origins: Float32[np.ndarray, "N 3"],
        unit: Float32[np.ndarray, "N 3"],
        nearer_than_m: Float32[np.ndarray, " N"] | None = None,
    ) -> RoughHits:
        """The first triangle, front or back side, on each ray in a direction of unit length.

        What is not nearer than ``nearer_than_m`` on a ray is not met.
        """
        face, distance_m = np.full(len(unit), NO_FACE, np.int32), np.full(len(unit), np.inf, np.float32)
        limit_m = np.full(len(unit), FAR_M, np.float32) if nearer_than_m is None else np.minimum(nearer_than_m, FAR_M)
        if len(unit) and self._warp_mesh is not None:
            warp, kernel = _first_hit_kernel()
            rays = ((_single(given), warp.vec3) for given in (origins, unit))
            kinds = (*rays, (_single(limit_m), float), (face, int), (distance_m, float))
            shared = [warp.array(values, dtype=kind, device="cpu", copy=False) for values, kind in kinds]
            warp.launch(kernel, len(unit), [self._warp_mesh.id, *shared], device="cpu")
        return RoughHits(distance_m, face)


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


def _make_warp_mesh(
    vertices_m: Float[np.ndarray, "P 3"], faces: Int32[np.ndarray, "F 3"], constructor: str = "median"
) -> Any:
    warp = _warp()
    points = warp.array(_single(vertices_m), dtype=warp.vec3, device="cpu")
    indices = warp.array(np.ascontiguousarray(faces.ravel()), dtype=int, device="cpu")
    return warp.Mesh(points=points, indices=indices, bvh_constructor=constructor)


@cache
def _warp() -> Any:
    """Warp, imported at the first query that needs it."""
    warp: Any = importlib.import_module("warp")
    # Its greeting, and its warning where there is no GPU, say nothing about these searches, which run on the CPU. The
    # warning comes from its compiled part, which knows no level and writes to the process's own stderr.
    warp.config.log_level = warp.LOG_ERROR
    sys.stderr.flush()
    kept = os.dup(2)
    try:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        warp.init()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
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

    return warp, warp.kernel(nearest, enable_backward=False, module="unique")


@cache
def _first_hit_kernel() -> tuple[Any, Any]:
    """Leaves ``face`` and ``distance_m`` as they are where nothing is met."""
    warp = _warp()

    @no_type_check
    def first_hit(
        mesh: warp.uint64,
        origins: warp.array(dtype=warp.vec3),
        directions: warp.array(dtype=warp.vec3),
        limit_m: warp.array(dtype=float),
        face: warp.array(dtype=int),
        distance_m: warp.array(dtype=float),
    ):
        i = warp.tid()
        query = warp.mesh_query_ray(mesh, origins[i], directions[i], limit_m[i])
        if query.result:
            face[i] = query.face
            distance_m[i] = query.t

    return warp, warp.kernel(first_hit, enable_backward=False, module="unique")
