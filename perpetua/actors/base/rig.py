"""The body's joints, its T-pose, and linear blend skinning, in numpy.

MakeHuman's rest pose has lowered arms, bent elbows and spread legs. Each joint gets one fixed rotation that takes its
bones from there to the T-pose of ``BodyMotion``, so that a motion's rotations apply to the T-pose.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float32, Float64
from scipy import sparse
from scipy.spatial.transform import Rotation

from perpetua.actors.base.base_mesh import VERTEX_COUNT, bone_weights, rig
from perpetua.actors.base.hands import FINGER_JOINTS, flat_direction, makehuman_bone, parent_of, relaxed_fingers
from perpetua.scene.actor import BODY_JOINTS, BODY_PARENTS, BodyMotion

BODY_COUNT = len(BODY_JOINTS)
RIG_JOINTS = (*BODY_JOINTS, *FINGER_JOINTS)
JOINT_COUNT = len(RIG_JOINTS)
# Beyond the joints: the lower half of each forearm, which takes half of the hand's twist.
TWISTS = ("left_forearm", "right_forearm")
BONE_COUNT = JOINT_COUNT + len(TWISTS)
_INDEX = {name: index for index, name in enumerate((*RIG_JOINTS, *TWISTS))}
_PARENTS = (*BODY_PARENTS, *(_INDEX[parent_of(joint)] for joint in FINGER_JOINTS))

# MakeHuman's bones of each of our joints; the first one's head is the joint. Bones not listed follow their parent.
_CENTRE_BONES = {
    "pelvis": ("spine05", "root", "pelvis.L", "pelvis.R"),
    "spine1": ("spine04", "spine03"),
    "spine2": ("spine02",),
    "spine3": ("spine01", "breast.L", "breast.R"),
    "neck": ("neck01", "neck02", "neck03"),
    "head": ("head",),
}
_SIDE_BONES = {
    "hip": ("upperleg01", "upperleg02"),
    "knee": ("lowerleg01", "lowerleg02"),
    "ankle": ("foot",),
    "foot": ("toe2-1", "toe1-1", "toe3-1", "toe4-1", "toe5-1"),
    "collar": ("clavicle", "shoulder01"),
    "shoulder": ("upperarm01", "upperarm02"),
    "elbow": ("lowerarm01",),
    "wrist": ("wrist",),
    "forearm": ("lowerarm02",),
}


def joint_index(name: str) -> int:
    """Column of a joint or twist bone in skinning weights."""
    return _INDEX[name]


def _bones_of_joints() -> dict[str, tuple[str, ...]]:
    sides = {
        f"{word}_{joint}": tuple(f"{bone}.{letter}" for bone in bones)
        for word, letter in (("left", "L"), ("right", "R"))
        for joint, bones in _SIDE_BONES.items()
    }
    return {**_CENTRE_BONES, **sides, **{joint: (makehuman_bone(joint),) for joint in FINGER_JOINTS}}


@lru_cache(maxsize=1)
def base_weights() -> Float64[np.ndarray, "P 54"]:
    """Skinning weights of the base mesh's vertices for our joints and twist bones; rows sum to 1."""
    joint_of_bone = {bone: _INDEX[joint] for joint, bones in _bones_of_joints().items() for bone in bones}
    parents = {bone.name: bone.parent for bone in rig()}
    weights = np.zeros((VERTEX_COUNT, BONE_COUNT))
    for bone, (vertices, values) in bone_weights().items():
        owner = bone
        while owner not in joint_of_bone:
            owner = parents[owner]
        np.add.at(weights[:, joint_of_bone[owner]], vertices, values)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def bone_heads(vertices_m: Float64[np.ndarray, "P 3"]) -> Mapping[str, Float64[np.ndarray, "3"]]:
    """Where MakeHuman's bones start in a shaped body."""
    return {bone.name: vertices_m[list(bone.head_vertices)].mean(axis=0) for bone in rig()}


def rest_joints(vertices_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, "52 3"]:
    """Our joints in a shaped body's MakeHuman rest pose."""
    heads = bone_heads(vertices_m)
    bones = _bones_of_joints()
    joints = np.stack([heads[bones[name][0]] for name in RIG_JOINTS])
    for side, letter in (("left", "L"), ("right", "R")):
        joints[_INDEX[f"{side}_foot"]] = 0.5 * (heads[f"toe2-1.{letter}"] + heads[f"toe3-1.{letter}"])
    return joints


