"""Exact lines of sight through a scene of rigid objects and moving actors."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32

from perpetua.geometry.planes import Planes
from perpetua.geometry.raycast import NO_FACE, MovingCaster
from perpetua.scene.actor import ActorMesh
from perpetua.tracks.surface import SceneMeshes

NOTHING = 0


@dataclass(frozen=True)
class SceneRayHits:
    """What rays meet first: object (0: nothing), face of that object, distance along the ray."""

    object_index: Int32[np.ndarray, " N"]
    face: Int32[np.ndarray, " N"]
    distance_m: Float64[np.ndarray, " N"]


class SceneRayCaster:
    """Casts rays at all that is opaque, at one frame at a time."""

    def __init__(self, meshes: SceneMeshes) -> None:
        self.meshes = meshes
        self._room, self._room_planes = meshes.joined.caster, Planes.of(meshes.joined.corner_m)
        self._room_face = _FaceTable.of({index: len(mesh.faces) for index, mesh in meshes.static.items()})
        self._actors = MovingCaster(self._actor_vertices_m(0), _joined_actor_faces(meshes))
        self._actor_face = _FaceTable.of({index: len(faces) for index, faces in meshes.moving_faces.items()})
        self._frame = 0

    def first_hit(
        self,
        frame: int,
        eye_m: Float64[np.ndarray, "3"] | Float64[np.ndarray, "N 3"],
        directions: Float64[np.ndarray, "N 3"],
    ) -> SceneRayHits:
        """What each ray, from one place or each from its own, meets first at a frame; directions need not have unit
        length.

        Which triangle is met is found in single precision; how far it is, in double.
        """
        self._go_to(frame)
        eye_m = np.broadcast_to(eye_m, directions.shape)
        unit = directions / np.sqrt(np.einsum("nc,nc->n", directions, directions))[:, None]
        origins, single = eye_m.astype(np.float32), unit.astype(np.float32)
        room = self._room.meet(origins, single)
        actors = self._actors.meet(origins, single, room.distance_m)
        before = actors.face != NO_FACE
        object_index = np.where(before, self._actor_face.owner[actors.face], self._room_face.owner[room.face])
        face = np.where(before, self._actor_face.face[actors.face], self._room_face.face[room.face])
        distance_m = np.full(len(unit), np.inf)
        on_actor, on_room = np.flatnonzero(before), np.flatnonzero(~before & (room.face != NO_FACE))
        planes = self._room_planes.take(room.face[on_room])
        distance_m[on_room] = planes.along_m(eye_m[on_room], unit[on_room], room.distance_m[on_room])
        planes = Planes.of(self._actors.corner_m(actors.face[on_actor]))
        distance_m[on_actor] = planes.along_m(eye_m[on_actor], unit[on_actor], actors.distance_m[on_actor])
        return SceneRayHits(object_index, face, distance_m)

    def _go_to(self, frame: int) -> None:
        if frame != self._frame:
            self._actors.move_to(self._actor_vertices_m(frame))
            self._frame = frame

    def _actor_vertices_m(self, frame: int) -> Float32[np.ndarray, "P 3"]:
        vertices_m = [of_actor[frame] for of_actor in self.meshes.moving_vertices_m.values()]
        return np.concatenate([np.zeros((0, 3), np.float32), *vertices_m])


def _joined_actor_faces(meshes: SceneMeshes) -> Int32[np.ndarray, "F 3"]:
    first_vertex = np.cumsum([0] + [of_actor.shape[1] for of_actor in meshes.moving_vertices_m.values()])
    faces = [mesh + start for mesh, start in zip(meshes.moving_faces.values(), first_vertex[:-1], strict=True)]
    return np.concatenate([np.zeros((0, 3), np.int32), *faces]).astype(np.int32)


@dataclass(frozen=True)
class _FaceTable:
    """Object and face within it of each face of joined meshes; the last entry, at ``NO_FACE``, is nothing's."""

    owner: Int32[np.ndarray, " F"]
    face: Int32[np.ndarray, " F"]

    @classmethod
    def of(cls, faces_of: dict[int, int]) -> "_FaceTable":
        owners = [np.full(count, index, np.int32) for index, count in faces_of.items()]
        faces = [np.arange(count, dtype=np.int32) for count in faces_of.values()]
        nothing, no_face = np.array([NOTHING], np.int32), np.array([NO_FACE], np.int32)
        return cls(np.concatenate([*owners, nothing]), np.concatenate([*faces, no_face]))


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
