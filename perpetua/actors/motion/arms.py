"""Arms that swing against the legs, or hold a hand where an action wants it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.actors.motion.actions import HandReach, Vector
from perpetua.actors.motion.kinematics import bone, solve_two_bones
from perpetua.actors.motion.rotations import about_x, about_y, about_z, rotate
from perpetua.actors.types import Skeleton

_MIRROR = np.diag([1.0, -1.0, 1.0])
_HANGING_TWIST_RAD = 0.12
# Palms of hanging arms turn a little to the back, half of it in the forearm and half at the wrist.
_PRONATION_RAD = 0.2


@dataclass(frozen=True)
class ArmRotations:
    """Global rotations of one arm's joints."""

    collar: Float64[np.ndarray, "N 3 3"]
    shoulder: Float64[np.ndarray, "N 3 3"]
    elbow: Float64[np.ndarray, "N 3 3"]
    wrist: Float64[np.ndarray, "N 3 3"]


def hanging_arm(
    side: str,
    world_from_chest: Float64[np.ndarray, "N 3 3"],
    forward_rad: Float64[np.ndarray, " N"],
    abduction_rad: float,
    elbow_rad: float,
) -> ArmRotations:
    """An arm that hangs from the shoulder, ``forward_rad`` ahead of the chest's down; the elbow bends more in front."""
    count = len(forward_rad)
    drop_rad = np.full(count, abduction_rad - 0.5 * np.pi)
    # The collar takes a little of the drop, as it does when arms come down from a T-pose.
    collar = about_x(0.08 * drop_rad)
    shoulder = about_y(-forward_rad) @ about_x(0.92 * drop_rad) @ about_y(np.full(count, _HANGING_TWIST_RAD))
    bend_rad = np.clip(elbow_rad + 0.4 * np.maximum(forward_rad, -0.2), 0.08, 1.2)
    elbow = about_z(-bend_rad) @ about_y(np.full(count, _PRONATION_RAD))
    wrist = about_z(np.full(count, -0.12)) @ about_x(np.full(count, -0.16)) @ about_y(np.full(count, _PRONATION_RAD))
    if side == "right":
        collar, shoulder, elbow, wrist = (_mirrored(part) for part in (collar, shoulder, elbow, wrist))
    world_from_collar = world_from_chest @ collar
    world_from_shoulder = world_from_collar @ shoulder
    world_from_elbow = world_from_shoulder @ elbow
    return ArmRotations(world_from_collar, world_from_shoulder, world_from_elbow, world_from_elbow @ wrist)


def reaching_arm(
    side: str,
    skeleton: Skeleton,
    world_from_chest: Float64[np.ndarray, "N 3 3"],
    reach: HandReach,
    sway: Float64[np.ndarray, "N 3"],
    time_s: Float64[np.ndarray, " N"],
) -> ArmRotations:
    """An arm whose wrist is held at ``reach``; ``sway`` (forward, outward, up; lengths of the arm) is added."""
    upper_m, lower_m = (
        bone(skeleton, f"{side}_shoulder", f"{side}_elbow"),
        bone(skeleton, f"{side}_elbow", f"{side}_wrist"),
    )
    length_m = float(np.linalg.norm(upper_m) + np.linalg.norm(lower_m))
    outward = np.array([1.0, 1.0 if side == "left" else -1.0, 1.0])
    beat = np.sin(2.0 * np.pi * reach.swing_hz * time_s)[:, None] * np.array(reach.swing)
    wrist = (np.array(reach.wrist) + beat + sway) * outward * length_m
    shoulder_m = np.zeros_like(wrist)
    bones = solve_two_bones(
        shoulder_m,
        np.einsum("nij,nj->ni", world_from_chest, wrist),
        rotate(world_from_chest, _vector(reach.elbow_towards) * outward),
        upper_m,
        lower_m,
        np.array([-1.0, 0.0, 0.0]),
    )
    # The forearm turns along its whole length: half of the roll shows between elbow and wrist.
    half = about_y(np.full(len(time_s), 0.5 * reach.roll_rad))
    elbow = bones.world_from_lower @ half
    return ArmRotations(world_from_chest, bones.world_from_upper, elbow, elbow @ half)


def _vector(values: Vector) -> Float64[np.ndarray, "3"]:
    return np.array(values, np.float64)


def _mirrored(rotation: Float64[np.ndarray, "N 3 3"]) -> Float64[np.ndarray, "N 3 3"]:
    return np.asarray(_MIRROR @ rotation @ _MIRROR)
