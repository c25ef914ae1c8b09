"""A clip taken apart: where its body goes, and how the body moves about that, at an even rate and to our scale."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64
from scipy.signal import savgol_filter

from perpetua.motion.kinematics import bone, contact_positions, joint_index, joint_positions
from perpetua.motion.recorded.clip import Clip, mix_rotations, resample_rotations, resample_rows
from perpetua.motion.recorded.stances import CLIP_HZ, clean_stances, find_stances
from perpetua.motion.rotations import about_z
from perpetua.scene.actor import BodyMotion, Skeleton

# A body's path is what is left of its pelvis when the sway of a stride is smoothed away.
_STRIDE_WINDOW_S = 1.8
# How fast a turn on the spot counts as going, metres per radian: about what the feet move.
TURN_RADIUS_M = 0.25
# A file that says when feet stand is believed for stances as short as this.
_LEAST_TOLD_S = 0.05
# Fraction of frames in which the lowest sole point is at most as high as the floor.
_FLOOR_FRACTION = 0.3


@dataclass(frozen=True)
class RetargetedClip:
    """Motion relative to a path, ``CLIP_HZ`` rows a second, metres of our body.

    ``path_from_joint`` are rotations in the frame that goes along the path and faces the heading; ``offset_m`` is the
    pelvis from the path in that frame, its height above the floor; ``velocity_mps`` the path's velocity there;
    ``turn_rps`` the heading's rate; ``standing`` flags left and right foot on the floor.
    """

    path_m: Float64[np.ndarray, "L 2"]
    heading_rad: Float64[np.ndarray, " L"]
    path_from_joint: Float64[np.ndarray, "L 22 3 3"]
    offset_m: Float64[np.ndarray, "L 3"]
    velocity_mps: Float64[np.ndarray, "L 2"]
    turn_rps: Float64[np.ndarray, " L"]
    standing: Bool[np.ndarray, "L 2"]
    finger_from_parent: Float64[np.ndarray, "L 30 3 3"] | None

    def __len__(self) -> int:
        return len(self.heading_rad)

    @property
    def speed_mps(self) -> Float64[np.ndarray, " L"]:
        """How fast the path goes, a turn on the spot included."""
        return np.asarray(np.hypot(np.linalg.norm(self.velocity_mps, axis=1), TURN_RADIUS_M * self.turn_rps))

    def rows(self, row: Int64[np.ndarray, " N"]) -> "RetargetedClip":
        """A clip of these rows of this one."""
        return RetargetedClip(
            self.path_m[row],
            self.heading_rad[row],
            self.path_from_joint[row],
            self.offset_m[row],
            self.velocity_mps[row],
            self.turn_rps[row],
            self.standing[row],
            None if self.finger_from_parent is None else self.finger_from_parent[row],
        )

    def mixed(self, other: "RetargetedClip", weight: Float64[np.ndarray, " L"]) -> "RetargetedClip":
        """Each row a fraction of its own of the way to another clip's row."""
        column = weight[:, None]
        fingers = self.finger_from_parent
        if fingers is not None and other.finger_from_parent is not None:
            fingers = mix_rotations(fingers, other.finger_from_parent, weight)
        return RetargetedClip(
            self.path_m,
            self.heading_rad,
            mix_rotations(self.path_from_joint, other.path_from_joint, weight),
            (1.0 - column) * self.offset_m + column * other.offset_m,
            (1.0 - column) * self.velocity_mps + column * other.velocity_mps,
            (1.0 - weight) * self.turn_rps + weight * other.turn_rps,
            np.where(column < 0.5, self.standing, other.standing),
            fingers,
        )


