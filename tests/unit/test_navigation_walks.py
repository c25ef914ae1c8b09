"""Random walks: they stay on the floor, move as people do, and get around."""

import numpy as np
import pytest

from perpetua.navigation.types import NavGrid
from perpetua.navigation.walks import Pace, WalkableFloor, random_walk

STEP_S = 1 / 12
PACE = Pace(1.1, 0.25)


def floor_with_a_wall() -> NavGrid:
    """4 m x 4 m with a wall across, open for 1 m at one end; clearance by brute force."""
    cells = np.stack(np.meshgrid(np.arange(41), np.arange(41), indexing="ij"), axis=-1) * 0.1
    obstacle = np.zeros((41, 41), bool)
    obstacle[[0, -1]] = obstacle[:, [0, -1]] = True
    obstacle[:30, 20] = True
    blocked = cells[obstacle]
    clearance_m = np.linalg.norm(cells[:, :, None] - blocked, axis=-1).min(-1).astype(np.float32)
    return NavGrid(np.zeros(2), 0.1, np.zeros((41, 41), np.float32), clearance_m >= 0.3, clearance_m)


GRID = floor_with_a_wall()
FLOOR = WalkableFloor(GRID)


def clearance_m(position_m: np.ndarray) -> np.ndarray:
    i, j = np.round((position_m - GRID.origin_m) / GRID.cell_m).astype(int).T
    return GRID.clearance_m[i, j]


def test_geodesic_cost_goes_around_the_wall() -> None:
    here, there = FLOOR.nearest(np.array([0.5, 1.5])), FLOOR.nearest(np.array([0.5, 2.5]))
    cost, before = FLOOR.paths_from(here)
    assert cost[there] > 2 * 2.5
    cell, visited = there, []
    while cell != here:
        visited.append(FLOOR.points_m[cell])
        cell = int(before[cell])
    assert max(place[0] for place in visited) > 3.0


@pytest.mark.parametrize("seed", range(4))
def test_walk_stays_on_the_floor_and_is_neither_fast_nor_idle(seed: int) -> None:
    walk = random_walk(FLOOR, np.random.default_rng(seed), PACE, 240, STEP_S, np.array([1.0, 1.0]))
    assert clearance_m(walk.position_m).min() > 0.15
    speed_mps = np.linalg.norm(np.diff(walk.position_m, axis=0), axis=1) / STEP_S
    assert speed_mps.max() < 1.75
    assert 0.35 < speed_mps.mean() < 1.3
    assert np.ptp(walk.position_m, axis=0).min() > 1.0


@pytest.mark.parametrize("seed", range(4))
def test_walk_faces_where_it_goes_and_turns_slowly(seed: int) -> None:
    walk = random_walk(FLOOR, np.random.default_rng(seed), PACE, 240, STEP_S, np.array([1.0, 1.0]))
    velocity = np.diff(walk.position_m, axis=0) / STEP_S
    moving = np.linalg.norm(velocity, axis=1) > 0.6
    middle_rad = 0.5 * (walk.heading_rad[1:] + walk.heading_rad[:-1])
    off_rad = np.angle(np.exp(1j * (np.arctan2(velocity[:, 1], velocity[:, 0]) - middle_rad)))
    assert np.abs(off_rad[moving]).max() < 0.8
    assert np.abs(np.diff(walk.heading_rad)).max() / STEP_S < 4.0


def test_stops_are_made_beside_obstacles_and_only_where_wanted() -> None:
    def standing_share(stop_share: float) -> tuple[float, float]:
        still, near = [], []
        for seed in range(5):
            rng = np.random.default_rng(seed)
            walk = random_walk(FLOOR, rng, Pace(1.1, stop_share), 240, STEP_S, np.array([1.0, 1.0]))
            stands = np.linalg.norm(np.diff(walk.position_m, axis=0), axis=1) < 1e-6
            still.append(stands.mean())
            near.extend(clearance_m(walk.position_m[1:][stands]).tolist())
        return float(np.mean(still)), float(np.median(near)) if near else np.inf

    often, clearance_at_stops_m = standing_share(1.0)
    seldom, _ = standing_share(0.0)
    assert often > 0.25 > 0.2 > seldom
    assert clearance_at_stops_m < float(np.median(GRID.clearance_m[GRID.free]))


def test_same_stream_same_walk() -> None:
    first, second = (
        random_walk(FLOOR, np.random.default_rng(9), PACE, 50, STEP_S, np.array([1.0, 1.0])) for _ in range(2)
    )
    assert np.array_equal(first.position_m, second.position_m)
    assert np.array_equal(first.heading_rad, second.heading_rad)