def rotation_between(start: Float64[np.ndarray, "3"], end: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "3 3"]:
    """The smallest rotation that turns one direction into another that is not its opposite."""
    return np.asarray(Rotation.align_vectors(end, start)[0].as_matrix())


def _frame(forward: Float64[np.ndarray, "3"], up: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "3 3"]:
    x = forward / np.linalg.norm(forward)
    y = np.cross(up, x)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


@dataclass(frozen=True)
class BoundRig:
    """A body's joints at rest and in the T-pose; ``tpose_from_rest`` is each joint's rotation between the two."""

    rest_joint_m: Float64[np.ndarray, "52 3"]
    tpose_joint_m: Float64[np.ndarray, "52 3"]
    tpose_from_rest: Float64[np.ndarray, "52 3 3"]


def bind(vertices_m: Float64[np.ndarray, "P 3"]) -> BoundRig:
    """The rig of a shaped body. The T-pose's pelvis stays where it is at rest; arms are level, legs are vertical."""
    rest_m = rest_joints(vertices_m)
    rotation = np.tile(np.eye(3), (JOINT_COUNT, 1, 1))
    heads = bone_heads(vertices_m)
    for side, letter, sign in (("left", "L", 1.0), ("right", "R", -1.0)):
        out, down = np.array([0.0, sign, 0.0]), np.array([0.0, 0.0, -1.0])
        chains = (("shoulder", "elbow", out), ("elbow", "wrist", out), ("hip", "knee", down), ("knee", "ankle", down))
        for start, end, direction in chains:
            first, second = _INDEX[f"{side}_{start}"], _INDEX[f"{side}_{end}"]
            rotation[first] = rotation_between(rest_m[second] - rest_m[first], direction)
        fingers = heads[f"finger3-1.{letter}"] - rest_m[_INDEX[f"{side}_wrist"]]
        across = heads[f"finger2-1.{letter}"] - heads[f"finger5-1.{letter}"]
        back_of_hand = np.cross(across, fingers) * sign
        level = _frame(out, np.array([0.0, 0.0, 1.0]))
        rotation[_INDEX[f"{side}_wrist"]] = level @ _frame(fingers, back_of_hand).T
    for finger in FINGER_JOINTS:
        rotation[_INDEX[finger]] = _flattening(finger, rotation, rest_m)
    tpose_m = rest_m.copy()
    for joint, parent in enumerate(_PARENTS):
        if parent >= 0:
            tpose_m[joint] = tpose_m[parent] + rotation[parent] @ (rest_m[joint] - rest_m[parent])
    return BoundRig(rest_m, tpose_m, rotation)


def _flattening(
    joint: str, rotation: Float64[np.ndarray, "52 3 3"], rest_m: Float64[np.ndarray, "52 3"]
) -> Float64[np.ndarray, "3 3"]:
    """The rotation of a finger's segment from rest to the flat hand of the T-pose; a tip turns like what carries it."""
    if joint.endswith("3"):
        return rotation[_INDEX[parent_of(joint)]]
    wrist = rotation[_INDEX[f"{joint.split('_')[0]}_wrist"]]
    following = f"{joint[:-1]}{int(joint[-1]) + 1}"
    bone = wrist @ (rest_m[_INDEX[following]] - rest_m[_INDEX[joint]])
    direction = bone / np.linalg.norm(bone)
    return np.asarray(rotation_between(direction, flat_direction(joint, direction)) @ wrist)


def _half_twist(
    world_from_upper: Float64[np.ndarray, "T 3 3"],
    world_from_lower: Float64[np.ndarray, "T 3 3"],
    axis: Float64[np.ndarray, "3"],
) -> Float64[np.ndarray, "T 3 3"]:
    """The upper bone's rotation with half of the lower one's twist about the upper bone's rest ``axis``."""
    relative = Rotation.from_matrix(np.swapaxes(world_from_upper, 1, 2) @ world_from_lower).as_quat(canonical=True)
    # The twist's half angle is that of the quaternion's part along the axis: (v.axis, w).
    half_angle = np.arctan2(relative[:, :3] @ axis, relative[:, 3])
    return np.asarray(world_from_upper @ Rotation.from_rotvec(half_angle[:, None] * axis).as_matrix())


