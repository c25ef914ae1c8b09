"""Points fixed to triangles of the scene, and where those triangles are at each frame."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int32, Int64, Integer

from perpetua.geometry.mesh import TriMesh
from perpetua.scene.scene import Scene
from perpetua.scene.surfaces import Surfaces


@dataclass(frozen=True)
class SurfacePoints:
    """Points by object, face of that object, and weights of the face's three corners."""

    object_index: Int32[np.ndarray, " N"]
    face: Int32[np.ndarray, " N"]
    barycentric: Float64[np.ndarray, "N 3"]

    def __len__(self) -> int:
        return len(self.face)

    def take(self, chosen: Integer[np.ndarray, " M"] | Bool[np.ndarray, " N"]) -> "SurfacePoints":
        """Some of the points, in the order given."""
        return SurfacePoints(self.object_index[chosen], self.face[chosen], self.barycentric[chosen])


def join_points(groups: Sequence[SurfacePoints]) -> SurfacePoints:
    """All points, group after group."""
    if not groups:
        return SurfacePoints(np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros((0, 3)))
    return SurfacePoints(
        np.concatenate([group.object_index for group in groups]),
        np.concatenate([group.face for group in groups]),
        np.concatenate([group.barycentric for group in groups]),
    )


@dataclass(frozen=True)
class SceneMeshes:
    """What tracks can lie on: rigid opaque objects of the room, and actors, both by object index.

    ``joined`` has the rigid ones as one mesh.
    """

    static: dict[int, TriMesh]
    joined: Surfaces
    moving_vertices_m: dict[int, Float32[np.ndarray, "T P 3"]]
    moving_faces: dict[int, Int32[np.ndarray, "F 3"]]

    @classmethod
    def of_rigid(cls, meshes: dict[int, TriMesh]) -> "SceneMeshes":
        """Rigid objects alone, by object index."""
        return cls(meshes, Surfaces.of(meshes), {}, {})

    @classmethod
    def of(cls, scene: Scene) -> "SceneMeshes":
        """The meshes of a room and its actors."""
        return cls(
            {obj.object_index: obj.mesh for obj in scene.room.objects if obj.opaque},
            scene.room.opaque,
            {actor.object_index: actor.vertices_m for actor in scene.actors},
            {actor.object_index: actor.faces for actor in scene.actors},
        )


@dataclass(frozen=True)
class _MovingGroup:
    points: Int64[np.ndarray, " M"]
    vertices_m: Float32[np.ndarray, "T P 3"]
    vertex: Int32[np.ndarray, "M 3"]


@dataclass(frozen=True)
class BoundPoints:
    """Points with their triangles looked up; made by ``bind``."""

    points: SurfacePoints
    rest_corner_m: Float64[np.ndarray, "N 3 3"]
    moving: tuple[_MovingGroup, ...]

    def corner_m(self, frame: int) -> Float64[np.ndarray, "N 3 3"]:
        """World positions of the corners of each point's triangle."""
        corner_m = self.rest_corner_m.copy()
        for members, moved_m in self.moved_corner_m(frame):
            corner_m[members] = moved_m
        return corner_m

    def moved_corner_m(self, frame: int) -> Iterator[tuple[Int64[np.ndarray, " M"], Float64[np.ndarray, "M 3 3"]]]:
        """Which points are on each actor, and the corners of their triangles at a frame."""
        for group in self.moving:
            yield group.points, group.vertices_m[frame][group.vertex].astype(np.float64)

    def point_m(self, frame: int) -> Float64[np.ndarray, "N 3"]:
        """World positions at one frame, the same bits as ``position_m`` has."""
        return np.asarray(np.einsum("nk,nkc->nc", self.points.barycentric, self.corner_m(frame)))

    def position_m(self, frames: int) -> Float64[np.ndarray, "T N 3"]:
        """World positions at each frame. Points of rigid objects are bit for bit the same in all frames."""
        weight = self.points.barycentric
        rest_m = np.einsum("nk,nkc->nc", weight, self.rest_corner_m)
        position_m = np.repeat(rest_m[None], frames, axis=0)
        for frame in range(frames):
            for members, corner_m in self.moved_corner_m(frame):
                position_m[frame, members] = np.einsum("nk,nkc->nc", weight[members], corner_m)
        return position_m


def bind(meshes: SceneMeshes, points: SurfacePoints) -> BoundPoints:
    """Looks up the triangles of points."""
    rest_corner_m = np.zeros((len(points), 3, 3))
    moving: list[_MovingGroup] = []
    for object_index in np.unique(points.object_index).tolist():
        members = np.flatnonzero(points.object_index == object_index)
        if object_index in meshes.static:
            mesh = meshes.static[object_index]
            rest_corner_m[members] = mesh.vertices_m[mesh.faces[points.face[members]]]
        else:
            vertex = meshes.moving_faces[object_index][points.face[members]]
            moving.append(_MovingGroup(members, meshes.moving_vertices_m[object_index], vertex))
    return BoundPoints(points, rest_corner_m, tuple(moving))


def plane_barycentric(
    point_m: Float[np.ndarray, "N 3"], corner_m: Float[np.ndarray, "N 3 3"]
) -> Float64[np.ndarray, "N 3"]:
    """Weights of the triangle's corners for points in its plane (Ericson, Real-Time Collision Detection, 3.4)."""
    first, second = corner_m[:, 1] - corner_m[:, 0], corner_m[:, 2] - corner_m[:, 0]
    offset = point_m - corner_m[:, 0]
    d00 = np.einsum("nc,nc->n", first, first)
    d01 = np.einsum("nc,nc->n", first, second)
    d11 = np.einsum("nc,nc->n", second, second)
    d20 = np.einsum("nc,nc->n", offset, first)
    d21 = np.einsum("nc,nc->n", offset, second)
    with np.errstate(divide="ignore", invalid="ignore"):
        v = (d11 * d20 - d01 * d21) / (d00 * d11 - d01 * d01)
        w = (d00 * d21 - d01 * d20) / (d00 * d11 - d01 * d01)
    return np.stack([1.0 - v - w, v, w], axis=1).astype(np.float64)
