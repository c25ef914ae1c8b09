"""Actions over time: each begins, is kept up, is left off and comes again, never twice alike."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.motion.actions import Performance
from perpetua.motion.rotations import smoothstep
from perpetua.motion.vocabulary import ALWAYS, Action

# The first bout begins within this share of a hold and a pause.
_FIRST_WITHIN = 0.6
# An idle head turns this far to either side.
_IDLE_WANDER_RAD = 0.12


@dataclass(frozen=True)
class Act:
    """One action over time: how much of it is done (0 to 1), and where its beat is (-1 to 1), for each hand."""

    action: Action
    share: Float64[np.ndarray, " N"]
    left_beat: Float64[np.ndarray, " N"]
    right_beat: Float64[np.ndarray, " N"]


@dataclass(frozen=True)
class Score:
    """What all actions ask of arms, trunk and head over time; see ``Move`` for the meaning of each array."""

    acts: tuple[Act, ...]
    lean_rad: Float64[np.ndarray, " N"]
    turn_rad: Float64[np.ndarray, " N"]
    sway_rad: Float64[np.ndarray, " N"]
    shrug_rad: Float64[np.ndarray, " N"]
    drop: Float64[np.ndarray, " N"]
    head_pitch_rad: Float64[np.ndarray, " N"]
    head_turn_rad: Float64[np.ndarray, " N"]
    head_tilt_rad: Float64[np.ndarray, " N"]
    wander_rad: Float64[np.ndarray, " N"]


def draw_score(
    performance: Performance,
    stillness: Float64[np.ndarray, " N"],
    seated: Float64[np.ndarray, " N"],
    time_s: Float64[np.ndarray, " N"],
    rng: np.random.Generator,
) -> Score:
    """The actions of a performance over time.

    Args:
        performance: what is meant.
        stillness: from 0 (going) to 1 (standing).
        seated: from 0 (on the feet) to 1 (sitting): the whole body's and two-handed actions wait until it is over.
        time_s: evenly spaced times.
        rng: draws when actions come and go.
    """
    acts = tuple(_draw_act(action, stillness, seated, time_s, rng) for action in performance.actions)
    beats = [(act.action.move, act.share, _beat(act.action.move.hz, 0.0, time_s, rng)) for act in acts]

    def summed(*parts: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
        return np.asarray(np.sum([np.zeros(len(time_s)), *parts], axis=0))

    return Score(
        acts,
        performance.lean_rad + summed(*(move.lean * share for move, share, _ in beats)),
        summed(*(move.turn * share for move, share, _ in beats)),
        summed(*(move.sway * share * beat for move, share, beat in beats)),
        summed(*(move.shrug * share for move, share, _ in beats)),
        summed(*(share * (move.drop + move.bounce * (1.0 + beat**2)) for move, share, beat in beats)),
        summed(*(share * (move.head_pitch + move.nod * beat) for move, share, beat in beats)),
        summed(*(share * (move.head_turn + move.shake * beat) for move, share, beat in beats)),
        summed(*(move.head_tilt * share for move, share, _ in beats)),
        _IDLE_WANDER_RAD + summed(*(move.wander * share for move, share, _ in beats)),
    )


def _draw_act(
    action: Action,
    stillness: Float64[np.ndarray, " N"],
    seated: Float64[np.ndarray, " N"],
    time_s: Float64[np.ndarray, " N"],
    rng: np.random.Generator,
) -> Act:
    share = _bouts(action, time_s, rng)
    if action.standing:
        share = share * smoothstep((stillness - 0.55) / 0.4)
    if action.standing or (action.left is not None and action.right is not None):
        share = share * (1.0 - seated)
    poses = (action.left, action.right)
    phase = float(rng.uniform())
    beats = [
        np.zeros(len(time_s))
        if pose is None
        else _beat(pose.swing_hz, phase + (pose.lag if side == 0 else 0.0), time_s, rng)
        for side, pose in enumerate(poses)
    ]
    return Act(action, share, beats[0], beats[1])


def _bouts(action: Action, time_s: Float64[np.ndarray, " N"], rng: np.random.Generator) -> Float64[np.ndarray, " N"]:
    """From 0 to 1 and back, again and again; 1 throughout where an action is held for good."""
    if action.hold_s == ALWAYS:
        return np.ones(len(time_s))
    share = np.zeros(len(time_s))
    period_s = action.hold_s[0] + action.pause_s[0] + 2.0 * action.rise_s
    start_s = float(time_s[0]) + float(rng.uniform(-0.3, _FIRST_WITHIN)) * period_s
    while start_s < time_s[-1]:
        rise_s, fall_s = action.rise_s * rng.uniform(0.9, 1.15, 2)
        hold_s = float(rng.uniform(*action.hold_s))
        height = float(rng.uniform(0.92, 1.0))
        rising = smoothstep((time_s - start_s) / rise_s)
        falling = smoothstep((time_s - start_s - rise_s - hold_s) / (1.15 * fall_s))
        share = np.maximum(share, height * rising * (1.0 - falling))
        start_s += rise_s + hold_s + fall_s + float(rng.uniform(*action.pause_s))
    return share


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
