"""A tape's motion laid along a route, feet planted, as a ``BodyMotion``."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.ndimage import gaussian_filter1d

from perpetua.motion.feet import FootTrack
from perpetua.motion.kinematics import joint_index, solve_two_bones
from perpetua.motion.legs import SIDES, foot_of, leg_of, pelvis_heights_m
from perpetua.motion.recorded.clip import mix_rotations, resample_rotations, resample_rows
from perpetua.motion.recorded.planting import WantedFoot, plant_foot
from perpetua.motion.recorded.ride import Clock, Going, Ride
from perpetua.motion.recorded.tape import TAPE_HZ, Tape, ankles_m
from perpetua.motion.rotations import about_y, about_z, rotate
from perpetua.scene.actor import BodyMotion, Skeleton

# Between these speeds of the tape, strides begin to follow the route's direction and length.
_STRIDE_FROM_MPS, _STRIDE_TO_MPS = 0.12, 0.35
# A recorded pelvis may be this far from its path, softly.
_MOST_OFFSET_M = 0.1
_MOST_LONGER = 1.5
_AHEAD = np.array([1.0, 0.0, 0.0])


def body_along(
    tape: Tape,
    standing: Tape | None,
    ride: Ride,
    going: Going,
    clock: Clock,
    skeleton: Skeleton,
    actor: int,
    fps: float,
) -> BodyMotion:
    """The motion of a tape along a route.

    Args:
        tape: what the body does while it goes.
        standing: what it does while it stands, played to and fro; None lets the tape go on.
        ride: which row of the tape belongs to which time.
        going: the route at the clock's times.
        clock: fine times around the frames.
        skeleton: the bones that carry the motion.
        actor: whose motion it is.
        fps: frames per second of the route.
    """
    posed = _posed(tape, standing, ride, clock)
    yaw = about_z(going.heading_rad)
    world_from_joint = yaw[:, None] @ posed.path_from_joint
    away_m = _softly(posed.offset_m[:, :2])
    pelvis_m = going.place_m + np.einsum("nij,nj->ni", yaw, np.column_stack([away_m, posed.offset_m[:, 2]]))
    pelvis_m[:, 2] += _soft_floor_m(going, clock) - going.place_m[:, 2]
    strides = _strides(tape, ride, going, skeleton)
    feet: list[FootTrack] = []
    for foot, side in enumerate(SIDES):
        wanted = WantedFoot(
            going.place_m + np.einsum("nij,nj->ni", yaw, strides.ankle_m[:, foot]),
            world_from_joint[:, joint_index(f"{side}_ankle")],
            world_from_joint[:, joint_index(f"{side}_foot")],
            _at_rows(tape.standing[:, foot], ride.row),
            (1.0 - ride.stands) * strides.longer,
        )
        feet.append(plant_foot(wanted, foot_of(skeleton, side), going.place_m[:, 2]))
    legs = (leg_of(skeleton, "left"), leg_of(skeleton, "right"))
    pelvis_m[:, 2] = pelvis_heights_m(
        pelvis_m[:, 2],
        pelvis_m[:, :2],
        world_from_joint[:, 0],
        legs,
        (feet[0].ankle_m, feet[1].ankle_m),
        clock.step_s,
    )
    contacts = _enter_legs(world_from_joint, pelvis_m, feet, skeleton)
    at = clock.at_frames
    fingers = posed.finger_from_parent
    return BodyMotion(
        actor,
        fps,
        np.ascontiguousarray(world_from_joint[at]),
        np.ascontiguousarray(pelvis_m[at]),
        np.ascontiguousarray(contacts[at]),
        None if fingers is None else np.ascontiguousarray(fingers[at]),
    )


def _at_rows(values: np.ndarray, row: Float64[np.ndarray, " N"]) -> np.ndarray:
    return np.asarray(values[np.clip(np.rint(row).astype(int), 0, len(values) - 1)])


def _sampled(tape: Tape, row: Float64[np.ndarray, " N"]) -> Tape:
    """The tape at fractional rows."""
    inside = np.clip(row, 0.0, len(tape) - 1.0)
    fingers = tape.finger_from_parent
    return Tape(
        resample_rows(tape.path_m, inside),
        resample_rows(tape.heading_rad[:, None], inside)[:, 0],
        resample_rotations(tape.path_from_joint, inside),
        resample_rows(tape.offset_m, inside),
        resample_rows(tape.velocity_mps, inside),
        resample_rows(tape.turn_rps[:, None], inside)[:, 0],
        _at_rows(tape.standing, inside),
        None if fingers is None else resample_rotations(fingers, inside),
    )


def _posed(tape: Tape, standing: Tape | None, ride: Ride, clock: Clock) -> Tape:
    """The body about its path: the tape's, blended into the standing tape's where the body stands."""
    posed = _sampled(tape, ride.row)
    if standing is None or not ride.stands.any():
        return posed
    span = max(len(standing) - 1, 1)
    forth = np.abs((clock.time_s - clock.time_s[0]) * TAPE_HZ % (2.0 * span) - span)
    still = _sampled(standing, span - forth)
    # Where the feet are is the tape's business; the pelvis stands over them.
    still.offset_m[:, :2] *= 0.5
    rotation = mix_rotations(posed.path_from_joint, still.path_from_joint, ride.stands)
    for side in SIDES:
        for name in ("ankle", "foot"):
            rotation[:, joint_index(f"{side}_{name}")] = posed.path_from_joint[:, joint_index(f"{side}_{name}")]
    weight = ride.stands[:, None]
    return Tape(
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


def _soft_floor_m(going: Going, clock: Clock) -> Float64[np.ndarray, " N"]:
    return np.asarray(gaussian_filter1d(going.place_m[:, 2], 0.15 / clock.step_s, mode="nearest"))


@dataclass(frozen=True)
class _Strides:
    """Ankles about the path, and how much longer than recorded the strides are (1 if not longer)."""

    ankle_m: Float64[np.ndarray, "N 2 3"]
    longer: Float64[np.ndarray, " N"]


def _strides(tape: Tape, ride: Ride, going: Going, skeleton: Skeleton) -> _Strides:
    """Ankles about the path, strides turned and stretched to the route's velocity.

    A foot that stands goes backwards in the frame of the path as fast as the path goes. The part of a foot's place
    along the tape's velocity is therefore replaced by as much along the route's velocity, in the ratio of the speeds.
    """
    row = np.clip(ride.row, 0.0, len(tape) - 1.0)
    velocity_mps = resample_rows(tape.velocity_mps, row)
    tape_m = ankles_m(tape, skeleton)
    middle_m = tape_m.mean(axis=(0, 1))[:2]
    ankle_m = resample_rows(tape_m.reshape(len(tape), 6), row).reshape(-1, 2, 3)
    speed_mps = np.linalg.norm(velocity_mps, axis=1)
    along = velocity_mps / np.maximum(speed_mps, 1e-6)[:, None]
    stride = going.velocity_mps / (np.maximum(speed_mps, _STRIDE_TO_MPS) * np.maximum(ride.rate, 0.4))[:, None]
    share = np.clip((speed_mps - _STRIDE_FROM_MPS) / (_STRIDE_TO_MPS - _STRIDE_FROM_MPS), 0.0, 1.0)
    for foot in (0, 1):
        ahead_m = np.sum((ankle_m[:, foot, :2] - middle_m) * along, axis=1)
        ankle_m[:, foot, :2] += (share * ahead_m)[:, None] * (stride - along)
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
