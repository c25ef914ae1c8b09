"""Random walks: they stay on the floor, move as people do at their pace, get around, and pause at spots."""

import math
from itertools import pairwise

import numpy as np
import pytest

from perpetua.navigation.floor import WalkableFloor
from perpetua.navigation.time_parametrisation import Stop, Stretch, Walk, drive
from perpetua.navigation.types import NavGrid, Spot
from perpetua.navigation.walks import Manner, random_walk

STEP_S = 1 / 24
START_M = np.array([1.0, 1.0])


def floor_with_a_wall(side: int = 41) -> NavGrid:
    """A square with a wall across, open for 1 m at one end; clearance by brute force."""
    cells = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), axis=-1) * 0.1
    obstacle = np.zeros((side, side), bool)
    obstacle[[0, -1]] = obstacle[:, [0, -1]] = True
    obstacle[:-11, side // 2] = True
    blocked = cells[obstacle]
    clearance_m = np.linalg.norm(cells[:, :, None] - blocked, axis=-1).min(-1).astype(np.float32)
    return NavGrid(np.zeros(2), 0.1, np.zeros((side, side), np.float32), clearance_m >= 0.3, clearance_m)


GRID = floor_with_a_wall()
FLOOR = WalkableFloor(GRID)
SPOTS = (
    Spot((0.4, 1.2), math.pi, "look", 3, (0.0, 1.2, 1.5)),
    Spot((2.5, 0.4), -math.pi / 2, "stand", 4, (2.5, 0.0, 0.75)),
    Spot((3.6, 3.0), 0.0, "look", 5, (4.0, 3.0, 1.4)),
)
SEAT = Spot((1.5, 3.5), -math.pi / 2, "sit", 6, (1.5, 3.9, 0.45))


def wander(seed: int, speed_mps: float = 1.15, pause_share: float = 0.3, seats: tuple[Spot, ...] = ()) -> Walk:
    manner = Manner((speed_mps,), (1.0,), pause_share, seats)
    return random_walk(FLOOR, np.random.default_rng(seed), manner, SPOTS, 240, STEP_S, START_M)


def clearance_m(position_m: np.ndarray) -> np.ndarray:
    i, j = np.round((position_m - GRID.origin_m) / GRID.cell_m).astype(int).T
    return GRID.clearance_m[i, j]


def speeds_mps(walk: Walk) -> np.ndarray:
    return np.asarray(np.linalg.norm(np.diff(walk.position_m, axis=0), axis=1) / STEP_S)


def test_ways_go_around_the_wall_and_are_straight_where_they_can_be() -> None:
    here, there = FLOOR.nearest(np.array([0.5, 1.5])), FLOOR.nearest(np.array([0.5, 2.5]))
    ways = FLOOR.ways_from(here)
    assert ways.cost_m[there] > 2 * 2.5
    assert ways.path_m(there)[:, 0].max() > 3.0
    corners_m = ways.straightened_m(there)
    assert len(corners_m) < 12
    assert np.array_equal(corners_m[[0, -1]], FLOOR.points_m[[here, there]])
    line_m = np.concatenate([a + np.linspace(0, 1, 200)[:, None] * (b - a) for a, b in pairwise(corners_m)])
    assert clearance_m(line_m).min() >= 0.3
    oblique = FLOOR.ways_from(FLOOR.nearest(np.array([0.5, 0.5]))).straightened_m(FLOOR.nearest(np.array([3.0, 1.2])))
    length_m = np.linalg.norm(np.diff(oblique, axis=0), axis=1).sum()
    assert length_m == pytest.approx(np.hypot(2.5, 0.7), rel=0.01), "the way follows the grid's directions"


def test_floor_in_parts_is_walked_in_one_of_them() -> None:
    grid = floor_with_a_wall()
    free = grid.free.copy()
    free[:, 18:23] = False
    parts = WalkableFloor(NavGrid(grid.origin_m, grid.cell_m, grid.floor_z_m, free, grid.clearance_m))
    for seed in range(3):
        walk = random_walk(parts, np.random.default_rng(seed), Manner((1.5,), (1.0,), 0.5), SPOTS, 240, STEP_S, START_M)
        assert walk.position_m[:, 1].max() < 1.9


@pytest.mark.parametrize("seed", range(4))
def test_walk_stays_on_the_floor_and_is_neither_fast_nor_idle(seed: int) -> None:
    walk = wander(seed, pause_share=0.0)
    assert clearance_m(walk.position_m).min() > 0.15
    assert speeds_mps(walk).max() < 1.35
    assert 0.25 < speeds_mps(walk).mean() < 1.2
    assert np.ptp(walk.position_m, axis=0).min() > 0.8


@pytest.mark.parametrize("seed", range(4))
def test_walk_faces_where_it_goes_and_turns_slowly(seed: int) -> None:
    walk = wander(seed)
    velocity = np.diff(walk.position_m, axis=0) / STEP_S
    moving = np.linalg.norm(velocity, axis=1) > 0.5
    middle_rad = 0.5 * (walk.heading_rad[1:] + walk.heading_rad[:-1])
    off_rad = np.angle(np.exp(1j * (np.arctan2(velocity[:, 1], velocity[:, 0]) - middle_rad)))
    assert np.abs(off_rad[moving]).max() < 0.5
    assert np.abs(np.diff(walk.heading_rad)).max() / STEP_S < 3.0


def test_paces_differ_and_joggers_cover_two_metres_in_a_second() -> None:
    wide = WalkableFloor(floor_with_a_wall(61))
    fastest = {}
    for speed_mps in (0.75, 1.15, 2.75):
        manner = Manner((speed_mps,), (1.0,), 0.1)
        walks = [random_walk(wide, np.random.default_rng(k), manner, (), 240, STEP_S, START_M) for k in range(4)]
        fastest[speed_mps] = [np.linalg.norm(w.position_m[24:] - w.position_m[:-24], axis=1).max() for w in walks]
        acceleration = [np.linalg.norm(np.diff(w.position_m, n=2, axis=0), axis=1).max() / STEP_S**2 for w in walks]
        assert max(acceleration) < 5.0
    assert max(fastest[0.75]) < 0.9 < 1.0 < max(fastest[1.15]) < 1.35
    assert sum(distance_m > 2.0 for distance_m in fastest[2.75]) >= 3


def test_pauses_stand_quite_still_at_their_spot_and_face_its_target() -> None:
    pauses = [(walk, pause) for walk in map(wander, range(8)) for pause in walk.pauses]
    assert len(pauses) >= 6
    assert {pause.spot.purpose for _, pause in pauses} == {"look", "stand"}
    for walk, pause in pauses:
        still = slice(pause.first_step, pause.last_step + 1)
        assert (pause.last_step - pause.first_step) * STEP_S >= 0.5
        assert np.ptp(walk.position_m[still], axis=0).max() < 1e-9
        assert np.linalg.norm(walk.position_m[pause.first_step] - pause.spot.place_m) < 0.08
        off_rad = np.angle(np.exp(1j * (walk.heading_rad[still] - pause.spot.facing_rad)))
        assert np.abs(off_rad).max() < 1e-6


def test_more_time_is_spent_pausing_where_more_is_wished_for() -> None:
    def standing_fraction(pause_share: float) -> float:
        return float(np.mean([(speeds_mps(wander(seed, pause_share=pause_share)) < 1e-6).mean() for seed in range(6)]))

    assert standing_fraction(0.0) < 0.12 < 0.2 < standing_fraction(0.4) < 0.7


@pytest.mark.parametrize("seed", range(3))
def test_who_is_to_sit_turns_the_back_to_the_seat_for_several_seconds_then_goes_on(seed: int) -> None:
    walk = wander(seed, seats=(SEAT,))
    (sitting,) = [pause for pause in walk.pauses if pause.spot.purpose == "sit"]
    assert (sitting.last_step - sitting.first_step) * STEP_S > 3.0
    assert np.allclose(walk.position_m[sitting.first_step], SEAT.place_m, atol=0.08)
    assert math.cos(walk.heading_rad[sitting.first_step] - SEAT.facing_rad) > 0.999


def test_who_has_no_time_to_go_to_a_seat_is_seated_from_first_to_last() -> None:
    manner = Manner((1.15,), (1.0,), 0.0, (SEAT,))
    walk = random_walk(FLOOR, np.random.default_rng(1), manner, SPOTS, 100, STEP_S, START_M)
    (sitting,) = walk.pauses
    assert sitting.spot == SEAT
    assert (sitting.first_step, sitting.last_step) == (0, 99)
    assert np.ptp(walk.position_m, axis=0).max() < 1e-5


def test_standing_stays_at_one_spot_and_looks_at_what_is_seen_from_there() -> None:
    more = (*SPOTS, Spot(SPOTS[0].place_m, 0.5 * math.pi, "look", 9, (0.4, 4.0, 1.5)))
    walk = random_walk(FLOOR, np.random.default_rng(1), Manner((), (), 0.3), more, 480, STEP_S, np.array([0.5, 1.0]))
    assert np.ptp(walk.position_m, axis=0).max() < 1e-4
    assert {pause.spot.object_index for pause in walk.pauses} == {3, 9}
    assert walk.pauses[0].first_step == 0


def test_drive_slows_down_for_a_curve_and_stops_at_the_end() -> None:
    corner = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0]])
    walk = drive([Stretch((corner[:2], corner[1:]), (2.5, 2.5))], [Stop(None, 0.0)], 120, STEP_S)
    speed_mps = speeds_mps(walk)
    at_corner = int(np.linalg.norm(walk.position_m - corner[1], axis=1).argmin())
    assert speed_mps.max() > 2.2 > 1.5 > speed_mps[at_corner]
    assert np.linalg.norm(walk.position_m[-1] - corner[2]) < 1e-6
    assert walk.heading_rad[0] == pytest.approx(0.0, abs=1e-6) and walk.heading_rad[-1] == pytest.approx(math.pi / 2)


def test_same_stream_same_walk() -> None:
    first, second = wander(9), wander(9)
    assert np.array_equal(first.position_m, second.position_m)
    assert np.array_equal(first.heading_rad, second.heading_rad)
    assert first.pauses == second.pauses
