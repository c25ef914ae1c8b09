"""Arms drawn in where they would touch furniture, walls or other people.

Arms are tubes around their bones here, other people too. Where a tube comes too near, the arm goes over, in good time
and no farther than it has to, to one of a few ways of keeping it close to the body, and comes back when it can.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float64, Int64
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from perpetua.geometry.raycast import Caster
from perpetua.motion.arms import Arm, hanging_arm, reaching_arm
from perpetua.motion.kinematics import bone, joint_index, joint_positions
from perpetua.motion.vocabulary import HandPose
from perpetua.scene.actor import BODY_PARENTS, BodyMotion, Skeleton
from perpetua.scene.room import Room

# Half the thickness of an arm at its elbow, wrist and hand, and what it keeps away besides.
_ELBOW_M, _WRIST_M, _HAND_M, _MARGIN_M = 0.062, 0.05, 0.055, 0.02
# How far the fingertips are beyond the wrist, lengths of the forearm.
_HAND_LENGTH = 0.72
# Half the thickness of other people around each of their joints' bones; trunks are wider than deep.
_TRUNK_M, _LIMB_M, _HEAD_M = 0.19, 0.085, 0.13
# Arms begin to be drawn in so early, and stay in between two narrow places that are this close.
_AHEAD_S, _BETWEEN_S = 0.45, 0.8
# A point that is farther from everything than this is not looked at more closely.
_FAR_M = 0.12
# What a surface between the shoulder and the hand counts as, metres.
_THROUGH_M = 0.3
_WEIGHTS = (0.4, 0.7, 1.0)
_CHAIN = ("collar", "shoulder", "elbow", "wrist")
_AT_BELLY = HandPose((0.34, -0.22, -0.60), (-0.5, 0.35, -1.0), (-1.0, -0.3, 0.0))
_AT_CHEST = HandPose((0.28, -0.24, -0.30), (-0.3, 0.25, -1.0), (-1.0, -0.3, 0.0))
_BEHIND = HandPose((-0.36, -0.24, -0.80), (-0.6, 0.6, 0.1), (-1.0, 0.0, 0.0))


@dataclass(frozen=True)
class _Tubes:
    """Bones with half their thickness, over time."""

    start_m: Float64[np.ndarray, "T B 3"]
    end_m: Float64[np.ndarray, "T B 3"]
    radius_m: Float64[np.ndarray, " B"]


@dataclass(frozen=True)
class _Surroundings:
    """What the arms of one actor keep off."""

    scene: Caster
    others: tuple[_Tubes, ...]


def clear_arms(motions: tuple[BodyMotion, ...], skeletons: tuple[Skeleton, ...], room: Room) -> tuple[BodyMotion, ...]:
    """The motions of all actors of a room with their arms kept off the room and each other.

    Args:
        motions: one per actor, over the same frames.
        skeletons: their bones.
        room: what stands around them.
    """
    scene = room.obstacles.caster
    cleared = list(motions)
    for index, skeleton in enumerate(skeletons):
        others = tuple(_tubes(other, skeletons[place]) for place, other in enumerate(cleared) if place != index)
        for side in ("left", "right"):
            cleared[index] = _clear_arm(cleared[index], skeleton, side, _Surroundings(scene, others))
    return tuple(cleared)


def _tubes(motion: BodyMotion, skeleton: Skeleton) -> _Tubes:
    joint_m = joint_positions(motion, skeleton)
    joints = [joint for joint, parent in enumerate(BODY_PARENTS) if parent >= 0]
    parents = [BODY_PARENTS[joint] for joint in joints]
    trunk = {joint_index(name) for name in ("spine1", "spine2", "spine3", "neck", "left_collar", "right_collar")}
    trunk |= {joint_index(name) for name in ("left_hip", "right_hip", "left_shoulder", "right_shoulder")}
    radius_m = [_TRUNK_M if joint in trunk else _LIMB_M for joint in joints]
    radius_m[joints.index(joint_index("head"))] = _HEAD_M
    return _Tubes(joint_m[:, parents], joint_m[:, joints], np.array(radius_m))


def _clear_arm(motion: BodyMotion, skeleton: Skeleton, side: str, surroundings: _Surroundings) -> BodyMotion:
    intrusion_m = _intrusion_m(motion, skeleton, side, surroundings)
    if not (intrusion_m > 0.0).any():
        return motion
    arm = _relative(motion, side)
    ways = [
        hanging_arm(side, np.full(len(intrusion_m), 0.03), 0.03, np.full(len(intrusion_m), 0.12)),
        *(_held(side, skeleton, pose, len(intrusion_m)) for pose in (_AT_BELLY, _AT_CHEST, _BEHIND)),
    ]
    drawn_in = [_with_arm(motion, side, way) for way in ways]
    left_m = np.stack([_intrusion_m(other, skeleton, side, surroundings) for other in drawn_in])
    weight = np.zeros((len(ways), len(intrusion_m)))
    for frames in _narrow_places(intrusion_m > 0.0, motion.fps):
        way = int(np.maximum(left_m[:, frames], 0.0).max(axis=1).round(3).argmin())
        if left_m[way, frames].max() < intrusion_m[frames].max() - 1e-3:
            weight[way, frames] = 1.0
    window = max(1, round(_AHEAD_S * motion.fps))
    for way, other in enumerate(ways):
        if weight[way].any():
            wide = maximum_filter1d(weight[way], 2 * window + 1, mode="nearest")
            soft = np.clip(gaussian_filter1d(wide, 0.45 * window, radius=window, mode="nearest"), 0.0, 1.0)
            arm = arm.blended(other, _least_weight(motion, skeleton, side, surroundings, arm, other, soft))
    return _with_arm(motion, side, arm)


def _least_weight(
    motion: BodyMotion,
    skeleton: Skeleton,
    side: str,
    surroundings: _Surroundings,
    arm: Arm,
    way: Arm,
    weight: Float64[np.ndarray, " T"],
) -> Float64[np.ndarray, " T"]:
    """The smallest of a few fractions of a change that helps as much as all of it."""

    def left_m(part: float) -> float:
        moved = _with_arm(motion, side, arm.blended(way, part * weight))
        return float(_intrusion_m(moved, skeleton, side, surroundings).max())

    intrusions_m = [left_m(part) for part in _WEIGHTS]
    enough_m = max(min(intrusions_m), 0.0) + 1e-3
    return next(part for part, left in zip(_WEIGHTS, intrusions_m, strict=True) if left <= enough_m) * weight


def _narrow_places(narrow: Bool[np.ndarray, " T"], fps: float) -> list[Int64[np.ndarray, " K"]]:
    """Frames of each place where an arm is in trouble; places close to each other are one."""
    frames = np.flatnonzero(narrow)
    return np.split(frames, np.flatnonzero(np.diff(frames) > _BETWEEN_S * fps) + 1)


def _held(side: str, skeleton: Skeleton, pose: HandPose, count: int) -> Arm:
    return reaching_arm(side, skeleton, pose, np.tile(np.array(pose.wrist), (count, 1)), np.zeros(count))


def _relative(motion: BodyMotion, side: str) -> Arm:
    """An arm's rotations relative to their parents."""
    world = motion.world_from_joint
    chain = [joint_index(name) for name in ("spine3", *(f"{side}_{part}" for part in _CHAIN))]
    return Arm(*(np.swapaxes(world[:, parent], 1, 2) @ world[:, joint] for parent, joint in pairwise(chain)))