def retarget(clip: Clip, skeleton: Skeleton) -> RetargetedClip:
    """A clip at an even rate, scaled to a skeleton's legs, taken apart into path and motion about it."""
    count = max(2, int(np.floor(clip.seconds * CLIP_HZ)) + 1)
    row = np.arange(count) * clip.fps / CLIP_HZ
    rotation = resample_rotations(clip.world_from_joint, row)
    fingers = None if clip.finger_from_parent is None else resample_rotations(clip.finger_from_parent, row)
    pelvis_m = resample_rows(clip.pelvis, row) * _scale(clip, skeleton)
    told = None if clip.standing is None else clip.standing[np.minimum(np.rint(row).astype(int), len(clip.pelvis) - 1)]
    feet_m = _feet_m(rotation, pelvis_m, skeleton)
    lowest_m = feet_m[..., 2].min(axis=1)
    floor_m = float(np.quantile(lowest_m, _FLOOR_FRACTION))
    standing = find_stances(feet_m, floor_m) if told is None else clean_stances(told, _LEAST_TOLD_S)
    path_m = _smooth(pelvis_m[:, :2])
    ahead = rotation[:, 0, :, 0]
    heading_rad = _smooth(np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))[:, None])[:, 0]
    path_from_world = about_z(-heading_rad)
    planar = path_from_world[:, :2, :2]
    velocity_mps = _gradient(path_m)
    offset_m = np.column_stack([_turned(planar, pelvis_m[:, :2] - path_m), pelvis_m[:, 2] - floor_m])
    return RetargetedClip(
        path_m,
        heading_rad,
        path_from_world[:, None] @ rotation,
        offset_m,
        _turned(planar, velocity_mps),
        _gradient(heading_rad[:, None])[:, 0],
        standing,
        fingers,
    )


def _scale(clip: Clip, skeleton: Skeleton) -> float:
    if clip.leg is None:
        return 1.0
    ours_m = np.linalg.norm(bone(skeleton, "left_hip", "left_knee")) + np.linalg.norm(
        bone(skeleton, "left_knee", "left_ankle")
    )
    return float(ours_m / clip.leg)


def _feet_m(
    rotation: Float64[np.ndarray, "L 22 3 3"], pelvis_m: Float64[np.ndarray, "L 3"], skeleton: Skeleton
) -> Float64[np.ndarray, "L 4 3"]:
    still = np.zeros((len(pelvis_m), 4), bool)
    return contact_positions(BodyMotion(0, CLIP_HZ, rotation, pelvis_m, still), skeleton)


def _turned(planar: Float64[np.ndarray, "L 2 2"], vector: Float64[np.ndarray, "L 2"]) -> Float64[np.ndarray, "L 2"]:
    return np.asarray(np.einsum("lij,lj->li", planar, vector))


def _smooth(values: Float64[np.ndarray, "L K"]) -> Float64[np.ndarray, "L K"]:
    """A cubic fitted to the window around each row: curves keep their bends, strides lose their sway."""
    window = min(round(_STRIDE_WINDOW_S * CLIP_HZ), len(values)) | 1
    window = window if window <= len(values) else window - 2
    if window < 5:
        return np.asarray(np.tile(values.mean(axis=0), (len(values), 1)))
    return np.asarray(savgol_filter(values, window, 3, axis=0))


def _gradient(values: Float64[np.ndarray, "L K"]) -> Float64[np.ndarray, "L K"]:
    return np.asarray(np.gradient(values, axis=0) * CLIP_HZ)


def path_joints_m(clip: RetargetedClip, skeleton: Skeleton) -> Float64[np.ndarray, "L 22 3"]:
    """All joints in the frame of the path: what two moments are compared by."""
    still = np.zeros((len(clip), 4), bool)
    return joint_positions(BodyMotion(0, CLIP_HZ, clip.path_from_joint, clip.offset_m, still), skeleton)


def ankles_m(clip: RetargetedClip, skeleton: Skeleton) -> Float64[np.ndarray, "L 2 3"]:
    """Left and right ankle in the frame of the path."""
    return path_joints_m(clip, skeleton)[:, [joint_index("left_ankle"), joint_index("right_ankle")]]