def world_rotations(motion: BodyMotion) -> Float64[np.ndarray, "T 52 3 3"]:
    """Global rotations of all joints, fingers included."""
    frames = len(motion.pelvis_m)
    rotation = np.empty((frames, JOINT_COUNT, 3, 3))
    rotation[:, :BODY_COUNT] = motion.world_from_joint
    fingers = motion.finger_from_parent
    local = np.broadcast_to(relaxed_fingers(), (frames, len(FINGER_JOINTS), 3, 3)) if fingers is None else fingers
    for finger, joint in enumerate(range(BODY_COUNT, JOINT_COUNT)):
        rotation[:, joint] = rotation[:, _PARENTS[joint]] @ local[:, finger]
    return rotation


def bone_transforms(
    bound: BoundRig, motion: BodyMotion
) -> tuple[Float64[np.ndarray, "T 54 3 3"], Float64[np.ndarray, "T 54 3"]]:
    """Rotation and translation that take rest-pose points of each bone to the world."""
    frames = len(motion.pelvis_m)
    world_from_joint = world_rotations(motion)
    rotation = np.empty((frames, BONE_COUNT, 3, 3))
    rotation[:, :JOINT_COUNT] = world_from_joint @ bound.tpose_from_rest
    joint_m = world_joints(bound, world_from_joint, motion.pelvis_m)
    rest_m = np.concatenate([bound.rest_joint_m, np.zeros((2, 3))])
    place_m = np.concatenate([joint_m, np.zeros((frames, 2, 3))], axis=1)
    for side in ("left", "right"):
        elbow, wrist, twist = _INDEX[f"{side}_elbow"], _INDEX[f"{side}_wrist"], _INDEX[f"{side}_forearm"]
        axis = bound.rest_joint_m[wrist] - bound.rest_joint_m[elbow]
        rotation[:, twist] = _half_twist(rotation[:, elbow], rotation[:, wrist], axis / np.linalg.norm(axis))
        rest_m[twist], place_m[:, twist] = bound.rest_joint_m[elbow], joint_m[:, elbow]
    translation = place_m - np.einsum("tjab,jb->tja", rotation, rest_m)
    return rotation, translation


def world_joints(
    bound: BoundRig, world_from_joint: Float64[np.ndarray, "T 52 3 3"], pelvis_m: Float64[np.ndarray, "T 3"]
) -> Float64[np.ndarray, "T 52 3"]:
    """Where the joints are, by forward kinematics from the T-pose."""
    joint_m = np.empty((len(pelvis_m), JOINT_COUNT, 3))
    joint_m[:, 0] = pelvis_m
    for joint, parent in enumerate(_PARENTS):
        if parent >= 0:
            offset = bound.tpose_joint_m[joint] - bound.tpose_joint_m[parent]
            joint_m[:, joint] = joint_m[:, parent] + world_from_joint[:, parent] @ offset
    return joint_m


def skin(
    bound: BoundRig,
    vertices_m: Float64[np.ndarray, "P 3"],
    weights: Float64[np.ndarray, "P 54"],
    motion: BodyMotion,
) -> Float32[np.ndarray, "T P 3"]:
    """Linear blend skinning of rest-pose vertices."""
    homogeneous = np.concatenate([vertices_m, np.ones((len(vertices_m), 1))], axis=1)
    rotation, translation = bone_transforms(bound, motion)
    affine = np.concatenate([rotation, translation[..., None]], axis=3)
    posed = np.empty((len(affine), len(vertices_m), 3), dtype=np.float32)
    few = sparse.csr_matrix(weights)
    # Frame by frame: memory stays small, and a frame's bits do not depend on how many others there are.
    for frame, bones in enumerate(affine):
        blended = (few @ bones.reshape(BONE_COUNT, 12)).reshape(-1, 3, 4)
        posed[frame] = np.einsum("pab,pb->pa", blended, homogeneous)
    return posed
