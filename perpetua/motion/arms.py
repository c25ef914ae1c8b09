"""Arms that swing against the legs, or hold a hand where an action wants it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.motion.kinematics import bone, solve_two_bones
from perpetua.motion.rotations import about_x, about_y, about_z, blend
from perpetua.motion.vocabulary import HandPose
from perpetua.scene.actor import Skeleton

_MIRROR = np.diag([1.0, -1.0, 1.0])
_HANGING_TWIST_RAD = 0.12
# Palms of hanging arms turn a little to the back, half of it in the forearm and half at the wrist.
_PRONATION_RAD = 0.2
# A forearm turns this far either way from the thumb towards the upper arm.
_MOST_ROLL_RAD = 1.4
# Shoulder blades turn with an arm that is raised above this elevation, by this fraction of the rest.
_BLADE_FROM_RAD, _BLADE_FRACTION = -0.35, 0.32


@dataclass(frozen=True)
class Arm:
    """Rotations of one arm's joints, each relative to its parent, the collar to the chest."""

    collar: Float64[np.ndarray, "N 3 3"]
    shoulder: Float64[np.ndarray, "N 3 3"]
    elbow: Float64[np.ndarray, "N 3 3"]
    wrist: Float64[np.ndarray, "N 3 3"]

    def blended(self, other: "Arm", weight: Float64[np.ndarray, " N"]) -> "Arm":
        """This arm a fraction of the way to another one."""
        return Arm(
            blend(self.collar, other.collar, weight),
            blend(self.shoulder, other.shoulder, weight),
            blend(self.elbow, other.elbow, weight),
            blend(self.wrist, other.wrist, weight),
        )

    def shrugged(self, side: str, raise_rad: Float64[np.ndarray, " N"]) -> "Arm":
        """The arm with its shoulder raised; the upper arm keeps its direction."""
        raised = about_x(raise_rad if side == "left" else -raise_rad)
        return Arm(self.collar @ raised, np.swapaxes(raised, 1, 2) @ self.shoulder, self.elbow, self.wrist)


def hanging_arm(
    side: str,
    forward_rad: Float64[np.ndarray, " N"],
    abduction_rad: float,
    bend_rad: Float64[np.ndarray, " N"],
) -> Arm:
    """An arm that hangs from the shoulder, ``forward_rad`` ahead of the chest's down; ``bend_rad`` is the elbow's."""
    count = len(forward_rad)
    drop_rad = np.full(count, abduction_rad - 0.5 * np.pi)
    # The collar takes a little of the drop, as it does when arms come down from a T-pose.
    collar = about_x(0.08 * drop_rad)
    shoulder = about_y(-forward_rad) @ about_x(0.92 * drop_rad) @ about_y(np.full(count, _HANGING_TWIST_RAD))
    elbow = about_z(-bend_rad) @ about_y(np.full(count, _PRONATION_RAD))
    wrist = about_z(np.full(count, -0.12)) @ about_x(np.full(count, -0.16)) @ about_y(np.full(count, _PRONATION_RAD))
    arm = Arm(collar, shoulder, elbow, wrist)
    return arm if side == "left" else Arm(*(_mirrored(part) for part in (collar, shoulder, elbow, wrist)))


def arm_length_m(skeleton: Skeleton, side: str) -> float:
    """From the shoulder to the wrist along the bones."""
    upper_m, lower_m = (
        bone(skeleton, f"{side}_shoulder", f"{side}_elbow"),
        bone(skeleton, f"{side}_elbow", f"{side}_wrist"),
    )
    return float(np.linalg.norm(upper_m) + np.linalg.norm(lower_m))


def pose_wrist(pose: HandPose, beat: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, "N 3"]:
    """Where a pose has the wrist (forward, outward, up; lengths of the arm) as it beats between -1 and 1."""
    return np.asarray(np.array(pose.wrist) + beat[:, None] * np.array(pose.swing))


def reaching_arm(
    side: str,
    skeleton: Skeleton,
    pose: HandPose,
    wrist: Float64[np.ndarray, "N 3"],
    beat: Float64[np.ndarray, " N"],
) -> Arm:
    """An arm in a pose with its wrist at (forward, outward, up) from the shoulder in the chest's axes, arm lengths."""
    outward = np.array([1.0, 1.0 if side == "left" else -1.0, 1.0])
    count = len(wrist)
    bones = solve_two_bones(
        np.zeros((count, 3)),
        wrist * outward * arm_length_m(skeleton, side),
        np.tile(np.array(pose.elbow_towards) * outward, (count, 1)),
        bone(skeleton, f"{side}_shoulder", f"{side}_elbow"),
        bone(skeleton, f"{side}_elbow", f"{side}_wrist"),
        np.array([-1.0, 0.0, 0.0]),
    )
    roll_rad = _roll_rad(bones.world_from_lower, np.array(pose.palm_towards) * outward)
    # The forearm turns along its whole length: half of the roll shows between elbow and wrist.
    half = about_y(0.5 * roll_rad)
    flex_rad = pose.flex_rad + pose.beat_rad * beat
    wrist_turn = half @ about_x(-flex_rad if side == "left" else flex_rad)
    collar = _collar(side, bones.world_from_upper)
    shoulder = np.swapaxes(collar, 1, 2) @ bones.world_from_upper
    elbow = np.swapaxes(bones.world_from_upper, 1, 2) @ bones.world_from_lower @ half
    return Arm(collar, np.asarray(shoulder), np.asarray(elbow), wrist_turn)


def _collar(side: str, chest_from_upper: Float64[np.ndarray, "N 3 3"]) -> Float64[np.ndarray, "N 3 3"]:
    sign = 1.0 if side == "left" else -1.0
    elevation_rad = np.arcsin(np.clip(sign * chest_from_upper[:, 2, 1], -1.0, 1.0))
    raised_rad = _BLADE_FRACTION * np.maximum(elevation_rad - _BLADE_FROM_RAD, 0.0) - 0.1
    return about_x(sign * raised_rad)


def _roll_rad(
    world_from_lower: Float64[np.ndarray, "N 3 3"], palm_towards: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, " N"]:
    """How far a forearm turns about itself to have the palm look one way, as far as it can."""
    axis, palm = world_from_lower[:, :, 1], -world_from_lower[:, :, 2]
    sine = np.sum(np.cross(palm, palm_towards) * axis, axis=1)
    angle_rad = np.arctan2(sine, palm @ palm_towards)
    return np.asarray(np.clip(angle_rad, -_MOST_ROLL_RAD, _MOST_ROLL_RAD))


def _mirrored(rotation: Float64[np.ndarray, "N 3 3"]) -> Float64[np.ndarray, "N 3 3"]:
    return np.asarray(_MIRROR @ rotation @ _MIRROR)
