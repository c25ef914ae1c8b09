"""Whether joints bend as people's do, and whether hands go into the trunk they belong to."""

import numpy as np
from jaxtyping import Bool, Float64, Int64
from scipy.spatial.transform import Rotation

from perpetua.actors.checks.penetration import Probe, Worst, bones_ending_at
from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.raycast import Caster
from perpetua.motion.kinematics import joint_index
from perpetua.scene.actor import ActorMesh, BodyMotion

# How far knees and elbows bend, and how far they give the other way, radians.
_MOST_KNEE_RAD, _MOST_ELBOW_RAD, _GIVE_RAD = 2.75, 2.75, 0.06
# How far the head turns against the chest, and the thigh against the pelvis.
_MOST_NECK_RAD, _MOST_HIP_RAD = 1.75, 2.45
# Axis about which a knee and an elbow bend, in the rest pose; left elbows bend the other way than right ones.
_KNEE_AXIS, _ELBOW_AXIS = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -1.0])
_TRUNK_JOINTS = ("spine1", "spine2", "spine3", "neck", "left_hip", "right_hip", "left_collar", "right_collar")
# A point is inside where the trunk is met, no farther than this, in nearly every level direction.
_DIRECTIONS, _ENCLOSING, _WIDTH_M = 12, 11, 0.4
_HAND_JOINTS = ("left_wrist", "right_wrist")


def joint_excess(motion: BodyMotion) -> tuple[float, int, str]:
    """By how many radians the worst joint is beyond what people can do (0: none), at which frame, and which."""
    worst = (0.0, 0, "nothing")
    for name, excess_rad in _excesses(motion):
        frame = int(excess_rad.argmax())
        if excess_rad[frame] > worst[0]:
            worst = (float(excess_rad[frame]), frame, name)
    return worst


def _excesses(motion: BodyMotion) -> list[tuple[str, Float64[np.ndarray, " T"]]]:
    found = []
    for side, sign in (("left", 1.0), ("right", -1.0)):
        knee_rad = _bend_rad(motion, f"{side}_hip", f"{side}_knee", _KNEE_AXIS)
        elbow_rad = _bend_rad(motion, f"{side}_shoulder", f"{side}_elbow", sign * _ELBOW_AXIS)
        hip_rad = _turn_rad(motion, "pelvis", f"{side}_hip")
        found += [
            (f"{side} knee", np.maximum(knee_rad - _MOST_KNEE_RAD, -knee_rad - _GIVE_RAD)),
            (f"{side} elbow", np.maximum(elbow_rad - _MOST_ELBOW_RAD, -elbow_rad - _GIVE_RAD)),
            (f"{side} hip", hip_rad - _MOST_HIP_RAD),
        ]
    return [*found, ("neck", _turn_rad(motion, "spine3", "head") - _MOST_NECK_RAD)]


def _relative(motion: BodyMotion, parent: str, joint: str) -> Rotation:
    world = motion.world_from_joint
    return Rotation.from_matrix(np.swapaxes(world[:, joint_index(parent)], 1, 2) @ world[:, joint_index(joint)])


def _turn_rad(motion: BodyMotion, parent: str, joint: str) -> Float64[np.ndarray, " T"]:
    return np.asarray(_relative(motion, parent, joint).magnitude())


def _bend_rad(motion: BodyMotion, parent: str, joint: str, axis: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, " T"]:
    """The part of a joint's rotation that is about one axis (its twist), signed."""
    quaternion = _relative(motion, parent, joint).as_quat()
    angle_rad = 2.0 * np.arctan2(quaternion[:, :3] @ axis, quaternion[:, 3])
    return np.asarray((angle_rad + np.pi) % (2.0 * np.pi) - np.pi)


def hands_in_trunk(actor: ActorMesh, probe: Probe, frames: Int64[np.ndarray, " K"]) -> Worst:
    """The deepest vertex of a hand in its owner's trunk; ``probe`` holds all vertices of the actor.

    A hand's vertex is inside where the trunk is met in nearly all level directions from it.
    """
    hands = np.flatnonzero(np.isin(probe.bone_of, bones_ending_at(_HAND_JOINTS)))[::4]
    trunk = np.isin(probe.bone_of, bones_ending_at(_TRUNK_JOINTS))
    faces = actor.faces[trunk[np.searchsorted(probe.vertices, actor.faces)].all(axis=1)]
    worst = Worst(0.0, 0, "nothing")
    for frame in frames:
        surface = Caster(TriMesh(actor.vertices_m[frame].astype(np.float64), faces))
        hand_m = actor.vertices_m[frame, probe.vertices[hands]].astype(np.float64)
        inside = _enclosed(surface, hand_m)
        if inside.any():
            depth_m = float(surface.closest_distance(hand_m[inside]).max())
            if depth_m > worst.value_m:
                worst = Worst(depth_m, int(frame), "its own trunk")
    return worst


def _enclosed(surface: Caster, points_m: Float64[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
    turns_rad = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    level = np.stack([np.cos(turns_rad), np.sin(turns_rad), np.zeros(_DIRECTIONS)], axis=1)
    origins_m, directions = np.repeat(points_m, _DIRECTIONS, axis=0), np.tile(level, (len(points_m), 1))
    met = surface.first_hit(origins_m, directions).distance_m.reshape(-1, _DIRECTIONS) < _WIDTH_M
    return np.asarray(met.sum(axis=1) >= _ENCLOSING)
