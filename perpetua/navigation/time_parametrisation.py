"""Along a path in time: speeds that curves and stops allow, turns at stops, and pauses that stand quite still."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy import ndimage

from perpetua.navigation.types import Spot

# Curves are taken so slowly that a person turns no faster and is pushed aside no harder than this.
TURN_RATE_RADPS = 2.0
LATERAL_MPS2 = 2.8
# A person reaches any pace in about a second.
SECONDS_TO_PACE = 1.0
ACCELERATION_MPS2 = (0.8, 2.6)
PATH_STEP_M = 0.02
PATH_SMOOTHING_M = 0.2
# Nothing in a body's motion is abrupt: times are smoothed with this, within three times as much.
SMOOTHING_S = 0.12
TRUNCATE = 3.0
# Turns on the spot start and end gently.
SETTLING_S = 0.3
MIN_PAUSE_S = 0.5
# A first way shorter than this is none: the walk begins with a pause.
AT_ONCE_M = 1e-3


@dataclass(frozen=True)
class Stretch:
    """A way without a stop on it: legs of straight lines, and the speed wished for on each leg."""

    legs_m: tuple[Float64[np.ndarray, "_ 2"], ...]
    speeds_mps: tuple[float, ...]


@dataclass(frozen=True)
class Stop:
    """Standing: turning to what there is to see, looking at it, turning to go on. No spot: a turn on the way."""

    spot: Spot | None
    looking_s: float


@dataclass(frozen=True)
class Pause:
    """From ``first_step`` to ``last_step``, both included, a walk stands still at a spot and faces its target."""

    spot: Spot
    first_step: int
    last_step: int


@dataclass(frozen=True)
class Walk:
    """A walk at equal time steps: place and heading (about +Z, 0 faces +X, unwrapped), and its pauses."""

    position_m: Float64[np.ndarray, "T 2"]
    heading_rad: Float64[np.ndarray, " T"]
    pauses: tuple[Pause, ...] = ()


@dataclass(frozen=True)
class _Way:
    """A stretch as driven: places at equal distances, the direction there, and when each is passed."""

    path_m: Float64[np.ndarray, "L 2"]
    distance_m: Float64[np.ndarray, " L"]
    direction_rad: Float64[np.ndarray, " L"]
    speed_mps: Float64[np.ndarray, " L"]
    time_s: Float64[np.ndarray, " L"]

    def travelled_m(self, time_s: Float64[np.ndarray, " T"]) -> Float64[np.ndarray, " T"]:
        """Distance at given times, by constant acceleration between two places."""
        index = np.clip(np.searchsorted(self.time_s, time_s, side="right") - 1, 0, len(self.time_s) - 2)
        step_s = self.time_s[index + 1] - self.time_s[index]
        into = np.clip((time_s - self.time_s[index]) / step_s, 0.0, 1.0)
        v0, v1 = self.speed_mps[index], self.speed_mps[index + 1]
        return np.asarray(self.distance_m[index] + step_s * into * (v0 + 0.5 * into * (v1 - v0)))


def drive(stretches: list[Stretch], stops: list[Stop], steps: int, step_s: float) -> Walk:
    """The walk along stretches with a stop after each, from full speed on the first until the steps are used up.

    Args:
        stretches: one way after the other, each starting where the one before it ends.
        stops: one per stretch.
        steps: places of the walk; it stands at its end if the stretches are too short.
        step_s: seconds between two of them.
    """
    margin = int(np.ceil(TRUNCATE * SMOOTHING_S / step_s))
    # The walk is under way when it begins, so that smoothing finds motion before the first step.
    clock_s = (np.arange(steps + 2 * margin) - margin) * step_s
    travelled_m, heading_rad = np.zeros(len(clock_s)), np.zeros(len(clock_s))
    ways = [_way(stretch, number == 0) for number, stretch in enumerate(stretches)]
    begin_s, begin_m, facing_rad = float(clock_s[0]), 0.0, float(ways[0].direction_rad[0])
    if ways[0].distance_m[-1] < AT_ONCE_M:
        # Who begins with a pause has been at it for a while.
        begin_s -= SETTLING_S + 2.0 * TRUNCATE * SMOOTHING_S
    pauses: list[Pause] = []
    for number, (way, stop) in enumerate(zip(ways, stops, strict=True)):
        moving = clock_s >= begin_s
        travelled_m[moving] = begin_m + way.travelled_m(clock_s[moving] - begin_s)
        # A turn of the smallest angle joins each direction to the one before.
        along_rad = way.direction_rad + _turn_rad(facing_rad, way.direction_rad[0]) + facing_rad - way.direction_rad[0]
        heading_rad[moving] = np.interp(travelled_m[moving] - begin_m, way.distance_m, along_rad)
        begin_s, begin_m = begin_s + float(way.time_s[-1]), begin_m + float(way.distance_m[-1])
        departure_rad = float(ways[number + 1].direction_rad[0]) if number + 1 < len(ways) else None
        times_s, facings_rad = _turns(stop, float(along_rad[-1]), departure_rad)
        standing = clock_s >= begin_s
        heading_rad[standing] = np.interp(clock_s[standing] - begin_s, times_s, facings_rad)
        if stop.spot is not None:
            pauses += _pause(stop.spot, begin_s + times_s[1], begin_s + times_s[2], steps, step_s)
        begin_s, facing_rad = begin_s + float(times_s[-1]), float(facings_rad[-1])
        if begin_s > clock_s[-1]:
            break
    sigma = SMOOTHING_S / step_s
    travelled_m, heading_rad = (
        ndimage.gaussian_filter1d(values, sigma, mode="nearest", truncate=TRUNCATE)[margin : margin + steps]
        for values in (travelled_m, heading_rad)
    )
    return Walk(_places(ways, travelled_m), heading_rad, tuple(pauses))


def turn_s(first_rad: float, second_rad: float) -> float:
    """Seconds that a turn on the spot takes."""
    return abs(float(_turn_rad(first_rad, second_rad))) / TURN_RATE_RADPS + SETTLING_S


def _turn_rad(first_rad: float, second_rad: float) -> float:
    return float(np.angle(np.exp(1j * (second_rad - first_rad))))


def _turns(
    stop: Stop, arrival_rad: float, departure_rad: float | None
) -> tuple[Float64[np.ndarray, "4"], Float64[np.ndarray, "4"]]:
    """When a person at a stop faces where: arriving, ready to look, done with it, ready to go."""
    looking_rad = arrival_rad if stop.spot is None else arrival_rad + _turn_rad(arrival_rad, stop.spot.facing_rad)
    leaving_rad = looking_rad if departure_rad is None else looking_rad + _turn_rad(looking_rad, departure_rad)
    turning_s = turn_s(arrival_rad, looking_rad) if stop.spot is not None else 0.0
    times_s = np.cumsum([0.0, turning_s, stop.looking_s, turn_s(looking_rad, leaving_rad)])
    return times_s, np.array([arrival_rad, looking_rad, looking_rad, leaving_rad])


def _pause(spot: Spot, from_s: float, to_s: float, steps: int, step_s: float) -> list[Pause]:
    """The steps of a pause at which smoothing has died out; none if it is too short or outside the walk."""
    settle_s = TRUNCATE * SMOOTHING_S + step_s
    first = max(0, int(np.ceil((from_s + settle_s) / step_s)))
    last = min(steps - 1, int(np.floor((to_s - settle_s) / step_s)))
    return [Pause(spot, first, last)] if (last - first) * step_s >= MIN_PAUSE_S else []


def _way(stretch: Stretch, is_first: bool) -> _Way:
    path_m, distance_m, leg_ends_m = _smooth_path(stretch.legs_m)
    tangent = np.gradient(path_m, axis=0)
    direction_rad = np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0]))
    leg = np.minimum(np.searchsorted(leg_ends_m, distance_m), len(stretch.speeds_mps) - 1)
    wish_mps = np.array(stretch.speeds_mps)[leg]
    limit_mps = np.minimum(wish_mps, _curve_speeds(direction_rad, distance_m))
    acceleration_mps2 = np.clip(wish_mps / SECONDS_TO_PACE, *ACCELERATION_MPS2)
    limit_mps[-1] = 0.0
    if not is_first:
        limit_mps[0] = 0.0
    speed_mps = _reachable(limit_mps, distance_m, acceleration_mps2)
    time_s = np.append(0.0, np.cumsum(2.0 * np.diff(distance_m) / (speed_mps[1:] + speed_mps[:-1])))
    return _Way(path_m, distance_m, direction_rad, speed_mps, time_s)


def _smooth_path(
    legs_m: tuple[Float64[np.ndarray, "_ 2"], ...],
) -> tuple[Float64[np.ndarray, "L 2"], Float64[np.ndarray, " L"], Float64[np.ndarray, " G"]]:
    """Legs as one path without corners whose ends stay, the distance along it, and where on it each leg ends."""
    corners_m = np.concatenate([legs_m[0][:1], *(leg[1:] for leg in legs_m)])
    along_m = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(corners_m, axis=0), axis=1)))
    leg_ends_m = along_m[np.cumsum([len(leg) - 1 for leg in legs_m])]
    even_m = np.linspace(0.0, along_m[-1], max(4, round(along_m[-1] / PATH_STEP_M) + 1))
    even = np.stack([np.interp(even_m, along_m, corners_m[:, axis]) for axis in range(2)], axis=1)
    reach = min(len(even) - 1, round(TRUNCATE * PATH_SMOOTHING_M / PATH_STEP_M))
    # Point-reflected ends keep both the end and the direction there.
    before, after = 2.0 * even[0] - even[reach:0:-1], 2.0 * even[-1] - even[-2 : -2 - reach : -1]
    padded = np.concatenate([before, even, after])
    sigma = min(PATH_SMOOTHING_M / (even_m[1] - even_m[0]), reach / TRUNCATE)
    smooth = ndimage.gaussian_filter1d(padded, sigma, axis=0, mode="nearest", truncate=TRUNCATE)
    path_m = smooth[reach : reach + len(even)]
    distance_m = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path_m, axis=0), axis=1)))
    return path_m, distance_m, np.interp(leg_ends_m, even_m, distance_m)


def _curve_speeds(
    direction_rad: Float64[np.ndarray, " L"], distance_m: Float64[np.ndarray, " L"]
) -> Float64[np.ndarray, " L"]:
    """The speed at which each place of a path can be passed."""
    curvature = np.abs(np.gradient(direction_rad, distance_m))
    curvature = np.maximum(ndimage.gaussian_filter1d(curvature, 0.1 / PATH_STEP_M), 1e-6)
    return np.maximum(np.minimum(TURN_RATE_RADPS / curvature, np.sqrt(LATERAL_MPS2 / curvature)), 0.2)


def _reachable(
    limit_mps: Float64[np.ndarray, " L"],
    distance_m: Float64[np.ndarray, " L"],
    acceleration_mps2: Float64[np.ndarray, " L"],
) -> Float64[np.ndarray, " L"]:
    """The highest speeds under the limits between which one can speed up and slow down in time."""
    square = limit_mps**2
    gain = 2.0 * np.diff(distance_m) * np.minimum(acceleration_mps2[1:], acceleration_mps2[:-1])
    for step in range(1, len(square)):
        square[step] = min(square[step], square[step - 1] + gain[step - 1])
    for step in range(len(square) - 2, -1, -1):
        square[step] = min(square[step], square[step + 1] + gain[step])
    return np.sqrt(square)


def _places(ways: list[_Way], travelled_m: Float64[np.ndarray, " T"]) -> Float64[np.ndarray, "T 2"]:
    begin_m = np.append(0.0, np.cumsum([way.distance_m[-1] for way in ways]))
    along_m = np.concatenate([begin + way.distance_m for begin, way in zip(begin_m[:-1], ways, strict=True)])
    path_m = np.concatenate([way.path_m for way in ways])
    return np.stack([np.interp(travelled_m, along_m, path_m[:, axis]) for axis in range(2)], axis=1)
