"""How deep a body is in the scene, measured from the inside out.

Each checked vertex belongs to the bone that it keeps closest to, and a surface between the two means that the vertex is
on the wrong side of it. That needs no closed or consistently oriented furniture. Bones themselves are checked in the
same way, which finds limbs that are wholly beyond a wall.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.raycast import Caster
from perpetua.scene.actor import BODY_JOINTS, BODY_PARENTS, ActorMesh
from perpetua.scene.room import Room

_BONES = tuple((parent, joint) for joint, parent in enumerate(BODY_PARENTS) if parent >= 0)


@dataclass(frozen=True)
class Worst:
    """The worst value in metres of a figure, the frame it occurs at, and what it concerns."""

    value_m: float
    frame: int
    place: str


@dataclass(frozen=True)
class Obstacles:
    """What bodies must keep out of; each face belongs to the object of that index in ``object_names``."""

    caster: Caster
    object_names: tuple[str, ...]
    object_of_face: Int64[np.ndarray, " F"]


def make_obstacles(room: Room, low_m: float) -> Obstacles:
    """All triangles of a room that rise above the height ``low_m``; what is lower is stepped over."""
    triangles_m = [obj.mesh.vertices_m[obj.mesh.faces] for obj in room.objects]
    high = [corners_m[:, :, 2].max(axis=1) > low_m for corners_m in triangles_m]
    owners = [np.full(int(rises.sum()), index, np.int64) for index, rises in enumerate(high)]
    soup = _soup([corners_m[rises] for corners_m, rises in zip(triangles_m, high, strict=True)])
    return Obstacles(Caster(soup), tuple(obj.name for obj in room.objects), np.concatenate(owners))


def make_floor(room: Room) -> Caster:
    """What people can stand on."""
    return Caster(_soup([obj.mesh.vertices_m[obj.mesh.faces] for obj in room.objects if obj.walkable]))


def _soup(triangles_m: list[np.ndarray]) -> TriMesh:
    corners_m = np.concatenate([*triangles_m, np.zeros((0, 3, 3))]).reshape(-1, 3)
    return TriMesh(corners_m, np.arange(len(corners_m), dtype=np.int32).reshape(-1, 3))


def sampled_vertices(actor: ActorMesh, count: int) -> Int64[np.ndarray, " K"]:
    """About ``count`` vertices, spread over all parts."""
    vertices = actor.vertices_m.shape[1]
    return np.unique(np.linspace(0, vertices - 1, min(count, vertices)).astype(np.int64))


@dataclass(frozen=True)
class Probe:
    """Vertices of an actor that are checked, and for each the bone it belongs to and where along it (0 to 1)."""

    vertices: Int64[np.ndarray, " P"]
    bone_of: Int64[np.ndarray, " P"]
    fraction_of: Float64[np.ndarray, " P"]

    def skin_m(self, actor: ActorMesh, frames: Int64[np.ndarray, " K"]) -> Float64[np.ndarray, "K P 3"]:
        """Places of the vertices."""
        return actor.vertices_m[np.ix_(frames, self.vertices)].astype(np.float64)

    def anchors_m(
        self, joint_m: Float64[np.ndarray, "T 22 3"], frames: Int64[np.ndarray, " K"]
    ) -> Float64[np.ndarray, "K P 3"]:
        """Places on the bones."""
        start_m, end_m = _bone_ends_m(joint_m, frames)
        return start_m[:, self.bone_of] + self.fraction_of[None, :, None] * (end_m - start_m)[:, self.bone_of]


def make_probe(
    actor: ActorMesh, joint_m: Float64[np.ndarray, "T 22 3"], frames: Int64[np.ndarray, " K"], count: int
) -> Probe:
    """About ``count`` vertices of an actor with the bone that each keeps closest to; ``joint_m`` is for all frames."""
    vertices = sampled_vertices(actor, count)
    few = frames[np.unique(np.linspace(0, len(frames) - 1, 8).astype(np.int64))]
    bone_of, fraction_of = _closest_bones(actor.vertices_m[np.ix_(few, vertices)].astype(np.float64), joint_m[few])
    return Probe(vertices, bone_of, fraction_of)


def scene_depth(
    actor: ActorMesh,
    joint_m: Float64[np.ndarray, "T 22 3"],
    probe: Probe,
    obstacles: Obstacles,
    frames: Int64[np.ndarray, " K"],
) -> Worst:
    """The deepest of an actor's vertices in an obstacle, over ``frames``; ``joint_m`` is for all frames."""
    vertices_m = probe.skin_m(actor, frames)
    start_m, end_m = _bone_ends_m(joint_m, frames)
    skin = _crossings(obstacles.caster, probe.anchors_m(joint_m, frames), vertices_m)
    bones = _crossings(obstacles.caster, start_m, end_m)
    depth_m = [_behind_m(skin, vertices_m[skin.row, skin.column])]
    face, row = [skin.face], [skin.row]
    for crossing in range(len(bones.row)):
        # All that hangs on the far end of the bone is on the wrong side too, though no surface parts it from its bone.
        hanging = np.isin(probe.bone_of, _bones_from(int(bones.column[crossing])))
        one = bones.only(crossing)
        beyond_m = np.concatenate([vertices_m[one.row[0], hanging], end_m[one.row, one.column]])
        depth_m.append(_behind_m(one, beyond_m).max(keepdims=True))
        face.append(one.face)
        row.append(one.row)
    return _deepest(np.concatenate(depth_m), np.concatenate(face), frames[np.concatenate(row)], obstacles)


