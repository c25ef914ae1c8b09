"""A clip's motion laid along a route, feet planted, as a ``BodyMotion``."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.ndimage import gaussian_filter1d

from perpetua.motion.clock import Clock
from perpetua.motion.feet import FootTrack
from perpetua.motion.kinematics import joint_index, solve_two_bones
from perpetua.motion.legs import SIDES, foot_of, leg_of, pelvis_heights_m
from perpetua.motion.recorded.clip import mix_rotations, resample_rotations, resample_rows
from perpetua.motion.recorded.foot_planting import WantedFoot, plant_foot
from perpetua.motion.recorded.reference import ReferenceTrajectory
from perpetua.motion.recorded.retargeted import RetargetedClip, ankles_m
from perpetua.motion.recorded.stances import CLIP_HZ
from perpetua.motion.recorded.time_warp import TimeWarp
from perpetua.motion.rotations import about_y, about_z, rotate
from perpetua.scene.actor import BodyMotion, Skeleton

# Between these speeds of the clip, strides begin to follow the route's direction and length.
_STRIDE_FROM_MPS, _STRIDE_TO_MPS = 0.12, 0.35
# A recorded pelvis may be this far from its path, softly.
_MOST_OFFSET_M = 0.1
_MOST_LONGER = 1.5
_AHEAD = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class WarpedClip:
    """A clip to be laid along a route.

    ``going`` is what the body does while it goes; ``standing`` what it does while it stands, played to and fro (None
    lets ``going`` run on); ``warp`` says which row belongs to which time.
    """

    going: RetargetedClip
    standing: RetargetedClip | None
    warp: TimeWarp


def body_along(
    clip: WarpedClip, reference: ReferenceTrajectory, clock: Clock, skeleton: Skeleton, actor: int
) -> BodyMotion:
    """The motion of a clip along a route, at the frames of the clock.

    Args:
        clip: what the body does, and when.
        reference: the route at the clock's times.
        clock: fine times around the frames.
        skeleton: the bones that carry the motion.
        actor: whose motion it is.
    """
    posed = _posed(clip, clock)
    yaw = about_z(reference.heading_rad)
    world_from_joint = yaw[:, None] @ posed.path_from_joint
    feet = _planted(clip, reference, world_from_joint, skeleton)
    pelvis_m = _pelvis_m(posed, reference, yaw, clock)
    legs = (leg_of(skeleton, "left"), leg_of(skeleton, "right"))
    ankles_m = (feet[0].ankle_m, feet[1].ankle_m)
    pelvis_m[:, 2] = pelvis_heights_m(
        pelvis_m[:, 2], pelvis_m[:, :2], world_from_joint[:, 0], legs, ankles_m, clock.step_s
    )
    contacts = _enter_legs(world_from_joint, pelvis_m, feet, skeleton)
    at = clock.at_frames
    fingers = posed.finger_from_parent
    return BodyMotion(
        actor,
        clock.fps,
        np.ascontiguousarray(world_from_joint[at]),
        np.ascontiguousarray(pelvis_m[at]),
        np.ascontiguousarray(contacts[at]),
        None if fingers is None else np.ascontiguousarray(fingers[at]),
    )


def _pelvis_m(
    posed: RetargetedClip, reference: ReferenceTrajectory, yaw: Float64[np.ndarray, "N 3 3"], clock: Clock
) -> Float64[np.ndarray, "N 3"]:
    """The pelvis as recorded about the route, before the legs pull it down."""
    away_m = _softly(posed.offset_m[:, :2])
    pelvis_m = reference.place_m + np.einsum("nij,nj->ni", yaw, np.column_stack([away_m, posed.offset_m[:, 2]]))
    pelvis_m[:, 2] += _soft_floor_m(reference, clock) - reference.place_m[:, 2]
    return np.asarray(pelvis_m)


def _planted(
    clip: WarpedClip,
    reference: ReferenceTrajectory,
    world_from_joint: Float64[np.ndarray, "N 22 3 3"],
    skeleton: Skeleton,
) -> list[FootTrack]:
    """Left and right foot, planted wherever the clip's foot stands."""
    strides = _strides(clip.going, clip.warp, reference, skeleton)
    yaw = about_z(reference.heading_rad)
    feet = []
    for foot, side in enumerate(SIDES):
        wanted = WantedFoot(
            reference.place_m + np.einsum("nij,nj->ni", yaw, strides.ankle_m[:, foot]),
            world_from_joint[:, joint_index(f"{side}_ankle")],
            world_from_joint[:, joint_index(f"{side}_foot")],
            _at_rows(clip.going.standing[:, foot], clip.warp.row),
            (1.0 - clip.warp.stands) * strides.longer,
        )
        feet.append(plant_foot(wanted, foot_of(skeleton, side), reference.place_m[:, 2]))
    return feet


def _at_rows(values: np.ndarray, row: Float64[np.ndarray, " N"]) -> np.ndarray:
    return np.asarray(values[np.clip(np.rint(row).astype(int), 0, len(values) - 1)])


def _sampled(clip: RetargetedClip, row: Float64[np.ndarray, " N"]) -> RetargetedClip:
    """The clip at fractional rows."""
    inside = np.clip(row, 0.0, len(clip) - 1.0)
    fingers = clip.finger_from_parent
    return RetargetedClip(
        resample_rows(clip.path_m, inside),
        resample_rows(clip.heading_rad[:, None], inside)[:, 0],
        resample_rotations(clip.path_from_joint, inside),
        resample_rows(clip.offset_m, inside),
        resample_rows(clip.velocity_mps, inside),
        resample_rows(clip.turn_rps[:, None], inside)[:, 0],
        _at_rows(clip.standing, inside),
        None if fingers is None else resample_rotations(fingers, inside),
    )


