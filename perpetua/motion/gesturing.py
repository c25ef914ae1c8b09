"""Both arms and hands over time: swinging with the legs, taken up by actions, at rest on the thighs of a sitter."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.motion.action_timeline import TimedAction
from perpetua.motion.arms import Arm, arm_length_m, hanging_arm, pose_wrist, reaching_arm
from perpetua.motion.hands import finger_rotations
from perpetua.motion.style import GaitStyle
from perpetua.motion.vocabulary import HandPose
from perpetua.scene.actor import Skeleton

_ON_THIGH = HandPose((0.4, 0.0, -0.6), (-0.4, 1.0, -0.2), (0.1, 0.0, -1.0), 0.1, "relaxed")
# The elbow of a jogger.
_JOG_BEND_RAD, _JOG_SWING = 1.6, 0.75
_HANGS = 1.0


@dataclass(frozen=True)
class Limbs:
    """What arms go along with, over time.

    ``lead_m`` is how far the foot of the other side is ahead, ``run`` goes from walking (0) to running (1), ``seated``
    from standing (0) to sitting (1); ``lean_rad`` is how far actions and a seat lean the trunk forward. ``thigh`` is
    where a wrist rests on the thigh and ``aim`` where the pointing wrist is, both from the shoulder in the chest's axes
    (forward, outward, up), lengths of the arm; ``aim_weight`` is 0 where there is nothing to point at.
    """

    lead_m: Float64[np.ndarray, " N"]
    run: Float64[np.ndarray, " N"]
    seated: Float64[np.ndarray, " N"]
    lean_rad: Float64[np.ndarray, " N"]
    thigh: Float64[np.ndarray, "N 3"]
    aim: Float64[np.ndarray, "N 3"]
    aim_weight: Float64[np.ndarray, " N"]


def make_arm(
    side: str,
    skeleton: Skeleton,
    style: GaitStyle,
    arm_swing: float,
    limbs: Limbs,
    timed: TimedAction | None,
    shrug_rad: Float64[np.ndarray, " N"],
) -> Arm:
    """One arm over time.

    Args:
        side: "left" or "right".
        skeleton: the bones.
        style: personal habits.
        arm_swing: how far arms swing, as a factor.
        limbs: what the arm goes along with.
        timed: the action that has this arm.
        shrug_rad: how far the shoulder is raised.
    """
    arm = _swinging(side, style, arm_swing, limbs)
    still = np.zeros(len(limbs.lead_m))
    if limbs.seated.any():
        resting = reaching_arm(side, skeleton, _ON_THIGH, limbs.thigh, still)
        arm = arm.blended(resting, limbs.seated**2)
    if timed is not None:
        arm = _posed(side, skeleton, arm, limbs, timed)
    return arm.shrugged(side, shrug_rad) if shrug_rad.any() else arm


def make_fingers(
    left: TimedAction | None, right: TimedAction | None, run: Float64[np.ndarray, " N"]
) -> Float64[np.ndarray, "N 30 3 3"]:
    """The fingers of both hands: relaxed, half a fist when running, or as actions shape them."""
    shapes, weights = [], []
    for timed, side in ((left, "left"), (right, "right")):
        pose = _pose(timed, side)
        if timed is None or pose is None or pose.fingers == "relaxed":
            shapes.append("fist")
            weights.append(0.5 * run)
        else:
            shapes.append(pose.fingers)
            weights.append(np.ones(len(run)) if timed.action.between is not None else timed.weight)
    return finger_rotations((shapes[0], shapes[1]), (weights[0], weights[1]))


def wrist_from(
    side: str,
    skeleton: Skeleton,
    place_m: Float64[np.ndarray, "N 3"],
    shoulder_m: Float64[np.ndarray, "N 3"],
    world_from_chest: Float64[np.ndarray, "N 3 3"],
) -> Float64[np.ndarray, "N 3"]:
    """World places as (forward, outward, up) from the shoulder in the chest's axes, lengths of the arm."""
    outward = np.array([1.0, 1.0 if side == "left" else -1.0, 1.0])
    away_m = np.einsum("nji,nj->ni", world_from_chest, place_m - shoulder_m)
    return np.asarray(away_m * outward / arm_length_m(skeleton, side))


def _pose(timed: TimedAction | None, side: str) -> HandPose | None:
    if timed is None:
        return None
    return timed.action.left if side == "left" else timed.action.right


def _swinging(side: str, style: GaitStyle, arm_swing: float, limbs: Limbs) -> Arm:
    swing_rad = arm_swing * style.arm_swing_rad_per_m * limbs.lead_m * (1.0 - (1.0 - _JOG_SWING) * limbs.run)
    # Arms hang down, not along a trunk that bows.
    forward_rad = swing_rad + 0.05 - 0.12 * limbs.run + _HANGS * np.maximum(limbs.lean_rad, 0.0)
    bend_rad = np.clip(style.elbow_rad + 0.4 * np.maximum(swing_rad, -0.2), 0.08, 1.2)
    bend_rad = bend_rad + limbs.run * (_JOG_BEND_RAD + 0.35 * swing_rad - bend_rad)
    return hanging_arm(side, forward_rad, style.arm_abduction_rad, bend_rad)


def _posed(side: str, skeleton: Skeleton, arm: Arm, limbs: Limbs, timed: TimedAction) -> Arm:
    pose = _pose(timed, side)
    if pose is None:
        return arm
    beat = timed.left_beat if side == "left" else timed.right_beat
    # A held hand still bobs a little with the steps.
    bob = np.stack([0.02 * limbs.lead_m, np.zeros_like(limbs.lead_m), 0.01 * limbs.lead_m**2], axis=1)
    if timed.action.between is not None:
        between = timed.action.between
        arm = reaching_arm(side, skeleton, between, pose_wrist(between, np.zeros_like(beat)) + bob, np.zeros_like(beat))
    weight, wrist = timed.weight, pose_wrist(pose, beat) + bob
    if timed.action.aims:
        weight, wrist = weight * limbs.aim_weight, limbs.aim + bob
    return arm.blended(reaching_arm(side, skeleton, pose, wrist, beat), weight)
