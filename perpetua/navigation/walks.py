"""Random walks on the free floor: how a person might wander, pause and look in a room.

A walk is a chain of legs between targets. Targets are drawn on floor that has been visited little, without sharp
turns on the way and as far as the pace asks for; now and then the target is a spot worth a pause.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float64
from scipy.spatial import KDTree

from perpetua.navigation.floor import WalkableFloor, Ways
from perpetua.navigation.time_parametrisation import SMOOTHING_S, TRUNCATE, Stop, Stretch, Walk, drive, turn_s
from perpetua.navigation.types import Spot

CANDIDATES = 24
NOVELTY_M = 1.5
SHARP_TURN_RAD = 1.9
MIN_LEG_M = 0.8
NO_WAY_M = 1e-6
# The length of a leg that suits a pace: seconds at its speed, within limits.
LEG_S, LEG_RANGE_M = 2.4, (1.8, 6.0)
# From this speed on, a straight way counts.
FAST_MPS = 1.9
LOOKING_S = (1.8, 4.0)
STANDING_S = (2.5, 5.0)
SITTING_S = (4.5, 7.5)
# Time to get up and go, if the sequence is long enough for it.
AFTER_SITTING_S = 2.5
# Sequences shorter than this leave no time to go to a seat and sit: one is seated all the time.
SECONDS_TO_SIT_DOWN = 6.0
SEAT_WAY_M = (0.8, 3.0)


@dataclass(frozen=True)
class Manner:
    """How a person gets about.

    ``speeds_mps`` are the paces that legs are walked at, drawn by ``fractions``; none: the person stays at its start.
    ``pause_share`` is the share of time spent pausing. ``seats``: sit down on one of them first.
    """

    speeds_mps: tuple[float, ...]
    fractions: tuple[float, ...]
    pause_share: float
    seats: tuple[Spot, ...] = ()


@dataclass(frozen=True)
class _Leg:
    path_m: Float64[np.ndarray, "K 2"]
    end: int
    spot: Spot | None


class _Spots:
    """Spots, and the free cell nearest to each."""

    def __init__(self, floor: WalkableFloor, spots: tuple[Spot, ...]) -> None:
        self.spots = spots
        self.cell = np.array([floor.nearest(np.array(spot.place_m)) for spot in spots], int)
        self.place_m = np.array([spot.place_m for spot in spots]).reshape(-1, 2)

    def near(self, place_m: Float64[np.ndarray, "2"], rng: np.random.Generator) -> int:
        """One of the spots at the place that is nearest to another."""
        away_m = np.linalg.norm(self.place_m - place_m, axis=1)
        return int(rng.choice(np.flatnonzero(away_m <= away_m.min() + 1e-9)))


def random_walk(
    floor: WalkableFloor,
    rng: np.random.Generator,
    manner: Manner,
    spots: tuple[Spot, ...],
    steps: int,
    step_s: float,
    start_m: Float64[np.ndarray, "2"],
) -> Walk:
    """A walk from a place on the floor.

    Args:
        floor: where the walk stays.
        rng: all randomness.
        manner: paces, pauses, and seats to sit on.
        spots: where pauses are made.
        steps: places of the walk.
        step_s: seconds between two of them.
        start_m: where it starts; the nearest free cell is taken.
    """
    seconds, start = steps * step_s, floor.nearest(start_m)
    if manner.seats and seconds < SECONDS_TO_SIT_DOWN:
        seat = min(manner.seats, key=lambda spot: math.dist(spot.place_m, start_m))
        return drive(
            [_no_way(np.array(seat.place_m), seat.facing_rad)], [Stop(seat, 2.0 * seconds + 2.0)], steps, step_s
        )
    if not manner.speeds_mps or _reach_m(floor.ways_from(start)) < MIN_LEG_M:
        return _stand(floor, rng, spots, start, steps, step_s)
    stretches, stops = _wander(floor, rng, manner, _Spots(floor, spots), seconds, start)
    return drive(stretches, stops, steps, step_s)


def _stand(
    floor: WalkableFloor, rng: np.random.Generator, spots: tuple[Spot, ...], start: int, steps: int, step_s: float
) -> Walk:
    """Standing at the spot nearest to the start, and looking from there at one object after the other."""
    place_m = floor.points_m[start]
    if spots:
        place_m = np.array(spots[_Spots(floor, spots).near(place_m, rng)].place_m)
    here = [spot for spot in spots if np.allclose(spot.place_m, place_m)]
    order = rng.permutation(len(here))
    facing_rad = here[order[0]].facing_rad if here else float(rng.uniform(-np.pi, np.pi))
    stop_count = int(np.ceil(steps * step_s / STANDING_S[0])) + 1
    seen = [here[order[number % len(here)]] if here else None for number in range(stop_count)]
    facings_rad = [facing_rad if spot is None else spot.facing_rad for spot in seen]
    stretches = [_no_way(place_m, facing) for facing in facings_rad]
    stops = [Stop(spot, float(rng.uniform(*STANDING_S))) for spot in seen]
    return drive(stretches, stops, steps, step_s)


def _no_way(place_m: Float64[np.ndarray, "2"], facing_rad: float) -> Stretch:
    """A way of no length, as far as one can tell: it says where a person faces before it stops."""
    ahead_m = NO_WAY_M * np.array([np.cos(facing_rad), np.sin(facing_rad)])
    return Stretch((np.stack([place_m, place_m + ahead_m]),), (1.0,))


def _wander(
    floor: WalkableFloor, rng: np.random.Generator, manner: Manner, spots: _Spots, seconds: float, start: int
) -> tuple[list[Stretch], list[Stop]]:
    """Stretches and the stops that end them, long enough for the time."""
    seats = manner.seats
    stretches: list[Stretch] = []
    stops: list[Stop] = []
    if not seats and rng.uniform() < manner.pause_share and len(spots.cell):
        # A walk is cut out of a longer one: it may begin amid a pause.
        first = spots.near(floor.points_m[start], rng)
        stretches.append(_no_way(np.array(spots.spots[first].place_m), spots.spots[first].facing_rad))
        stops.append(Stop(spots.spots[first], float(rng.uniform(0.3, 1.0)) * LOOKING_S[1]))
        start = int(spots.cell[first])
    legs: list[_Leg] = []
    speeds: list[float] = []
    visited_m = [floor.points_m[[start]]]
    here, elapsed_s, arrival_rad = start, sum(stop.looking_s for stop in stops), None
    fractions = np.array(manner.fractions) / np.sum(manner.fractions)
    # More than enough time, since what is reckoned here leaves out slow curves.
    while elapsed_s < 1.2 * seconds + 2.0:
        speed_mps = float(rng.choice(manner.speeds_mps, p=fractions)) * float(
            np.clip(rng.normal(1.0, 0.07), 0.85, 1.12)
        )
        pauses = bool(rng.uniform() < _pause_chance(manner, speed_mps))
        ways = floor.ways_from(here)
        leg = _leg_to_seat(floor, ways, seats) if seats else None
        if leg is None:
            leg = _next_leg(floor, rng, ways, speed_mps, arrival_rad, np.concatenate(visited_m), spots, pauses)
        seats = ()
        departure_rad = _direction(leg.path_m[:2])
        if arrival_rad is not None and abs(_turn_rad(arrival_rad, departure_rad)) > SHARP_TURN_RAD:
            stretches.append(Stretch(tuple(each.path_m for each in legs), tuple(speeds)))
            stops.append(Stop(None, 0.0))
            elapsed_s += turn_s(arrival_rad, departure_rad)
            legs, speeds = [], []
        legs.append(leg)
        speeds.append(speed_mps)
        visited_m.append(_dense(leg.path_m))
        elapsed_s += _length_m(leg.path_m) / speed_mps + 0.3
        here, arrival_rad = leg.end, _direction(leg.path_m[-2:])
        if leg.spot is not None:
            left_s = seconds - elapsed_s - turn_s(arrival_rad, leg.spot.facing_rad)
            stops.append(Stop(leg.spot, _pause_s(leg.spot, rng, left_s)))
            stretches.append(Stretch(tuple(each.path_m for each in legs), tuple(speeds)))
            elapsed_s += stops[-1].looking_s + turn_s(arrival_rad, leg.spot.facing_rad)
            legs, speeds, arrival_rad = [], [], None
    if legs:
        stretches.append(Stretch(tuple(each.path_m for each in legs), tuple(speeds)))
        stops.append(Stop(None, 0.0))
    return stretches, stops


def _pause_chance(manner: Manner, speed_mps: float) -> float:
    """How often a leg must end in a pause for pauses to take their share of time."""
    leg_s = _ideal_leg_m(speed_mps) / speed_mps + 1.0
    pause_s = 0.5 * sum(LOOKING_S) - 2.0 * TRUNCATE * SMOOTHING_S
    return min(1.0, manner.pause_share / max(1.0 - manner.pause_share, 1e-6) * leg_s / pause_s)


def _pause_s(spot: Spot, rng: np.random.Generator, left_s: float) -> float:
    if spot.purpose != "sit":
        return float(rng.uniform(*(STANDING_S if spot.purpose == "stand" else LOOKING_S)))
    return float(
        np.clip(rng.uniform(*SITTING_S), min(SITTING_S[0], left_s), max(left_s - AFTER_SITTING_S, SITTING_S[0]))
    )


def _ideal_leg_m(speed_mps: float) -> float:
    return float(np.clip(LEG_S * speed_mps, *LEG_RANGE_M))


def _leg_to_seat(floor: WalkableFloor, ways: Ways, seats: tuple[Spot, ...]) -> _Leg | None:
    """The way to the nearest seat that can be reached."""
    cells = [floor.nearest(np.array(seat.place_m)) for seat in seats]
    costs = ways.cost_m[cells]
    nearest = int(costs.argmin())
    if not np.isfinite(costs[nearest]) or cells[nearest] == ways.start:
        return None
    return _Leg(ways.straightened_m(cells[nearest]), cells[nearest], seats[nearest])


def _next_leg(
    floor: WalkableFloor,
    rng: np.random.Generator,
    ways: Ways,
    speed_mps: float,
    direction_rad: float | None,
    visited_m: Float64[np.ndarray, "V 2"],
    spots: _Spots,
    pauses: bool,
) -> _Leg:
    """The best of some random targets: unvisited, far enough for the pace, ahead; a spot where a pause is planned."""
    chosen = rng.integers(len(spots.cell), size=CANDIDATES) if pauses and len(spots.cell) else None
    targets = rng.integers(len(floor.points_m), size=CANDIDATES) if chosen is None else spots.cell[chosen]
    cost_m = ways.cost_m[targets]
    novelty = np.minimum(KDTree(visited_m).query(floor.points_m[targets])[0], NOVELTY_M) / NOVELTY_M
    ideal_m = _ideal_leg_m(speed_mps)
    # Too long is half as bad as too short.
    misfit = np.maximum(1.0 - cost_m / ideal_m, np.minimum(0.5 * (cost_m / ideal_m - 1.0), 1.0))
    scores = novelty - (1.0 + 0.5 * speed_mps) * misfit
    scores += 0.4 * rng.uniform(size=CANDIDATES)
    reachable = np.isfinite(cost_m) & (cost_m >= MIN_LEG_M)
    if not reachable.any():
        targets, chosen = np.array([np.where(np.isfinite(ways.cost_m), ways.cost_m, -1.0).argmax()]), None
        scores, reachable, cost_m = np.zeros(1), np.ones(1, bool), ways.cost_m[targets]
    best_score, best = -np.inf, 0
    for index in np.flatnonzero(reachable):
        path_m = ways.path_m(int(targets[index]))
        score = float(scores[index])
        if direction_rad is not None:
            score -= 0.9 * abs(_turn_rad(direction_rad, _direction(path_m[: min(6, len(path_m))])))
        if speed_mps >= FAST_MPS:
            score += 1.5 * float(np.hypot(*(path_m[-1] - path_m[0]))) / float(cost_m[index])
        if score > best_score:
            best_score, best = score, int(index)
    target = int(targets[best])
    return _Leg(ways.straightened_m(target), target, None if chosen is None else spots.spots[chosen[best]])


def _reach_m(ways: Ways) -> float:
    return float(ways.cost_m[np.isfinite(ways.cost_m)].max())


def _dense(path_m: Float64[np.ndarray, "K 2"]) -> Float64[np.ndarray, "V 2"]:
    """Places along straight lines, close enough to tell what has been visited."""
    pieces = [
        a + np.linspace(0.0, 1.0, max(2, int(np.hypot(*(b - a)) / 0.2)))[:, None] * (b - a) for a, b in pairwise(path_m)
    ]
    return np.concatenate(pieces)


def _length_m(path_m: Float64[np.ndarray, "K 2"]) -> float:
    return float(np.linalg.norm(np.diff(path_m, axis=0), axis=1).sum())


def _direction(path_m: Float64[np.ndarray, "K 2"]) -> float:
    x, y = path_m[-1] - path_m[0]
    return float(np.arctan2(y, x))


def _turn_rad(first_rad: float, second_rad: float) -> float:
    return float(np.angle(np.exp(1j * (second_rad - first_rad))))
