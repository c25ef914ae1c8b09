"""The action timeline: each action begins, is held, ends and begins again, with random times and sizes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.motion.actions import DescribedMotion
from perpetua.motion.rotations import smoothstep
from perpetua.motion.vocabulary import ALWAYS, Action

# The first bout begins within this fraction of a hold and a pause.
_FIRST_WITHIN = 0.6
# An idle head turns this far to either side.
_IDLE_WANDER_RAD = 0.12


@dataclass(frozen=True)
class TimedAction:
    """One action over time: ``weight`` is how much of it is done (0 to 1); beats run from -1 to 1, for each hand."""

    action: Action
    weight: Float64[np.ndarray, " N"]
    left_beat: Float64[np.ndarray, " N"]
    right_beat: Float64[np.ndarray, " N"]


@dataclass(frozen=True)
class ActionTimeline:
    """What all actions ask of arms, trunk and head over time; see ``Move`` for the meaning of each array."""

    actions: tuple[TimedAction, ...]
    lean_rad: Float64[np.ndarray, " N"]
    turn_rad: Float64[np.ndarray, " N"]
    sway_rad: Float64[np.ndarray, " N"]
    shrug_rad: Float64[np.ndarray, " N"]
    drop: Float64[np.ndarray, " N"]
    head_pitch_rad: Float64[np.ndarray, " N"]
    head_turn_rad: Float64[np.ndarray, " N"]
    head_tilt_rad: Float64[np.ndarray, " N"]
    wander_rad: Float64[np.ndarray, " N"]


def draw_timeline(
    described: DescribedMotion,
    stillness: Float64[np.ndarray, " N"],
    seated: Float64[np.ndarray, " N"],
    time_s: Float64[np.ndarray, " N"],
    rng: np.random.Generator,
) -> ActionTimeline:
    """When each described action is done.

    Args:
        described: the actions meant.
        stillness: from 0 (going) to 1 (standing).
        seated: from 0 (on the feet) to 1 (sitting): the whole body's and two-handed actions wait until it is over.
        time_s: evenly spaced times.
        rng: draws when actions come and go.
    """
    actions = tuple(_draw_action(action, stillness, seated, time_s, rng) for action in described.actions)
    beats = [(timed.action.move, timed.weight, _beat(timed.action.move.hz, 0.0, time_s, rng)) for timed in actions]

    def summed(*parts: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
        return np.asarray(np.sum([np.zeros(len(time_s)), *parts], axis=0))

    return ActionTimeline(
        actions,
        described.lean_rad + summed(*(move.lean * weight for move, weight, _ in beats)),
        summed(*(move.turn * weight for move, weight, _ in beats)),
        summed(*(move.sway * weight * beat for move, weight, beat in beats)),
        summed(*(move.shrug * weight for move, weight, _ in beats)),
        summed(*(weight * (move.drop + move.bounce * (1.0 + beat**2)) for move, weight, beat in beats)),
        summed(*(weight * (move.head_pitch + move.nod * beat) for move, weight, beat in beats)),
        summed(*(weight * (move.head_turn + move.shake * beat) for move, weight, beat in beats)),
        summed(*(move.head_tilt * weight for move, weight, _ in beats)),
        _IDLE_WANDER_RAD + summed(*(move.wander * weight for move, weight, _ in beats)),
    )


def _draw_action(
    action: Action,
    stillness: Float64[np.ndarray, " N"],
    seated: Float64[np.ndarray, " N"],
    time_s: Float64[np.ndarray, " N"],
    rng: np.random.Generator,
) -> TimedAction:
    weight = _bouts(action, time_s, rng)
    if action.standing:
        weight = weight * smoothstep((stillness - 0.55) / 0.4)
    if action.standing or (action.left is not None and action.right is not None):
        weight = weight * (1.0 - seated)
    poses = (action.left, action.right)
    phase = float(rng.uniform())
    beats = [
        np.zeros(len(time_s))
        if pose is None
        else _beat(pose.swing_hz, phase + (pose.lag if side == 0 else 0.0), time_s, rng)
        for side, pose in enumerate(poses)
    ]
    return TimedAction(action, weight, beats[0], beats[1])


def _bouts(action: Action, time_s: Float64[np.ndarray, " N"], rng: np.random.Generator) -> Float64[np.ndarray, " N"]:
    """From 0 to 1 and back, again and again; 1 throughout where an action is held for good."""
    if action.hold_s == ALWAYS:
        return np.ones(len(time_s))
    weight = np.zeros(len(time_s))
    period_s = action.hold_s[0] + action.pause_s[0] + 2.0 * action.rise_s
    start_s = float(time_s[0]) + float(rng.uniform(-0.3, _FIRST_WITHIN)) * period_s
    while start_s < time_s[-1]:
        rise_s, fall_s = action.rise_s * rng.uniform(0.9, 1.15, 2)
        hold_s = float(rng.uniform(*action.hold_s))
        height = float(rng.uniform(0.92, 1.0))
        rising = smoothstep((time_s - start_s) / rise_s)
        falling = smoothstep((time_s - start_s - rise_s - hold_s) / (1.15 * fall_s))
        weight = np.maximum(weight, height * rising * (1.0 - falling))
        start_s += rise_s + hold_s + fall_s + float(rng.uniform(*action.pause_s))
    return weight


def _beat(
    hz: float, phase: float, time_s: Float64[np.ndarray, " N"], rng: np.random.Generator
) -> Float64[np.ndarray, " N"]:
    """A wave between -1 and 1 whose pace and size change a little, as no person keeps time."""
    drift, swell = rng.uniform(0.0, 2.0 * np.pi, 2)
    wobble = 0.09 * np.sin(2.0 * np.pi * 0.23 * time_s + drift)
    size = 0.88 + 0.12 * np.sin(2.0 * np.pi * 0.31 * time_s + swell)
    return (
        np.asarray(size * np.sin(2.0 * np.pi * (hz * time_s + phase + wobble))) if hz > 0.0 else np.zeros(len(time_s))
    )
