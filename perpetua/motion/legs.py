"""Legs that reach their feet, and a pelvis low enough for both to do so."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from perpetua.motion.feet import FootShape, FootTrack
from perpetua.motion.kinematics import TwoBones, bone, joint_index, solve_two_bones
from perpetua.motion.rotations import about_z, rotate
from perpetua.scene.actor import Skeleton

SIDES = ("left", "right")
# A knee keeps about nine degrees of bend.
_REACH_FRACTION = 0.9965
# The pelvis comes down before a leg is fully stretched, so that it never has to jerk.
WALKING_FORESIGHT_S = 0.09


@dataclass(frozen=True)
class Leg:
    """One leg in the rest pose: the hip joint from the pelvis, the thigh and the shin, metres."""

    hip_m: Float64[np.ndarray, "3"]
    thigh_m: Float64[np.ndarray, "3"]
    shin_m: Float64[np.ndarray, "3"]

    @property
    def reach_m(self) -> float:
        """Farthest distance from hip to ankle that is used."""
        return _REACH_FRACTION * float(np.linalg.norm(self.thigh_m) + np.linalg.norm(self.shin_m))


def leg_of(skeleton: Skeleton, side: str) -> Leg:
    """The left or right leg of a skeleton."""
    return Leg(
        bone(skeleton, "pelvis", f"{side}_hip"),
        bone(skeleton, f"{side}_hip", f"{side}_knee"),
        bone(skeleton, f"{side}_knee", f"{side}_ankle"),
    )


def foot_of(skeleton: Skeleton, side: str) -> FootShape:
    """The left or right foot of a skeleton."""
    ankle_m = skeleton.joint_m[joint_index(f"{side}_ankle")]
    heel, toe = (0, 1) if side == "left" else (2, 3)
    return FootShape(
        # Above the sole, wherever the skeleton's origin is.
        float(ankle_m[2] - min(skeleton.contact_m[heel, 2], skeleton.contact_m[toe, 2])),
        skeleton.contact_m[heel] - ankle_m,
        bone(skeleton, f"{side}_ankle", f"{side}_foot"),
        skeleton.contact_m[toe] - ankle_m,
    )


def pelvis_heights_m(
    nominal_m: Float64[np.ndarray, " N"],
    pelvis_xy_m: Float64[np.ndarray, "N 2"],
    world_from_pelvis: Float64[np.ndarray, "N 3 3"],
    legs: tuple[Leg, Leg],
    ankles_m: tuple[Float64[np.ndarray, "N 3"], Float64[np.ndarray, "N 3"]],
    step_s: float,
    slack_m: tuple[Float64[np.ndarray, " N"], Float64[np.ndarray, " N"]] | None = None,
    foresight_s: float = WALKING_FORESIGHT_S,
) -> Float64[np.ndarray, " N"]:
    """The pelvis's height at evenly spaced times: as near to ``nominal_m`` as the reach of both legs allows.

    A foot may hold the body down by ``slack_m`` less than its leg's reach asks for: it is taken along.
    The lower envelope over a short window, averaged over the same window, stays under the limit at every time.
    """
    highest_m = nominal_m
    for side, (leg, ankle_m) in enumerate(zip(legs, ankles_m, strict=True)):
        hip_m = rotate(world_from_pelvis, leg.hip_m)
        away_m = np.linalg.norm(ankle_m[:, :2] - pelvis_xy_m - hip_m[:, :2], axis=1)
        # A foot out of reach at any height must not pull the pelvis to the floor.
        drop_m = np.sqrt(np.maximum(leg.reach_m**2 - away_m**2, (0.75 * leg.reach_m) ** 2))
        limit_m = ankle_m[:, 2] + drop_m - hip_m[:, 2]
        highest_m = np.minimum(highest_m, limit_m if slack_m is None else limit_m + slack_m[side])
    window = max(1, round(foresight_s / step_s))
    lowest_m = minimum_filter1d(highest_m, 2 * window + 1, mode="nearest")
    return np.asarray(gaussian_filter1d(lowest_m, 0.5 * window, radius=window, mode="nearest"))


def solve_leg(
    leg: Leg,
    track: FootTrack,
    pelvis_m: Float64[np.ndarray, "N 3"],
    world_from_pelvis: Float64[np.ndarray, "N 3 3"],
    heading_rad: Float64[np.ndarray, " N"],
) -> TwoBones:
    """Thigh and shin that put the ankle on its track; the knee points between the body's and the foot's heading."""
    knee_rad = heading_rad + 0.6 * ((track.yaw_rad - heading_rad + np.pi) % (2.0 * np.pi) - np.pi)
    ahead = np.array([1.0, 0.0, 0.0])
    hip_m = pelvis_m + rotate(world_from_pelvis, leg.hip_m)
    return solve_two_bones(hip_m, track.ankle_m, rotate(about_z(knee_rad), ahead), leg.thigh_m, leg.shin_m, ahead)
