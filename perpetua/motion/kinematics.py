"""Where joints and sole points of a skeleton are, and the two-bone chain solved for its end."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.motion.rotations import frames_along, rotate
from perpetua.scene.actor import BODY_JOINTS, BODY_PARENTS, BodyMotion, Skeleton

CONTACT_JOINTS = ("left_ankle", "left_foot", "right_ankle", "right_foot")


def joint_index(name: str) -> int:
    """Index of a body joint in ``BODY_JOINTS``."""
    return BODY_JOINTS.index(name)


def bone(skeleton: Skeleton, start: str, end: str) -> Float64[np.ndarray, "3"]:
    """Vector in metres from one joint to another in the rest pose."""
    return skeleton.joint_m[joint_index(end)] - skeleton.joint_m[joint_index(start)]


def joint_positions(motion: BodyMotion, skeleton: Skeleton) -> Float64[np.ndarray, "T 22 3"]:
    """World positions in metres of all joints: each hangs on its parent's rotation."""
    position_m = np.empty((*motion.world_from_joint.shape[:2], 3))
    position_m[:, 0] = motion.pelvis_m
    for joint, parent in enumerate(BODY_PARENTS):
        if parent >= 0:
            offset_m = skeleton.joint_m[joint] - skeleton.joint_m[parent]
            position_m[:, joint] = position_m[:, parent] + rotate(motion.world_from_joint[:, parent], offset_m)
    return position_m


def contact_positions(motion: BodyMotion, skeleton: Skeleton) -> Float64[np.ndarray, "T 4 3"]:
    """World positions in metres of the sole points named by ``CONTACTS``."""
    joint_m = joint_positions(motion, skeleton)
    contact_m = np.empty((len(joint_m), 4, 3))
    for contact, name in enumerate(CONTACT_JOINTS):
        joint = joint_index(name)
        offset_m = skeleton.contact_m[contact] - skeleton.joint_m[joint]
        contact_m[:, contact] = joint_m[:, joint] + rotate(motion.world_from_joint[:, joint], offset_m)
    return contact_m


@dataclass(frozen=True)
class TwoBones:
    """A solved chain: world rotations of both bones, and its end, which falls short of a target out of reach."""

    world_from_upper: Float64[np.ndarray, "N 3 3"]
    world_from_lower: Float64[np.ndarray, "N 3 3"]
    end_m: Float64[np.ndarray, "N 3"]


def solve_two_bones(
    root_m: Float64[np.ndarray, "N 3"],
    target_m: Float64[np.ndarray, "N 3"],
    bend_towards: Float64[np.ndarray, "N 3"],
    upper_rest_m: Float64[np.ndarray, "3"],
    lower_rest_m: Float64[np.ndarray, "3"],
    bend_rest: Float64[np.ndarray, "3"],
) -> TwoBones:
    """Analytic inverse kinematics of a thigh and shin, or of an upper arm and forearm.

    Args:
        root_m: the hip or shoulder in the world.
        target_m: where the ankle or wrist has to be.
        bend_towards: world direction to which the knee or elbow stands out.
        upper_rest_m: the upper bone in the rest pose.
        lower_rest_m: the lower bone in the rest pose.
        bend_rest: direction in the rest pose to which the knee or elbow stands out.
    """
    upper_m, lower_m = float(np.linalg.norm(upper_rest_m)), float(np.linalg.norm(lower_rest_m))
    gap_m = target_m - root_m
    wanted_m = np.linalg.norm(gap_m, axis=1)
    reach_m = np.clip(wanted_m, abs(upper_m - lower_m) + 1e-6, upper_m + lower_m - 1e-9)
    plane = frames_along(gap_m, bend_towards)
    cosine = np.clip((upper_m**2 + reach_m**2 - lower_m**2) / (2 * upper_m * reach_m), -1.0, 1.0)
    sine = np.sqrt(1.0 - cosine**2)
    upper = upper_m * (cosine[:, None] * plane[:, :, 0] + sine[:, None] * plane[:, :, 1])
    end_m = root_m + reach_m[:, None] * plane[:, :, 0]
    lower = end_m - root_m - upper
    return TwoBones(
        _turn(upper_rest_m, bend_rest, upper, plane[:, :, 1]),
        _turn(lower_rest_m, bend_rest, lower, plane[:, :, 1]),
        end_m,
    )


def _turn(
    rest_m: Float64[np.ndarray, "3"],
    bend_rest: Float64[np.ndarray, "3"],
    posed_m: Float64[np.ndarray, "N 3"],
    bend_towards: Float64[np.ndarray, "N 3"],
) -> Float64[np.ndarray, "N 3 3"]:
    rest_frame = frames_along(rest_m[None], bend_rest[None])
    return np.asarray(frames_along(posed_m, bend_towards) @ np.swapaxes(rest_frame, 1, 2))