def overlap_m(
    actor: ActorMesh, joint_m: Float64[np.ndarray, "T 22 3"], probe: Probe, other: ActorMesh, frame: int
) -> float:
    """How deep an actor's vertices are in another actor at a frame; 0 where they are not."""
    frames = np.array([frame])
    skin_m = probe.skin_m(actor, frames)
    surface = Caster(TriMesh(other.vertices_m[frame].astype(np.float64), other.faces))
    crossings = _crossings(surface, probe.anchors_m(joint_m, frames), skin_m)
    return float(_behind_m(crossings, skin_m[crossings.row, crossings.column]).max(initial=0.0))


def bones_ending_at(joints: tuple[str, ...]) -> list[int]:
    """Indices of the bones that lead to some joints, as in ``Probe.bone_of``; a hand belongs to its wrist's."""
    wanted = {BODY_JOINTS.index(name) for name in joints}
    return [index for index, (_, joint) in enumerate(_BONES) if joint in wanted]


def _bone_ends_m(
    joint_m: Float64[np.ndarray, "T 22 3"], frames: Int64[np.ndarray, " K"]
) -> tuple[Float64[np.ndarray, "K B 3"], Float64[np.ndarray, "K B 3"]]:
    parents, joints = np.array(_BONES).T
    return joint_m[np.ix_(frames, parents)], joint_m[np.ix_(frames, joints)]


def _deepest(
    depth_m: Float64[np.ndarray, " N"],
    face: Int64[np.ndarray, " N"],
    frame: Int64[np.ndarray, " N"],
    obstacles: Obstacles,
) -> Worst:
    if len(depth_m) == 0:
        return Worst(0.0, 0, "nothing")
    deepest = int(depth_m.argmax())
    name = obstacles.object_names[obstacles.object_of_face[face[deepest]]]
    return Worst(float(depth_m[deepest]), int(frame[deepest]), f"'{name}'")


def _closest_bones(
    vertices_m: Float64[np.ndarray, "K P 3"], joint_m: Float64[np.ndarray, "K 22 3"]
) -> tuple[Int64[np.ndarray, " P"], Float64[np.ndarray, " P"]]:
    """For each vertex the bone that it keeps closest to over some frames, and where along it (0 to 1)."""
    best_m = np.full(vertices_m.shape[1], np.inf)
    bone_of = np.zeros(vertices_m.shape[1], np.int64)
    fraction_of = np.zeros(vertices_m.shape[1])
    for index, (parent, joint) in enumerate(_BONES):
        start_m, along_m = joint_m[:, None, parent], (joint_m[:, joint] - joint_m[:, parent])[:, None]
        fraction = np.sum((vertices_m - start_m) * along_m, axis=2) / np.maximum(np.sum(along_m**2, axis=2), 1e-12)
        fraction = np.clip(fraction, 0.0, 1.0)
        # A hand may hang beside a thigh at one frame: only what is never far belongs together.
        away_m = np.linalg.norm(vertices_m - start_m - fraction[..., None] * along_m, axis=2).max(axis=0)
        closer = away_m < best_m
        best_m[closer], bone_of[closer], fraction_of[closer] = away_m[closer], index, fraction.mean(axis=0)[closer]
    return bone_of, fraction_of


@dataclass(frozen=True)
class _Crossings:
    """Segments (row: frame, column: which) that a surface cuts: where, its face, and its normal away from inside."""

    row: Int64[np.ndarray, " N"]
    column: Int64[np.ndarray, " N"]
    face: Int64[np.ndarray, " N"]
    place_m: Float64[np.ndarray, "N 3"]
    normal: Float64[np.ndarray, "N 3"]

    def only(self, index: int) -> "_Crossings":
        """One of them."""
        one = slice(index, index + 1)
        return _Crossings(self.row[one], self.column[one], self.face[one], self.place_m[one], self.normal[one])


def _bones_from(bone: int) -> list[int]:
    """Indices of a bone and of all that hang on its far end."""
    joints = {_BONES[bone][1]}
    bones = [bone]
    for index, (parent, joint) in enumerate(_BONES):
        if parent in joints:
            joints.add(joint)
            bones.append(index)
    return bones


def _crossings(
    obstacles: Caster, inside_m: Float64[np.ndarray, "K P 3"], outside_m: Float64[np.ndarray, "K P 3"]
) -> _Crossings:
    offset_m = (outside_m - inside_m).reshape(-1, 3)
    length_m = np.linalg.norm(offset_m, axis=1)
    direction = np.where(length_m[:, None] > 1e-9, offset_m, [0.0, 0.0, 1.0])
    hits = obstacles.first_hit(inside_m.reshape(-1, 3), direction)
    cut = np.flatnonzero(hits.hit & (hits.distance_m < length_m))
    corners_m = obstacles.mesh.vertices_m[obstacles.mesh.faces[hits.face[cut]]]
    normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    normal *= np.where(np.sum(normal * offset_m[cut], axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    row, column = np.divmod(cut, inside_m.shape[1])
    fraction = hits.distance_m[cut] / np.maximum(length_m[cut], 1e-9)
    place_m = inside_m.reshape(-1, 3)[cut] + fraction[:, None] * offset_m[cut]
    return _Crossings(row, column, hits.face[cut].astype(np.int64), place_m, normal)


def _behind_m(crossings: _Crossings, point_m: Float64[np.ndarray, "M 3"]) -> Float64[np.ndarray, " M"]:
    """How far points lie behind the surfaces, one each or all behind one."""
    return np.asarray(np.sum((point_m - crossings.place_m) * crossings.normal, axis=1))
