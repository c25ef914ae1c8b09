"""How fast a tape runs while a body goes along a route: which row of it belongs to which time."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.ndimage import gaussian_filter1d

from perpetua.motion.path import RoutePath
from perpetua.motion.recorded.tape import TAPE_HZ, TURN_RADIUS_M, Tape, runs

FINE_HZ = 120.0
MARGIN_S = 0.8
# A body that stays within this circle for so long stands; a shorter stop is walked on the spot.
_STILL_MPS, _STILL_M, _LEAST_HOLD_S = 0.13, 0.08, 0.7
# Slowest and fastest that a tape runs while the body moves, in its own speed.
_SLOWEST, _FASTEST = 0.5, 1.7
# Longest stride along the heading and across it, in strides of the tape.
_LONGEST_STRIDE, _LONGEST_SIDE_STRIDE = 1.6, 0.22
_HOLD_BLEND_S = 0.5
# Below this speed a step hardly goes ahead, so a foot that has landed need not be put beside the other.
_SLOW_MPS = 0.5
# A body that stops puts its feet together, and one that sets off takes its first step, at this rate of the tape; it
# sets off a little before its path does.
_STEPPING_RATE = 1.2
_SETTING_OFF_S, _FORESIGHT_S = 0.8, 0.25
# Where in the time in which both feet stand a body waits: near its end, so that a step can follow at once.
_WAITS_AT = 0.8


@dataclass(frozen=True)
class Clock:
    """Evenly spaced times around the frames, and where the frames are among them."""

    time_s: Float64[np.ndarray, " N"]
    step_s: float
    at_frames: slice


def make_clock(frames: int, fps: float, before_s: float = MARGIN_S, after_s: float = MARGIN_S) -> Clock:
    """A fine clock that ticks at every frame, from ``before_s`` before the first to ``after_s`` after the last."""
    fine = max(1, int(np.ceil(FINE_HZ / fps)))
    before, after = (int(np.ceil(margin_s * fps - 1e-6)) * fine for margin_s in (before_s, after_s))
    count = (frames - 1) * fine + 1
    time_s = (np.arange(before + count + after) - before) / (fps * fine)
    return Clock(time_s, 1.0 / (fps * fine), slice(before, before + count, fine))


@dataclass(frozen=True)
class Going:
    """Where a body has to be at each time: ``velocity_mps`` in the frame that faces the heading."""

    place_m: Float64[np.ndarray, "N 3"]
    heading_rad: Float64[np.ndarray, " N"]
    velocity_mps: Float64[np.ndarray, "N 2"]
    speed_mps: Float64[np.ndarray, " N"]


def going_along(path: RoutePath, clock: Clock) -> Going:
    """A route at the times of a clock; its speed counts turns on the spot."""
    return _going(path, clock, path.heading_rad(clock.time_s))


def going_facing(path: RoutePath, clock: Clock, tape: Tape, ride: "Ride") -> Going:
    """A route at the times of a clock, facing as the tape does at each."""
    row = np.clip(ride.row, 0.0, len(tape) - 1.0)
    return _going(path, clock, np.interp(row, np.arange(len(tape)), tape.heading_rad))


def _going(path: RoutePath, clock: Clock, heading_rad: Float64[np.ndarray, " N"]) -> Going:
    place_m = path.position_m(clock.time_s)
    soft_m = gaussian_filter1d(place_m[:, :2], 0.08 / clock.step_s, axis=0, mode="nearest")
    world_mps = np.gradient(soft_m, clock.step_s, axis=0)
    ahead, aside = np.cos(heading_rad), np.sin(heading_rad)
    velocity_mps = np.stack(
        [ahead * world_mps[:, 0] + aside * world_mps[:, 1], ahead * world_mps[:, 1] - aside * world_mps[:, 0]], axis=1
    )
    turn_rps = path.turn_rps(clock.time_s)
    speed_mps = np.hypot(np.linalg.norm(velocity_mps, axis=1), TURN_RADIUS_M * turn_rps)
    return Going(place_m, heading_rad, velocity_mps, speed_mps)


@dataclass(frozen=True)
class Ride:
    """``row`` of the tape at each time, how fast the tape runs, how much the body stands (0 to 1)."""

    row: Float64[np.ndarray, " N"]
    rate: Float64[np.ndarray, " N"]
    stands: Float64[np.ndarray, " N"]


def real_time(clock: Clock, lead_s: float) -> Ride:
    """A tape that runs as it was made; its first row belongs to ``lead_s`` before the first frame."""
    count = len(clock.time_s)
    return Ride((clock.time_s + lead_s) * TAPE_HZ, np.ones(count), np.zeros(count))


def ride_along(tape: Tape, going: Going, clock: Clock) -> Ride:
    """The tape's rows for a route: strides and cadence share what the speeds differ by.

    Stride length and cadence both grow about as the square root of speed (Inman, Ralston, Todd: Human Walking, 1981).
    While the route stays, the tape goes on until both feet have been put beside each other and waits there.
    """
    holds = _holds(going, clock)
    speeds = np.maximum(tape.speed_mps, 0.3)
    ready = _double_support(tape)
    rate = _rates(going)
    row, stops = _integrate(tape, rate, speeds, holds, ready, clock)
    return Ride(row, np.gradient(row, clock.step_s) / TAPE_HZ, _standing_share(stops, clock))


@dataclass(frozen=True)
class _Hold:
    """Ticks from which until which the route stays; ``slow`` is when it had slowed down so far that steps are small."""

    start: int
    end: int
    slow: int


def _holds(going: Going, clock: Clock) -> dict[int, _Hold]:
    """Where the route stays for a while, by the first tick."""
    holds = {}
    slow = runs(going.speed_mps < _SLOW_MPS)
    for start, end in runs(going.speed_mps < _STILL_MPS):
        place_m = going.place_m[start:end, :2]
        near = np.linalg.norm(place_m - place_m[len(place_m) // 2], axis=1).max() < _STILL_M
        if near and (end - start) * clock.step_s >= _LEAST_HOLD_S:
            until = end - round(_FORESIGHT_S / clock.step_s) if end < len(going.speed_mps) else end
            holds[start] = _Hold(start, until, next(first for first, last in slow if first <= start < last))
    return holds


def _rates(going: Going) -> Float64[np.ndarray, "N 3"]:
    """Terms of the tape's rate at each time that wait for the tape's own speed: see ``_rate``."""
    ahead, aside = np.abs(going.velocity_mps[:, 0]), np.abs(going.velocity_mps[:, 1])
    return np.stack([going.speed_mps, ahead / _LONGEST_STRIDE, aside / _LONGEST_SIDE_STRIDE], axis=1)


def _rate(terms: Float64[np.ndarray, "3"], tape_mps: float) -> float:
    wanted = max(float(np.sqrt(terms[0] / tape_mps)), float(terms[1]) / tape_mps)
    if float(terms[2]) > wanted * tape_mps:
        wanted = max(wanted, min(float(terms[2]) / tape_mps, 1.5))
    return min(max(wanted, _SLOWEST), _FASTEST)


def _double_support(tape: Tape) -> Float64[np.ndarray, " K"]:
    """Rows at which a body can wait, as both feet stand."""
    return np.array([start + _WAITS_AT * (end - 1 - start) for start, end in runs(tape.standing.all(axis=1))])


def _integrate(
    tape: Tape,
    terms: Float64[np.ndarray, "N 3"],
    speeds: Float64[np.ndarray, " L"],
    holds: dict[int, _Hold],
    ready: Float64[np.ndarray, " K"],
    clock: Clock,
) -> tuple[Float64[np.ndarray, " N"], list[tuple[int, int]]]:
    """Rows, and the times between which the tape waits."""
    count, last = len(terms), len(tape) - 1
    row, at = np.empty(count), 0.0
    stops: list[tuple[int, int]] = []
    target, release = np.inf, -count
    setting_off = round(_SETTING_OFF_S / clock.step_s)
    for tick in range(count):
        if tick in holds:
            release = holds[tick].end
            target = _stop_row(tape, row[holds[tick].slow] if tick > 0 else None, at, ready)
            at = target if tick == 0 and np.isfinite(target) else at
        if tick >= release:
            target = np.inf
        row[tick] = at
        rate = _rate(terms[tick], float(speeds[min(int(at), last)]))
        steps = np.isfinite(target) or 0 <= tick - release < setting_off
        going_on = max(rate, _STEPPING_RATE) if steps else rate
        following = min(at + going_on * clock.step_s * TAPE_HZ, last)
        if following >= target:
            stops = stops if stops and stops[-1][1] == release else [*stops, (tick, release)]
            following = target
        at = following
    return row, stops


def _stop_row(tape: Tape, slow: float | None, at: float, ready: Float64[np.ndarray, " K"]) -> float:
    """The double support at which to wait: the first, or that after both feet have landed since row ``slow``."""
    ahead = ready[ready >= at]
    if slow is None:
        return float(ahead[0]) if len(ahead) > 0 else np.inf
    for candidate in ahead:
        since = tape.standing[int(slow) : int(candidate) + 1]
        if (~since[:-1] & since[1:]).any(axis=0).all():
            return float(candidate)
    return np.inf


def _standing_share(stops: list[tuple[int, int]], clock: Clock) -> Float64[np.ndarray, " N"]:
    """1 while the tape waits, rising and falling softly around."""
    still = np.zeros(len(clock.time_s))
    for start, end in stops:
        still[start:end] = 1.0
    return np.asarray(gaussian_filter1d(still, 0.3 * _HOLD_BLEND_S / clock.step_s, mode="nearest"))


def rows_needed(going: Going, tape: Tape, clock: Clock) -> float:
    """Most seconds of tape that a route can use."""
    slowest = max(float(np.quantile(tape.speed_mps, 0.1)), 0.3)
    fastest = max(_rate(terms, slowest) for terms in _rates(going)[::10])
    return float(len(clock.time_s) * clock.step_s * max(fastest, 1.0) + 0.5)
