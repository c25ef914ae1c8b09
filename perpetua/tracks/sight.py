"""Exact lines of sight through a scene of rigid objects and moving actors."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int32

from perpetua.actors.types import ActorMesh
from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.raycast import NO_FACE, Caster, MovingCaster
from perpetua.tracks.surface import SceneMeshes

NOTHING = 0


@dataclass(frozen=True)
class SightHits:
    """What rays meet first: object (0: nothing), face of that object, distance along the ray."""

    object_index: Int32[np.ndarray, " N"]
    face: Int32[np.ndarray, " N"]
    distance_m: Float64[np.ndarray, " N"]


class SceneSight:
    """Casts rays at all that is opaque, at one frame at a time."""

    def __init__(self, meshes: SceneMeshes) -> None:
        self.meshes = meshes
        self._index = np.array(sorted(meshes.static), np.int32)
        parts = [meshes.static[index] for index in self._index.tolist()]
        self._room = Caster(join(parts))
        self._first_face = np.cumsum([0] + [len(part.faces) for part in parts])
        self._actors = {
            index: MovingCaster(TriMesh(_at(vertices_m, 0), meshes.moving_faces[index]))
            for index, vertices_m in meshes.moving_vertices_m.items()
        }
        self._frame = 0

    def first_hit(
        self, frame: int, origins_m: Float64[np.ndarray, "N 3"], directions: Float64[np.ndarray, "N 3"]
    ) -> SightHits:
        """What each ray meets first at a frame; directions need not have unit length."""
        self._go_to(frame)
        found = self._room.first_hit(origins_m, directions)
        place = np.searchsorted(self._first_face, found.face, side="right") - 1
        hit = found.face != NO_FACE
        object_index = np.full(len(origins_m), NOTHING, np.int32)
        face = np.full(len(origins_m), NO_FACE, np.int32)
        object_index[hit] = self._index[place[hit]]
        face[hit] = found.face[hit] - self._first_face[place[hit]]
        distance_m = found.distance_m
        for index, caster in self._actors.items():
            on_actor = caster.first_hit(origins_m, directions)
            nearer = on_actor.distance_m < distance_m
            object_index[nearer], face[nearer] = index, on_actor.face[nearer]
            distance_m = np.where(nearer, on_actor.distance_m, distance_m)
        return SightHits(object_index, face, distance_m)

    def _go_to(self, frame: int) -> None:
        if frame == self._frame:
            return
        for index, caster in self._actors.items():
            caster.move_to(_at(self.meshes.moving_vertices_m[index], frame))
        self._frame = frame


def _at(vertices_m: np.ndarray, frame: int) -> Float64[np.ndarray, "P 3"]:
    return vertices_m[frame].astype(np.float64)


@dataclass(frozen=True)
class HairFaces:
    """Which faces of each object are hair; its strands are thinner than pixels."""

    of_object: dict[int, Bool[np.ndarray, " F"]]

    def has(self, object_index: Int32[np.ndarray, " N"], face: Int32[np.ndarray, " N"]) -> Bool[np.ndarray, " N"]:
        """Whether faces are hair."""
        hair = np.zeros(len(face), bool)
        for index, faces in self.of_object.items():
            members = np.flatnonzero((object_index == index) & (face >= 0))
            hair[members] = faces[face[members]]
        return hair


def hair_faces(actors: tuple[ActorMesh, ...]) -> HairFaces:
    """The faces of parts whose name says that they are hair."""
    return HairFaces(
        {
            actor.object_index: np.concatenate([np.full(len(part.faces), "hair" in part.name) for part in actor.parts])
            for actor in actors
        }
    )
