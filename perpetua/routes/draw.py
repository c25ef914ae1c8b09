"""Random walks for roles: at their paces, seated where they ask for it, and out of each other's way."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.navigation.floor import WalkableFloor
from perpetua.navigation.time_parametrisation import Walk
from perpetua.navigation.types import Spot
from perpetua.navigation.walks import SEAT_WAY_M, Manner, random_walk
from perpetua.routes.casting import Role
from perpetua.routes.config import RoutesConfig
from perpetua.scene.actor import Seat
from perpetua.seeding import StageSeed

# Of this many walks, the one that keeps clear of the other actors best and gets its pace is taken.
WALKS_PER_ACTOR = 10
STARTS = 48
# Someone who is about to sit down stands so far before the middle of the seat, on free floor within a tolerance.
BEFORE_SEAT_M = 0.45
SEAT_TOLERANCE_M = 0.25
BETWEEN_SITTERS_M = 1.0
# Of the paces of a role without stated paces, neighbours are gone at for this share of the legs.
CHANGE_FRACTION = 0.3
# Someone who walks and stands pauses so much more.
STANDING_FACTOR = 2.0
MOVING_PACES = ("stroll", "walk", "brisk", "jog")


@dataclass(frozen=True)
class Stage:
    """Where walks are drawn: the floor, its spots, seats that can be reached, and the time."""

    floor: WalkableFloor
    spots: tuple[Spot, ...]
    seats: tuple[Spot, ...]
    steps: int
    step_s: float


def seat_spots(seats: tuple[Seat, ...], floor: WalkableFloor) -> tuple[Spot, ...]:
    """Where to stand before sitting down, for every seat with free floor there."""
    spots = []
    for seat in seats:
        ahead = np.array([math.cos(seat.facing_rad), math.sin(seat.facing_rad)])
        wanted_m = np.array(seat.middle_m[:2]) + BEFORE_SEAT_M * ahead
        place_m = floor.points_m[floor.nearest(wanted_m)]
        if np.linalg.norm(place_m - wanted_m) <= SEAT_TOLERANCE_M:
            place = (float(place_m[0]), float(place_m[1]))
            spots.append(Spot(place, seat.facing_rad, "sit", seat.object_index, seat.middle_m, seat))
    return tuple(spots)


def highest_speed_mps(role: Role, config: RoutesConfig) -> float:
    """The typical speed of a role's fastest pace; that of strolling for someone who stands."""
    return max(_speed_mps(pace, config) for pace in role.paces)


def draw_walk(
    stage: Stage, role: Role, config: RoutesConfig, others: list[Walk], seed: StageSeed, actor: int, attempt: int
) -> Walk:
    """Of several walks the one that others' walks disturb least and that keeps up its pace."""
    rng = seed.stream("walk", actor, attempt)
    manner = _manner(stage, role, config, others)
    best_cost, best = math.inf, None
    for _ in range(WALKS_PER_ACTOR):
        start_m = _start(stage.floor, rng, manner.seats, others)
        walk = random_walk(stage.floor, rng, manner, stage.spots, stage.steps, stage.step_s, start_m)
        cost = _crowding(walk, others, config.separation_m) + _slowness(walk, manner, stage.step_s)
        if best is None or cost < best_cost:
            best_cost, best = cost, walk
    assert best is not None
    return best


def _speed_mps(pace: str, config: RoutesConfig) -> float:
    return float(getattr(config.speeds, "stroll" if pace == "stand" else pace))


def _manner(stage: Stage, role: Role, config: RoutesConfig, others: list[Walk]) -> Manner:
    """A role in figures: its paces and their neighbours, its pauses, and the seats that nobody else sits on."""
    taken_m = [pause.spot.place_m for walk in others for pause in walk.pauses if pause.spot.purpose == "sit"]
    seats = tuple(
        seat
        for seat in stage.seats
        if role.sits and all(math.dist(seat.place_m, place_m) >= BETWEEN_SITTERS_M for place_m in taken_m)
    )
    paces = [pace for pace in role.paces if pace != "stand"]
    if not paces and seats:
        paces = ["stroll"]
    fractions = [1.0] * len(paces)
    if len(paces) == 1 and paces[0] != "jog":
        place = MOVING_PACES.index(paces[0])
        # Nobody breaks into a run on the way.
        neighbours = [MOVING_PACES[near] for near in (place - 1, place + 1) if 0 <= near < len(MOVING_PACES) - 1]
        fractions = [1.0 - CHANGE_FRACTION] + [CHANGE_FRACTION / len(neighbours)] * len(neighbours)
        paces += neighbours
    factor = STANDING_FACTOR if "stand" in role.paces else 1.0
    speeds_mps = tuple(_speed_mps(pace, config) for pace in paces)
    return Manner(speeds_mps, tuple(fractions), min(0.9, factor * config.pause_share), seats)


def _start(
    floor: WalkableFloor, rng: np.random.Generator, seats: tuple[Spot, ...], others: list[Walk]
) -> Float64[np.ndarray, "2"]:
    """A random place, far from where others start, and a short way from a seat for someone who is to sit down."""
    places_m = floor.points_m[rng.integers(len(floor.points_m), size=STARTS)]
    scores = rng.uniform(0.6, 1.0, size=STARTS)
    if others:
        taken_m = np.stack([walk.position_m[0] for walk in others])
        scores = scores * np.linalg.norm(places_m[:, None] - taken_m, axis=2).min(1)
    if seats:
        seats_m = np.array([seat.place_m for seat in seats])
        away_m = np.linalg.norm(places_m[:, None] - seats_m, axis=2).min(1)
        scores = np.where((away_m >= SEAT_WAY_M[0]) & (away_m <= SEAT_WAY_M[1]), scores, 0.1 * scores)
    return places_m[int(scores.argmax())]


def _crowding(walk: Walk, others: list[Walk], separation_m: float) -> float:
    """How deep and how long a walk cuts into the space around others' walks."""
    wanted_m = 1.5 * separation_m
    overlaps = [
        np.square(np.maximum(1.0 - np.linalg.norm(walk.position_m - other.position_m, axis=1) / wanted_m, 0.0)).mean()
        for other in others
    ]
    return 40.0 * float(sum(overlaps))


def _slowness(walk: Walk, manner: Manner, step_s: float) -> float:
    """How much shorter the way is than at a steady pace, as a share, but for the pauses that are wished for."""
    if not manner.speeds_mps:
        return 0.0
    travelled_m = float(np.linalg.norm(np.diff(walk.position_m, axis=0), axis=1).sum())
    wished_mps = float(np.average(manner.speeds_mps, weights=manner.fractions)) * (1.0 - manner.pause_share)
    return max(0.0, 1.0 - travelled_m / (wished_mps * step_s * len(walk.position_m)))