def _with_arm(motion: BodyMotion, side: str, arm: Arm) -> BodyMotion:
    world = motion.world_from_joint.copy()
    parent = world[:, joint_index("spine3")]
    for part in _CHAIN:
        parent = parent @ getattr(arm, part)
        world[:, joint_index(f"{side}_{part}")] = parent
    return replace(motion, world_from_joint=world)


def _intrusion_m(
    motion: BodyMotion, skeleton: Skeleton, side: str, surroundings: _Surroundings
) -> Float64[np.ndarray, " T"]:
    """How much an arm is too near to anything at each frame, metres; not above 0 where it is clear."""
    joint_m = joint_positions(motion, skeleton)
    shoulder_m, elbow_m, wrist_m = (
        joint_m[:, joint_index(f"{side}_{name}")] for name in ("shoulder", "elbow", "wrist")
    )
    forearm_m = bone(skeleton, f"{side}_elbow", f"{side}_wrist")
    tip_m = wrist_m + _HAND_LENGTH * motion.world_from_joint[:, joint_index(f"{side}_wrist")] @ forearm_m
    line_m = [0.5 * (shoulder_m + elbow_m), elbow_m, 0.5 * (elbow_m + wrist_m), wrist_m, 0.5 * (wrist_m + tip_m), tip_m]
    radius_m = np.array([_ELBOW_M, _ELBOW_M, _ELBOW_M, _WRIST_M, _HAND_M, 0.4 * _HAND_M])
    points_m = np.stack(line_m, axis=1)
    away_m = surroundings.scene.closest_distance(points_m.reshape(-1, 3), _FAR_M).reshape(points_m.shape[:2])
    intrusion_m = (radius_m + _MARGIN_M - away_m).max(axis=1)
    starts_m = np.stack([shoulder_m, elbow_m, wrist_m], axis=1).reshape(-1, 3)
    ends_m = np.stack([elbow_m, wrist_m, tip_m], axis=1).reshape(-1, 3)
    through = ~surroundings.scene.clear(starts_m, ends_m).reshape(-1, 3).all(axis=1)
    intrusion_m = np.where(through, np.maximum(intrusion_m, _THROUGH_M), intrusion_m)
    for other in surroundings.others:
        intrusion_m = np.maximum(intrusion_m, _overlap_m(points_m, radius_m, other))
    return np.asarray(intrusion_m)


def _overlap_m(
    points_m: Float64[np.ndarray, "T M 3"], radius_m: Float64[np.ndarray, " M"], tubes: _Tubes
) -> Float64[np.ndarray, " T"]:
    along_m = (tubes.end_m - tubes.start_m)[:, None]
    offset_m = points_m[:, :, None] - tubes.start_m[:, None]
    fraction = np.sum(offset_m * along_m, axis=3) / np.maximum(np.sum(along_m**2, axis=3), 1e-12)
    away_m = np.linalg.norm(offset_m - np.clip(fraction, 0.0, 1.0)[..., None] * along_m, axis=3)
    return np.asarray((radius_m[:, None] + tubes.radius_m + _MARGIN_M - away_m).max(axis=(1, 2)))