def _posed(clip: WarpedClip, clock: Clock) -> RetargetedClip:
    """The body about its path: as it goes, blended into how it stands where it stands."""
    standing, warp = clip.standing, clip.warp
    posed = _sampled(clip.going, warp.row)
    if standing is None or not warp.stands.any():
        return posed
    span = max(len(standing) - 1, 1)
    forth = np.abs((clock.time_s - clock.time_s[0]) * CLIP_HZ % (2.0 * span) - span)
    still = _sampled(standing, span - forth)
    # Where the feet are is the clip's business; the pelvis stands over them.
    still.offset_m[:, :2] *= 0.5
    rotation = mix_rotations(posed.path_from_joint, still.path_from_joint, warp.stands)
    for side in SIDES:
        for name in ("ankle", "foot"):
            rotation[:, joint_index(f"{side}_{name}")] = posed.path_from_joint[:, joint_index(f"{side}_{name}")]
    weight = warp.stands[:, None]
    return RetargetedClip(
        posed.path_m,
        posed.heading_rad,
        rotation,
        (1.0 - weight) * posed.offset_m + weight * still.offset_m,
        posed.velocity_mps,
        posed.turn_rps,
        posed.standing,
        posed.finger_from_parent,
    )


def _softly(offset_m: Float64[np.ndarray, "N 2"]) -> Float64[np.ndarray, "N 2"]:
    length_m = np.linalg.norm(offset_m, axis=1, keepdims=True)
    return np.asarray(offset_m * _MOST_OFFSET_M * np.tanh(length_m / _MOST_OFFSET_M) / np.maximum(length_m, 1e-9))


def _soft_floor_m(reference: ReferenceTrajectory, clock: Clock) -> Float64[np.ndarray, " N"]:
    return np.asarray(gaussian_filter1d(reference.place_m[:, 2], 0.15 / clock.step_s, mode="nearest"))


@dataclass(frozen=True)
class _Strides:
    """Ankles about the path, and how much longer than recorded the strides are (1 if not longer)."""

    ankle_m: Float64[np.ndarray, "N 2 3"]
    longer: Float64[np.ndarray, " N"]


def _strides(clip: RetargetedClip, warp: TimeWarp, reference: ReferenceTrajectory, skeleton: Skeleton) -> _Strides:
    """Ankles about the path, strides turned and stretched to the route's velocity.

    A foot that stands goes backwards in the frame of the path as fast as the path goes. The part of a foot's place
    along the clip's velocity is therefore replaced by as much along the route's velocity, in the ratio of the speeds.
    """
    row = np.clip(warp.row, 0.0, len(clip) - 1.0)
    velocity_mps = resample_rows(clip.velocity_mps, row)
    clip_m = ankles_m(clip, skeleton)
    middle_m = clip_m.mean(axis=(0, 1))[:2]
    ankle_m = resample_rows(clip_m.reshape(len(clip), 6), row).reshape(-1, 2, 3)
    speed_mps = np.linalg.norm(velocity_mps, axis=1)
    along = velocity_mps / np.maximum(speed_mps, 1e-6)[:, None]
    stride = reference.velocity_mps / (np.maximum(speed_mps, _STRIDE_TO_MPS) * np.maximum(warp.rate, 0.4))[:, None]
    weight = np.clip((speed_mps - _STRIDE_FROM_MPS) / (_STRIDE_TO_MPS - _STRIDE_FROM_MPS), 0.0, 1.0)
    for foot in (0, 1):
        ahead_m = np.sum((ankle_m[:, foot, :2] - middle_m) * along, axis=1)
        ankle_m[:, foot, :2] += (weight * ahead_m)[:, None] * (stride - along)
    return _Strides(ankle_m, np.clip(np.linalg.norm(stride, axis=1), 1.0, _MOST_LONGER))


def _enter_legs(
    world_from_joint: Float64[np.ndarray, "N 22 3 3"],
    pelvis_m: Float64[np.ndarray, "N 3"],
    feet: list[FootTrack],
    skeleton: Skeleton,
) -> np.ndarray:
    """Replaces the legs' rotations by those that reach the feet, knees as recorded; returns the contacts."""
    contacts = []
    for side, track in zip(SIDES, feet, strict=True):
        leg = leg_of(skeleton, side)
        thigh, shin, ankle, toes = (joint_index(f"{side}_{name}") for name in ("hip", "knee", "ankle", "foot"))
        hip_m = pelvis_m + rotate(world_from_joint[:, 0], leg.hip_m)
        knee_to = rotate(world_from_joint[:, thigh], _AHEAD) + rotate(world_from_joint[:, shin], _AHEAD)
        bones = solve_two_bones(hip_m, track.ankle_m, knee_to, leg.thigh_m, leg.shin_m, _AHEAD)
        world_from_joint[:, thigh], world_from_joint[:, shin] = bones.world_from_upper, bones.world_from_lower
        turn = about_z(track.yaw_rad)
        world_from_joint[:, ankle] = turn @ about_y(track.pitch_rad)
        world_from_joint[:, toes] = turn @ about_y(track.toe_pitch_rad)
        reached = np.linalg.norm(bones.end_m - track.ankle_m, axis=1) < 1e-6
        contacts += [track.heel_contact & reached, track.toe_contact & reached]
    return np.stack(contacts, axis=1)
