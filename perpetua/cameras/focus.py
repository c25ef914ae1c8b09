"""Whom each view looks at, and when it turns to somebody else."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.cameras.bodies import ActorBounds
from perpetua.cameras.config import Framing

HANDOVER_S = 1.0
SEGMENT_S = (3.0, 6.0)
PAIR_REACH_M = 2.2
GROUP_REACH_M = 6.0
# How often a view of each framing wishes for one actor, a pair, the group.
GROUPINGS: dict[Framing, tuple[float, float, float]] = {
    "close": (1.0, 0.0, 0.0),
    "medium": (0.7, 0.3, 0.0),
    "wide": (0.25, 0.3, 0.45),
}


@dataclass(frozen=True)
class FocusSegment:
    """From ``start_s`` on the view looks at ``members`` (actor positions in the tuple of actors)."""

    start_s: float
    members: tuple[int, ...]


@dataclass(frozen=True)
class FocusSchedule:
    """One view's segments in order of time; the first starts at 0."""

    segments: tuple[FocusSegment, ...]

    def weights(self, times_s: Float64[np.ndarray, " T"], actors: int) -> Float64[np.ndarray, "T A"]:
        """Share of each actor in the focus (rows sum to 1), with a smooth hand-over between segments."""
        weight = np.zeros((len(times_s), actors))
        weight[:, list(self.segments[0].members)] = 1.0 / len(self.segments[0].members)
        for segment in self.segments[1:]:
            fraction = np.clip((times_s - segment.start_s) / HANDOVER_S + 0.5, 0.0, 1.0)[:, None]
            fraction = fraction * fraction * (3.0 - 2.0 * fraction)
            following = np.zeros(actors)
            following[list(segment.members)] = 1.0 / len(segment.members)
            weight = weight * (1.0 - fraction) + following * fraction
        return weight

    def members(self, times_s: Float64[np.ndarray, " T"], actors: int) -> Bool[np.ndarray, "T A"]:
        """Which actors are in focus; during a hand-over those of both segments."""
        return np.asarray(self.weights(times_s, actors) > 1e-9)


def draw_focus(
    rng: np.random.Generator, bounds: ActorBounds, duration_s: float, first: int, framing: Framing
) -> FocusSchedule:
    """A schedule that starts with actor ``first`` and stays 3 to 6 seconds with each actor, pair or group.

    A pair or the group is taken only while its members are close enough together to fit one image.
    """
    segments: list[FocusSegment] = []
    start_s, leader = 0.0, first
    while True:
        length_s = rng.uniform(*SEGMENT_S)
        # A last segment of under two seconds would only be a flick; it joins the one before.
        length_s = duration_s - start_s if duration_s - start_s - length_s < 2.0 else length_s
        members = _draw_members(rng, bounds, (start_s / duration_s, (start_s + length_s) / duration_s), leader, framing)
        segments.append(FocusSegment(start_s, members))
        start_s += length_s
        if start_s >= duration_s - 1e-9:
            return FocusSchedule(tuple(segments))
        leader = _next_leader(rng, bounds.axis_m.shape[0], leader)


def _next_leader(rng: np.random.Generator, actors: int, leader: int) -> int:
    others = [actor for actor in range(actors) if actor != leader]
    return int(rng.choice(others)) if others else leader


def _draw_members(
    rng: np.random.Generator, bounds: ActorBounds, span: tuple[float, float], leader: int, framing: Framing
) -> tuple[int, ...]:
    actors, times = bounds.axis_m.shape[:2]
    grouping = int(rng.choice(3, p=GROUPINGS[framing]))
    frames = slice(int(span[0] * (times - 1)), int(span[1] * (times - 1)) + 1)
    apart_m = np.linalg.norm(bounds.axis_m[:, frames] - bounds.axis_m[leader, frames], axis=-1).max(axis=1)
    if grouping == 2 and apart_m.max() <= GROUP_REACH_M:
        return tuple(range(actors))
    apart_m[leader] = np.inf
    nearest = int(np.argmin(apart_m))
    if grouping >= 1 and apart_m[nearest] <= PAIR_REACH_M:
        return tuple(sorted((leader, nearest)))
    return (leader,)
