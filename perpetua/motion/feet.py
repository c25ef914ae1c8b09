"""A foot's pose at any time: it lands on the heel, rolls flat, lifts the heel over the ball, and swings."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from perpetua.motion.footsteps import Plant
from perpetua.motion.ground import Ground
from perpetua.motion.rotations import about_y, about_z, rotate, smoothstep

# At a brisk stride of this length the foot lands and leaves at these pitches (nose down is positive).
_FULL_STRIDE_M = 1.3
_LANDING_PITCH_RAD = -0.27
_LEAVING_PITCH_RAD = 1.15
_LEAST_LEAVING_PITCH_RAD = 0.22
# Joggers land nearly flat, and at once.
_JOG_LANDING_PITCH_RAD, _JOG_LANDING_S = -0.1, 0.05
# How far a jogger's heel comes up behind, and how much farther the foot pitches.
_HEEL_KICK_M, _KICK_PITCH_RAD = 0.24, 0.35
# A sole point this far above the floor does not stand on it.
_STANDS_M = 0.006
_LANDING_S = 0.13
_LEAVING_S = 0.36


@dataclass(frozen=True)
class FootShape:
    """A foot in the rest pose, relative to the ankle joint: heel and toe points of the sole, and the toe joint."""

    ankle_height_m: float
    heel_m: Float64[np.ndarray, "3"]
    toe_joint_m: Float64[np.ndarray, "3"]
    toe_m: Float64[np.ndarray, "3"]


@dataclass(frozen=True)
class FootTrack:
    """One foot over time; a contact is flagged only while its sole point does not move at all."""

    ankle_m: Float64[np.ndarray, "N 3"]
    yaw_rad: Float64[np.ndarray, " N"]
    pitch_rad: Float64[np.ndarray, " N"]
    toe_pitch_rad: Float64[np.ndarray, " N"]
    heel_contact: Bool[np.ndarray, " N"]
    toe_contact: Bool[np.ndarray, " N"]

    @property
    def on_floor(self) -> Bool[np.ndarray, " N"]:
        """Whether any part of the sole stands."""
        return np.asarray(self.heel_contact | self.toe_contact)


@dataclass(frozen=True)
class _Roll:
    """Timing and pitches of one stance."""

    plant: Plant
    flat_s: float
    rise_s: float
    landing_rad: float
    leaving_rad: float

    @property
    def leaving_rate_rps(self) -> float:
        """Pitch rate as the toes leave the floor."""
        return 2.0 * self.leaving_rad / (self.plant.lift_s - self.rise_s)


def foot_track(
    plants: tuple[Plant, ...], shape: FootShape, clearance_m: float, ground: Ground, time_s: Float64[np.ndarray, " N"]
) -> FootTrack:
    """The foot that stands on ``plants`` in turn.

    Args:
        plants: in order of time; the first has stood since ever, the last stays for good.
        shape: the foot at rest.
        clearance_m: least height of the sole in mid-swing.
        ground: the floor; a heel or toe beyond the edge of a rug is not in contact.
        time_s: when to evaluate.
    """
    rolls = _rolls(plants)
    track = FootTrack(
        np.empty((len(time_s), 3)),
        *(np.zeros(len(time_s)) for _ in range(3)),
        *(np.zeros(len(time_s), bool) for _ in range(2)),
    )
    for index, roll in enumerate(rolls):
        stands = (time_s >= roll.plant.land_s) & (time_s <= roll.plant.lift_s)
        _fill(track, stands, _stance(roll, shape, ground, time_s[stands]))
        if index + 1 < len(rolls):
            following = rolls[index + 1]
            swings = (time_s > roll.plant.lift_s) & (time_s < following.plant.land_s)
            _fill(track, swings, _swing(roll, following, shape, clearance_m, ground, time_s[swings]))
    return track


def _fill(track: FootTrack, where: Bool[np.ndarray, " N"], part: FootTrack) -> None:
    for name in ("ankle_m", "yaw_rad", "pitch_rad", "toe_pitch_rad", "heel_contact", "toe_contact"):
        getattr(track, name)[where] = getattr(part, name)


def _rolls(plants: tuple[Plant, ...]) -> list[_Roll]:
    rolls = []
    for index, plant in enumerate(plants):
        before = plants[max(index - 1, 0)]
        after = plants[min(index + 1, len(plants) - 1)]
        duration_s = plant.lift_s - plant.land_s
        landing = np.clip(_ahead_m(before, plant) / _FULL_STRIDE_M, 0.0, 1.0)
        leaving = np.clip(_ahead_m(plant, after) / _FULL_STRIDE_M, 0.0, 1.0)
        rolls.append(
            _Roll(
                plant,
                plant.land_s + min(_mix(_LANDING_S, _JOG_LANDING_S, plant.run_weight), 0.2 * duration_s),
                plant.lift_s - min(_LEAVING_S, 0.5 * duration_s),
                float(landing) * _mix(_LANDING_PITCH_RAD, _JOG_LANDING_PITCH_RAD, plant.run_weight),
                _LEAST_LEAVING_PITCH_RAD + float(leaving) * (_LEAVING_PITCH_RAD - _LEAST_LEAVING_PITCH_RAD),
            )
        )
    return rolls


def _mix(walking: float, running: float, run_weight: float) -> float:
    return walking + run_weight * (running - walking)


def _ahead_m(start: Plant, end: Plant) -> float:
    step_m = end.position_m - start.position_m
    return float(step_m[0] * np.cos(end.yaw_rad) + step_m[1] * np.sin(end.yaw_rad))


def _stance(roll: _Roll, shape: FootShape, ground: Ground, time_s: Float64[np.ndarray, " N"]) -> FootTrack:
    plant = roll.plant
    landing, rising = time_s < roll.flat_s, time_s > roll.rise_s
    pitch_rad = np.zeros(len(time_s))
    if landing.any():
        fraction = (time_s[landing] - plant.land_s) / (roll.flat_s - plant.land_s)
        pitch_rad[landing] = roll.landing_rad * (1.0 - fraction) ** 2
    if rising.any():
        fraction = (time_s[rising] - roll.rise_s) / (plant.lift_s - roll.rise_s)
        pitch_rad[rising] = roll.leaving_rad * fraction**2
    pivot_m = np.where(rising[:, None], shape.toe_joint_m, shape.heel_m)
    yaw_rad = np.full(len(time_s), plant.yaw_rad)
    heel_stands, toe_stands = _stands_on(plant, shape, ground)
    return FootTrack(
        _ankle_over_pivot(plant, shape, pivot_m, pitch_rad),
        yaw_rad,
        pitch_rad,
        np.where(rising, 0.0, pitch_rad),
        ~rising & heel_stands,
        (~landing | (roll.landing_rad == 0.0)) & toe_stands,
    )


def _stands_on(plant: Plant, shape: FootShape, ground: Ground) -> tuple[bool, bool]:
    """Whether the heel and the toe of a planted foot have floor under them; the one that is higher always has."""
    offset_m = np.stack([shape.heel_m, shape.toe_m]) @ about_z(np.array([plant.yaw_rad]))[0].T
    floor_m = ground.height_m(plant.position_m[:2] + offset_m[:, :2], np.full(2, plant.position_m[2]))
    near = floor_m > plant.position_m[2] - _STANDS_M
    near[floor_m.argmax()] = True
    return bool(near[0]), bool(near[1])


def _ankle_over_pivot(
    plant: Plant, shape: FootShape, pivot_m: Float64[np.ndarray, "N 3"], pitch_rad: Float64[np.ndarray, " N"]
) -> Float64[np.ndarray, "N 3"]:
    """The ankle when the flat foot of a plant is pitched about a point of it."""
    flat = about_z(np.full(len(pitch_rad), plant.yaw_rad))
    pitched = flat @ about_y(pitch_rad)
    ankle_m = plant.position_m + np.array([0.0, 0.0, shape.ankle_height_m])
    return np.asarray(ankle_m + np.einsum("nij,nj->ni", flat - pitched, pivot_m))


def _swing(
    roll: _Roll,
    following: _Roll,
    shape: FootShape,
    clearance_m: float,
    ground: Ground,
    time_s: Float64[np.ndarray, " N"],
) -> FootTrack:
    start, end = roll.plant, following.plant
    duration_s = end.land_s - start.lift_s
    fraction = (time_s - start.lift_s) / duration_s
    pitch_rate = min(roll.leaving_rate_rps, 3.0)
    pitch_rad = _hermite(fraction, roll.leaving_rad, following.landing_rad, pitch_rate * duration_s, 0.0)
    kick = (
        end.run_weight * min(1.0, max(0.0, _ahead_m(start, end)) / _FULL_STRIDE_M) * np.sin(np.pi * fraction**0.8) ** 2
    )
    pitch_rad += _KICK_PITCH_RAD * kick
    toe_pitch_rad = pitch_rad - roll.leaving_rad * (1.0 - smoothstep(fraction / 0.5))
    turn_rad = (end.yaw_rad - start.yaw_rad + np.pi) % (2.0 * np.pi) - np.pi
    yaw_rad = start.yaw_rad + turn_rad * smoothstep(fraction)
    ankle_m = _ankle_path(roll, following, shape, fraction)
    ankle_m[:, :2] += np.sin(np.pi * fraction)[:, None] ** 2 * end.dodge_m
    ankle_m[:, 2] += _HEEL_KICK_M * kick
    foot = about_z(yaw_rad) @ about_y(pitch_rad)
    toes = about_z(yaw_rad) @ about_y(toe_pitch_rad)
    heel_m = ankle_m + rotate(foot, shape.heel_m)
    toe_m = ankle_m + rotate(foot, shape.toe_joint_m) + rotate(toes, shape.toe_m - shape.toe_joint_m)
    level_m = start.position_m[2] + (end.position_m[2] - start.position_m[2]) * fraction
    floor_m = level_m + _rise_m(ground, (heel_m, toe_m), level_m, fraction)
    low_m = np.minimum(heel_m[:, 2], toe_m[:, 2]) - floor_m
    bump = np.sin(np.pi * fraction) ** 2
    ankle_m[:, 2] += _soft_positive(clearance_m * bump - low_m, 0.02 * bump)
    still = np.zeros(len(time_s), bool)
    return FootTrack(ankle_m, yaw_rad, pitch_rad, toe_pitch_rad, still, still)


def _rise_m(
    ground: Ground,
    points_m: tuple[Float64[np.ndarray, "N 3"], Float64[np.ndarray, "N 3"]],
    level_m: Float64[np.ndarray, " N"],
    fraction: Float64[np.ndarray, " N"],
) -> Float64[np.ndarray, " N"]:
    """How far the floor under a swinging foot is above the line from its last to its next place, without corners."""
    rise_m = np.max([ground.height_m(point_m[:, :2], level_m) - level_m for point_m in points_m], axis=0, initial=0.0)
    if len(rise_m) == 0 or not rise_m.any():
        return np.zeros(len(fraction))
    soft_m = gaussian_filter1d(maximum_filter1d(rise_m, 9, mode="nearest"), 2.0, mode="nearest")
    return np.asarray(soft_m * smoothstep(fraction / 0.15) * smoothstep((1.0 - fraction) / 0.1))


def _ankle_path(
    roll: _Roll, following: _Roll, shape: FootShape, fraction: Float64[np.ndarray, " N"]
) -> Float64[np.ndarray, "N 3"]:
    start, end = roll.plant, following.plant
    duration_s = end.land_s - start.lift_s
    # The ankle leaves with the velocity that the rising heel gave it.
    instant_s = 1e-4
    angles = roll.leaving_rad - roll.leaving_rate_rps * np.array([0.0, instant_s])
    leaving_m = _ankle_over_pivot(start, shape, np.tile(shape.toe_joint_m, (2, 1)), angles)
    velocity_mps = (leaving_m[0] - leaving_m[1]) / instant_s
    landing_m = _ankle_over_pivot(end, shape, shape.heel_m[None], np.array([following.landing_rad]))[0]
    return np.stack(
        [
            _hermite(fraction, leaving_m[0, axis], landing_m[axis], velocity_mps[axis] * duration_s, 0.0)
            for axis in range(3)
        ],
        axis=1,
    )


def _hermite(
    fraction: Float64[np.ndarray, " N"], start: float, end: float, start_slope: float, end_slope: float
) -> Float64[np.ndarray, " N"]:
    squared, cubed = fraction**2, fraction**3
    return np.asarray(
        (2 * cubed - 3 * squared + 1) * start
        + (cubed - 2 * squared + fraction) * start_slope
        + (3 * squared - 2 * cubed) * end
        + (cubed - squared) * end_slope
    )


def _soft_positive(value: Float64[np.ndarray, " N"], softness: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    """Never below max(value, 0), without its corner."""
    return np.asarray(0.5 * (value + np.sqrt(value**2 + softness**2)))
