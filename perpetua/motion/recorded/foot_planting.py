"""Feet that stand still: wherever a recorded foot stands, ours is planted and rolls about heel or ball."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.motion.feet import FootShape, FootTrack
from perpetua.motion.recorded.stances import runs
from perpetua.motion.rotations import about_y, about_z, rotate

# A sole pitched by less than this is flat, in radians.
_FLAT_RAD = 0.01
# The foot is flat by this fraction of a stance, and stays so until that fraction at least.
_LATEST_FLAT, _EARLIEST_RISE = 0.35, 0.4
# Pitches at which a foot may stand.
_MOST_LANDING_RAD, _MOST_LEAVING_RAD = 0.5, 1.25
_SWING_CLEARANCE_M = 0.012


@dataclass(frozen=True)
class WantedFoot:
    """Where a foot would be if nothing held it: the ankle, and the foot's and the toes' world rotation.

    ``pitch_scale`` multiplies its pitch: less than 1 where the body waits in the middle of a stride, more where
    strides are longer than recorded.
    """

    ankle_m: Float64[np.ndarray, "N 3"]
    world_from_foot: Float64[np.ndarray, "N 3 3"]
    world_from_toes: Float64[np.ndarray, "N 3 3"]
    stands: Bool[np.ndarray, " N"]
    pitch_scale: Float64[np.ndarray, " N"]


@dataclass(frozen=True)
class _Angles:
    yaw_rad: Float64[np.ndarray, " N"]
    pitch_rad: Float64[np.ndarray, " N"]
    toe_pitch_rad: Float64[np.ndarray, " N"]


def plant_foot(wanted: WantedFoot, shape: FootShape, floor_m: Float64[np.ndarray, " N"]) -> FootTrack:
    """The foot with every stance locked to one place on the floor, swings joined to the stances around them.

    Args:
        wanted: the foot as recorded, along the route.
        shape: the foot at rest.
        floor_m: height of the floor at each time.
    """
    count = len(floor_m)
    angles = _angles(wanted)
    track = FootTrack(
        wanted.ankle_m.copy(),
        angles.yaw_rad.copy(),
        angles.pitch_rad.copy(),
        angles.toe_pitch_rad.copy(),
        np.zeros(count, bool),
        np.zeros(count, bool),
    )
    stances = runs(wanted.stands)
    for start, end in stances:
        _fill_stance(track, wanted, angles, shape, float(floor_m[(start + end) // 2]), slice(start, end))
    edges = [0, *(edge for stance in stances for edge in stance), count]
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if end > start:
            _fill_swing(track, wanted, angles, shape, floor_m, start, end)
    return track


def _angles(wanted: WantedFoot) -> _Angles:
    # The axis to the left tells the yaw however far the foot is pitched; a running foot goes beyond the vertical.
    left = wanted.world_from_foot[:, :, 1]
    yaw_rad = np.unwrap(np.arctan2(-left[:, 0], left[:, 1]))
    pitch_rad, toe_pitch_rad = (
        _pitch_rad(rotation[:, :, 0], yaw_rad) for rotation in (wanted.world_from_foot, wanted.world_from_toes)
    )
    # Skeletons differ in what they call a flat foot: it is how the sole lies in the middle of a stance.
    middles = [(slice(start + (end - start) // 3, end - (end - start) // 2 + 1)) for start, end in runs(wanted.stands)]
    if middles:
        lie_rad = float(np.median(np.concatenate([pitch_rad[middle] for middle in middles])))
        pitch_rad, toe_pitch_rad = pitch_rad - lie_rad, toe_pitch_rad - lie_rad
    return _Angles(yaw_rad, wanted.pitch_scale * pitch_rad, wanted.pitch_scale * toe_pitch_rad)


def _pitch_rad(ahead: Float64[np.ndarray, "N 3"], yaw_rad: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    forward = ahead[:, 0] * np.cos(yaw_rad) + ahead[:, 1] * np.sin(yaw_rad)
    return np.asarray(np.unwrap(np.arctan2(-ahead[:, 2], forward)))


def _fill_stance(
    track: FootTrack, wanted: WantedFoot, angles: _Angles, shape: FootShape, floor_m: float, where: slice
) -> None:
    count = len(angles.pitch_rad)
    pitch_rad = _standing_pitch(angles.pitch_rad[where], where.start > 0, where.stop < count)
    yaw_rad = np.full(len(pitch_rad), float(np.mean(angles.yaw_rad[where])))
    pivot_m = np.where(pitch_rad[:, None] > 0.0, shape.toe_joint_m, shape.heel_m)
    flat = about_z(yaw_rad)
    rolled_m = np.einsum("nij,nj->ni", flat - flat @ about_y(pitch_rad), pivot_m)
    # Frames with the whole sole down say best where the foot stands.
    weight = np.where(pitch_rad == 0.0, 1.0, 1e-3)[:, None]
    place_m = np.sum(weight * (wanted.ankle_m[where] - rolled_m), axis=0) / weight.sum()
    place_m[2] = floor_m + shape.ankle_height_m
    track.ankle_m[where] = place_m + rolled_m
    track.yaw_rad[where] = yaw_rad
    track.pitch_rad[where] = pitch_rad
    track.toe_pitch_rad[where] = np.minimum(pitch_rad, 0.0)
    track.heel_contact[where] = pitch_rad <= 0.0
    track.toe_contact[where] = pitch_rad >= 0.0


def _standing_pitch(pitch_rad: Float64[np.ndarray, " K"], lands: bool, leaves: bool) -> Float64[np.ndarray, " K"]:
    """A pitch that comes down to flat once, stays, and rises over the ball once.

    A stance that was under way when the recording began does not land, one that outlasts it does not leave.
    """
    count = len(pitch_rad)
    latest = max(1, int(_LATEST_FLAT * count)) if leaves else count
    early = np.flatnonzero(np.abs(pitch_rad[:latest]) <= _FLAT_RAD)
    flat_at = (int(early[0]) if len(early) > 0 else latest) if lands else 0
    earliest = max(flat_at, int(np.ceil(_EARLIEST_RISE * count))) if lands else 0
    late = np.flatnonzero(pitch_rad[earliest:] <= _FLAT_RAD)
    rise_at = earliest + int(late[-1]) + 1 if len(late) > 0 else earliest
    standing = np.zeros(count)
    if flat_at > 0:
        standing[:flat_at] = _landing_pitch(pitch_rad[:flat_at], len(early) > 0 or not leaves)
    if rise_at < count:
        standing[rise_at:] = _leaving_pitch(pitch_rad[rise_at:], len(late) > 0 or not lands)
    return standing


def _landing_pitch(pitch_rad: Float64[np.ndarray, " K"], becomes_flat: bool) -> Float64[np.ndarray, " K"]:
    """Heel or ball carries the landing from first to last; it is brought to flat where the recording is not."""
    fade = 1.0 if becomes_flat and pitch_rad[0] <= 0.0 else 1.0 - np.arange(len(pitch_rad)) / len(pitch_rad)
    landing = np.clip(pitch_rad, -_MOST_LANDING_RAD, _MOST_LANDING_RAD) * fade
    return np.asarray(np.minimum(landing, 0.0) if pitch_rad[0] <= 0.0 else np.maximum(landing, 0.0))


def _leaving_pitch(pitch_rad: Float64[np.ndarray, " K"], was_flat: bool) -> Float64[np.ndarray, " K"]:
    leaving = np.maximum.accumulate(np.clip(pitch_rad, 0.0, _MOST_LEAVING_RAD))
    return np.asarray(leaving if was_flat else leaving * np.arange(len(leaving)) / max(1, len(leaving) - 1))


def _fill_swing(
    track: FootTrack,
    wanted: WantedFoot,
    angles: _Angles,
    shape: FootShape,
    floor_m: Float64[np.ndarray, " N"],
    start: int,
    end: int,
) -> None:
    """The recorded swing, moved so that it leaves from where the foot stood and lands where it will stand."""
    where, count = slice(start, end), end - start
    fraction = (np.arange(count) + 1.0) / (count + 1.0)
    ease = fraction**2 * (3.0 - 2.0 * fraction)
    before, after = (start - 1 if start > 0 else end), (end if end < len(floor_m) else start - 1)
    inner = 0 <= before < len(floor_m) and 0 <= after < len(floor_m)
    if inner:
        track.ankle_m[where] += _eased(track.ankle_m - wanted.ankle_m, before, after, ease)
        yaw_error = (track.yaw_rad - angles.yaw_rad)[:, None]
        track.yaw_rad[where] += _eased(yaw_error, before, after, ease)[:, 0]
        for name in ("pitch_rad", "toe_pitch_rad"):
            error = (getattr(track, name) - getattr(angles, name))[:, None]
            getattr(track, name)[where] += _eased(error, before, after, ease)[:, 0]
    bump = np.minimum(1.0 if start == 0 else ease, 1.0 if end == len(floor_m) else 1.0 - ease)
    _lift(track, shape, floor_m, where, 2.0 * _SWING_CLEARANCE_M * bump)


def _eased(
    error: Float64[np.ndarray, "N K"], before: int, after: int, ease: Float64[np.ndarray, " M"]
) -> Float64[np.ndarray, "M K"]:
    return np.asarray((1.0 - ease)[:, None] * error[before] + ease[:, None] * error[after])


def _lift(
    track: FootTrack,
    shape: FootShape,
    floor_m: Float64[np.ndarray, " N"],
    where: slice,
    clearance_m: Float64[np.ndarray, " M"],
) -> None:
    """Raises a swinging foot so that no part of its sole is lower than ``clearance_m`` above the floor."""
    turn = about_z(track.yaw_rad[where])
    foot, toes = turn @ about_y(track.pitch_rad[where]), turn @ about_y(track.toe_pitch_rad[where])
    heel_m = rotate(foot, shape.heel_m)[:, 2]
    toe_m = rotate(foot, shape.toe_joint_m)[:, 2] + rotate(toes, shape.toe_m - shape.toe_joint_m)[:, 2]
    low_m = track.ankle_m[where, 2] + np.minimum(heel_m, toe_m) - floor_m[where]
    lack_m = clearance_m - low_m
    track.ankle_m[where, 2] += 0.5 * (lack_m + np.sqrt(lack_m**2 + (0.5 * clearance_m) ** 2))
