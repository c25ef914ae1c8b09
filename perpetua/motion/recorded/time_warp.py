"""The time warp of a clip along a route: which row of the clip belongs to which time."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.ndimage import gaussian_filter1d

from perpetua.motion.clock import Clock
from perpetua.motion.recorded.reference import ReferenceTrajectory
from perpetua.motion.recorded.retargeted import RetargetedClip
from perpetua.motion.recorded.stances import CLIP_HZ, runs

# A body that stays within this circle for so long stands; a shorter stop is walked on the spot.
_STILL_MPS, _STILL_M, _LEAST_HOLD_S = 0.13, 0.08, 0.7
# Slowest and fastest that a clip runs while the body moves, in its own speed.
_SLOWEST, _FASTEST = 0.5, 1.7
# Longest stride along the heading and across it, in strides of the clip.
_LONGEST_STRIDE, _LONGEST_SIDE_STRIDE = 1.6, 0.22
_HOLD_BLEND_S = 0.5
# Below this speed a step hardly goes ahead, so a foot that has landed need not be put beside the other.
_SLOW_MPS = 0.5
# A body that stops puts its feet together, and one that sets off takes its first step, at this rate of the clip; it
# sets off a little before its path does.
_STEPPING_RATE = 1.2
_SETTING_OFF_S, _FORESIGHT_S = 0.8, 0.25
# Where in the time in which both feet stand a body waits: near its end, so that a step can follow at once.
_WAITS_AT = 0.8


@dataclass(frozen=True)
class TimeWarp:
    """``row`` of the clip at each time, how fast the clip runs, how much the body stands (0 to 1)."""

    row: Float64[np.ndarray, " N"]
    rate: Float64[np.ndarray, " N"]
    stands: Float64[np.ndarray, " N"]


def no_warp(clock: Clock, lead_s: float) -> TimeWarp:
    """A clip that runs as it was made; its first row belongs to ``lead_s`` before the first frame."""
    count = len(clock.time_s)
    return TimeWarp((clock.time_s + lead_s) * CLIP_HZ, np.ones(count), np.zeros(count))


def fit_time_warp(clip: RetargetedClip, reference: ReferenceTrajectory, clock: Clock) -> TimeWarp:
    """The clip's rows for a route: a difference in speed is split between stride length and cadence.

    Stride length and cadence both grow about as the square root of speed (Inman, Ralston, Todd: Human Walking, 1981).
    While the route stays, the clip goes on until both feet have been put beside each other and waits there.
    """
    holds = _holds(reference, clock)
    speeds = np.maximum(clip.speed_mps, 0.3)
    ready = _double_support(clip)
    rate = _rates(reference)
    row, stops = _integrate(clip, rate, speeds, holds, ready, clock)
    return TimeWarp(row, np.gradient(row, clock.step_s) / CLIP_HZ, _standing_weight(stops, clock))


@dataclass(frozen=True)
class _Hold:
    """Ticks from which until which the route stays; ``slow`` is when it had slowed down so far that steps are small."""

    start: int
    end: int
    slow: int


def _holds(reference: ReferenceTrajectory, clock: Clock) -> dict[int, _Hold]:
    """Where the route stays for a while, by the first tick."""
    holds = {}
    slow = runs(reference.speed_mps < _SLOW_MPS)
    for start, end in runs(reference.speed_mps < _STILL_MPS):
        place_m = reference.place_m[start:end, :2]
        near = np.linalg.norm(place_m - place_m[len(place_m) // 2], axis=1).max() < _STILL_M
        if near and (end - start) * clock.step_s >= _LEAST_HOLD_S:
            until = end - round(_FORESIGHT_S / clock.step_s) if end < len(reference.speed_mps) else end
            holds[start] = _Hold(start, until, next(first for first, last in slow if first <= start < last))
    return holds


def _rates(reference: ReferenceTrajectory) -> Float64[np.ndarray, "N 3"]:
    """Terms of the clip's rate at each time that wait for the clip's own speed: see ``_rate``."""
    ahead, aside = np.abs(reference.velocity_mps[:, 0]), np.abs(reference.velocity_mps[:, 1])
    return np.stack([reference.speed_mps, ahead / _LONGEST_STRIDE, aside / _LONGEST_SIDE_STRIDE], axis=1)


def _rate(terms: Float64[np.ndarray, "3"], clip_mps: float) -> float:
    wanted = max(float(np.sqrt(terms[0] / clip_mps)), float(terms[1]) / clip_mps)
    if float(terms[2]) > wanted * clip_mps:
        wanted = max(wanted, min(float(terms[2]) / clip_mps, 1.5))
    return min(max(wanted, _SLOWEST), _FASTEST)


def _double_support(clip: RetargetedClip) -> Float64[np.ndarray, " K"]:
    """Rows at which a body can wait, as both feet stand."""
    return np.array([start + _WAITS_AT * (end - 1 - start) for start, end in runs(clip.standing.all(axis=1))])


def _integrate(
    clip: RetargetedClip,
    terms: Float64[np.ndarray, "N 3"],
    speeds: Float64[np.ndarray, " L"],
    holds: dict[int, _Hold],
    ready: Float64[np.ndarray, " K"],
    clock: Clock,
) -> tuple[Float64[np.ndarray, " N"], list[tuple[int, int]]]:
    """Rows, and the times between which the clip waits."""
    count, last = len(terms), len(clip) - 1
    row, at = np.empty(count), 0.0
    stops: list[tuple[int, int]] = []
    target, release = np.inf, -count
    setting_off = round(_SETTING_OFF_S / clock.step_s)
    for tick in range(count):
        if tick in holds:
            release = holds[tick].end
            target = _stop_row(clip, row[holds[tick].slow] if tick > 0 else None, at, ready)
            at = target if tick == 0 and np.isfinite(target) else at
        if tick >= release:
            target = np.inf
        row[tick] = at
        rate = _rate(terms[tick], float(speeds[min(int(at), last)]))
        steps = np.isfinite(target) or 0 <= tick - release < setting_off
        going_on = max(rate, _STEPPING_RATE) if steps else rate
        following = min(at + going_on * clock.step_s * CLIP_HZ, last)
        if following >= target:
            stops = stops if stops and stops[-1][1] == release else [*stops, (tick, release)]
            following = target
        at = following
    return row, stops


def _stop_row(clip: RetargetedClip, slow: float | None, at: float, ready: Float64[np.ndarray, " K"]) -> float:
    """The double support at which to wait: the first, or that after both feet have landed since row ``slow``."""
    ahead = ready[ready >= at]
    if slow is None:
        return float(ahead[0]) if len(ahead) > 0 else np.inf
    for candidate in ahead:
        since = clip.standing[int(slow) : int(candidate) + 1]
        if (~since[:-1] & since[1:]).any(axis=0).all():
            return float(candidate)
    return np.inf


def _standing_weight(stops: list[tuple[int, int]], clock: Clock) -> Float64[np.ndarray, " N"]:
    """1 while the clip waits, rising and falling softly around."""
    still = np.zeros(len(clock.time_s))
    for start, end in stops:
        still[start:end] = 1.0
    return np.asarray(gaussian_filter1d(still, 0.3 * _HOLD_BLEND_S / clock.step_s, mode="nearest"))


def rows_needed(reference: ReferenceTrajectory, clip: RetargetedClip, clock: Clock) -> float:
    """Most seconds of clip that a route can use."""
    slowest = max(float(np.quantile(clip.speed_mps, 0.1)), 0.3)
    fastest = max(_rate(terms, slowest) for terms in _rates(reference)[::10])
    return float(len(clock.time_s) * clock.step_s * max(fastest, 1.0) + 0.5)
