"""Routes as a whole: hard limits, checked here with exact distances, and what happens when they cannot be kept."""

import numpy as np
import pytest
import trimesh
from scipy.interpolate import CubicSpline

from perpetua.actors.config import ActorsConfig
from perpetua.errors import RouteError
from perpetua.geometry.mesh import TriMesh
from perpetua.motion.config import MotionConfig
from perpetua.navigation.config import NavigationConfig
from perpetua.navigation.grid import build_nav_grid
from perpetua.navigation.types import NavGrid
from perpetua.routes.checks import TimedPaths, find_violations
from perpetua.routes.config import RoutesConfig
from perpetua.routes.plan import plan_routes
from perpetua.scene.actor import Route
from perpetua.scene.room import Room, SceneObject
from perpetua.seeding import StageSeed

SEED = StageSeed(7, 0, "routes")
RADIUS_M = NavigationConfig().body_radius_m
TABLE_M = np.array([[-0.6, -0.4], [0.6, 0.4]])
SIDE_M = (5.0, 4.5)
BENCH_INDEX = 4
BENCH_M = np.array([[-1.0, -2.25, 0.0], [0.5, -1.8, 0.45]])


def box_object(index: int, name: str, low_m: list[float], high_m: list[float], walkable: bool) -> SceneObject:
    low, high = np.array(low_m), np.array(high_m)
    mesh = trimesh.creation.box(extents=high - low)
    mesh.apply_translation(0.5 * (low + high))
    faces = np.asarray(mesh.faces, np.int32)
    return SceneObject(index, name, name, TriMesh(np.asarray(mesh.vertices, np.float64), faces), None, walkable, True)


def room_with_table() -> Room:
    x, y = SIDE_M[0] / 2, SIDE_M[1] / 2
    objects = (
        box_object(1, "floor", [-x, -y, -0.1], [x, y, 0.0], True),
        box_object(2, "table_01", [*TABLE_M[0], 0.7], [*TABLE_M[1], 0.75], False),
        box_object(3, "rug_01", [-x, 1.0, 0.0], [x, y, 0.01], True),
        box_object(BENCH_INDEX, "bench", list(BENCH_M[0]), list(BENCH_M[1]), False),
        box_object(5, "picture", [x - 0.03, -1.0, 1.2], [x, -0.4, 1.8], False),
    )
    return Room("test", "diningroom", np.array([[-x, -y], [x, -y], [x, y], [-x, y]]), 2.6, objects, (), None)


ROOM = room_with_table()
GRID: NavGrid = build_nav_grid(ROOM, NavigationConfig())


def exact_clearance_m(place_m: np.ndarray) -> np.ndarray:
    boxes_m = (TABLE_M, BENCH_M[:, :2])
    outside = [np.maximum(np.maximum(box_m[0] - place_m, place_m - box_m[1]), 0.0) for box_m in boxes_m]
    to_wall = (np.array(SIDE_M) / 2 - np.abs(place_m)).min(-1)
    return np.minimum.reduce([*(np.linalg.norm(away, axis=-1) for away in outside), to_wall])


def finely(values: np.ndarray) -> np.ndarray:
    steps = len(values)
    return np.asarray(CubicSpline(np.arange(steps), values)(np.linspace(0, steps - 1, 4 * (steps - 1) + 1)))


@pytest.fixture(scope="module")
def routes() -> tuple[Route, ...]:
    return plan_routes(ROOM, GRID, ActorsConfig(routes=RoutesConfig(steps=150)), 36, 12.0, SEED)


def test_one_route_per_actor_with_a_place_per_frame(routes: tuple[Route, ...]) -> None:
    assert [route.actor for route in routes] == [0, 1, 2, 3]
    assert all(route.position_m.shape == (36, 3) and route.heading_rad.shape == (36,) for route in routes)


def test_hard_limits_hold_by_exact_distances(routes: tuple[Route, ...]) -> None:
    config = RoutesConfig()
    fine = [finely(route.position_m[:, :2]) for route in routes]
    for index, place_m in enumerate(fine):
        assert exact_clearance_m(place_m).min() >= RADIUS_M
        speed_mps = np.linalg.norm(np.diff(place_m, axis=0), axis=1) * 48.0
        assert speed_mps.max() <= config.max_speed_mps + 1e-3
        for other_m in fine[:index]:
            assert np.linalg.norm(place_m - other_m, axis=1).min() >= config.separation_m - 1e-3
    for route, place_m in zip(routes, fine, strict=True):
        acceleration = np.linalg.norm(np.diff(place_m, n=2, axis=0), axis=1) * 48.0**2
        assert acceleration.max() <= 1.02 * config.max_acceleration_mps2
        assert np.abs(np.diff(route.heading_rad)).max() * 12.0 <= config.max_turn_rate_radps


def test_who_walks_walks_ahead_and_who_pauses_stands_still(routes: tuple[Route, ...]) -> None:
    for route in routes:
        velocity = np.diff(route.position_m[:, :2], axis=0) * 12.0
        speed_mps = np.linalg.norm(velocity, axis=1)
        middle_rad = 0.5 * (route.heading_rad[1:] + route.heading_rad[:-1])
        ahead = (velocity * np.stack([np.cos(middle_rad), np.sin(middle_rad)], axis=1)).sum(1)
        assert (ahead[speed_mps > 0.4] > 0.7 * speed_mps[speed_mps > 0.4]).all()
        for dwell in route.dwells:
            assert speed_mps[dwell.first_frame : dwell.last_frame].max() < 1e-6


def test_words_set_the_pace_and_ask_for_a_seat() -> None:
    motion = MotionConfig(descriptions=("strolls, relaxed", "walks to the bench and sits down"))
    config = ActorsConfig(count=2, routes=RoutesConfig(steps=150), motion=motion)
    routes = {route.description: route for route in plan_routes(ROOM, GRID, config, 160, 20.0, SEED)}
    strolls, sits = (routes[description] for description in motion.descriptions)
    for route, limit_mps in ((strolls, 1.3), (sits, 2.0)):
        assert np.linalg.norm(np.diff(route.position_m[:, :2], axis=0), axis=1).max() * 20.0 < limit_mps
    (sitting,) = [dwell for dwell in sits.dwells if dwell.purpose == "sit"]
    assert sitting.object_index == BENCH_INDEX
    assert (sitting.last_frame - sitting.first_frame) / 20.0 > 3.0
    there = slice(sitting.first_frame, sitting.last_frame + 1)
    away_m = np.linalg.norm(sits.position_m[there, :2] - np.array(sitting.target_m[:2]), axis=1)
    assert away_m.max() < 0.75
    back = np.array(sitting.target_m[:2]) - sits.position_m[sitting.first_frame, :2]
    assert (np.cos(sits.heading_rad[there] - np.arctan2(-back[1], -back[0])) > 0.9).all()
    assert np.linalg.norm(np.diff(sits.position_m[there], axis=0), axis=1).max() * 20.0 < 1e-6


def test_who_stands_does_not_drift() -> None:
    motion = MotionConfig(descriptions=("stands and looks around", "walks"))
    routes = plan_routes(
        ROOM, GRID, ActorsConfig(count=2, routes=RoutesConfig(steps=100), motion=motion), 200, 20.0, SEED
    )
    (stands,) = [route for route in routes if route.description == motion.descriptions[0]]
    assert np.ptp(stands.position_m, axis=0).max() < 1e-3
    assert stands.dwells


def test_pauses_look_at_what_they_are_about() -> None:
    config = ActorsConfig(count=2, routes=RoutesConfig(steps=100, pause_share=0.6))
    routes = plan_routes(ROOM, GRID, config, 240, 20.0, SEED)
    dwells = [(route, dwell) for route in routes for dwell in route.dwells]
    assert dwells
    for route, dwell in dwells:
        obj = next(obj for obj in ROOM.objects if obj.object_index == dwell.object_index)
        low_m, high_m = obj.mesh.vertices_m.min(0), obj.mesh.vertices_m.max(0)
        assert ((dwell.target_m > low_m - 1e-6) & (dwell.target_m < high_m + 1e-6)).all()
        towards = np.array(dwell.target_m[:2]) - route.position_m[dwell.first_frame, :2]
        off_rad = route.heading_rad[dwell.first_frame] - np.arctan2(towards[1], towards[0])
        assert np.cos(off_rad) > 0.9


def test_routes_stand_on_the_rug_and_on_the_floor() -> None:
    routes = plan_routes(ROOM, GRID, ActorsConfig(count=2, routes=RoutesConfig(steps=100)), 60, 12.0, SEED)
    places_m = np.concatenate([route.position_m for route in routes])
    on_rug, off_rug = places_m[:, 1] > 1.06, places_m[:, 1] < 0.94
    assert on_rug.any()
    assert off_rug.any()
    assert np.allclose(places_m[on_rug, 2], 0.01)
    assert np.allclose(places_m[off_rug, 2], 0.0)


def test_same_seed_same_bits_and_another_seed_another_route() -> None:
    config = ActorsConfig(count=2, routes=RoutesConfig(steps=60))
    first, again, other = (
        plan_routes(ROOM, GRID, config, 12, 12.0, seed) for seed in (SEED, SEED, StageSeed(8, 0, "routes"))
    )
    assert all(np.array_equal(a.position_m, b.position_m) for a, b in zip(first, again, strict=True))
    assert all(np.array_equal(a.heading_rad, b.heading_rad) for a, b in zip(first, again, strict=True))
    assert not np.allclose(first[0].position_m, other[0].position_m, atol=0.1)


@pytest.mark.parametrize(("frames", "fps"), [(2, 24.0), (3, 6.0), (5, 1.0)])
def test_short_and_slow_sequences(frames: int, fps: float) -> None:
    routes = plan_routes(ROOM, GRID, ActorsConfig(count=2, routes=RoutesConfig(steps=100)), frames, fps, SEED)
    assert all(route.position_m.shape == (frames, 3) for route in routes)
    step_m = np.linalg.norm(np.diff(routes[0].position_m, axis=0), axis=1)
    assert step_m.max() <= 2.0 / fps + 1e-6


def test_too_many_actors_get_a_clear_error() -> None:
    crowded = RoutesConfig(separation_m=2.5, steps=10, learning_rate=1e-4, max_redraws=0)
    config = ActorsConfig(count=6, routes=crowded)
    with pytest.raises(RouteError, match=r"route of actor \d+ comes .* is required: lower actors.count or choose"):
        plan_routes(ROOM, GRID, config, 12, 12.0, SEED)


def test_clearance_error_names_the_furniture() -> None:
    free = GRID.free & (GRID.clearance_m > 0.9)
    unreachable = NavGrid(GRID.origin_m, GRID.cell_m, GRID.floor_z_m, free, GRID.clearance_m)
    config = ActorsConfig(count=1, routes=RoutesConfig(steps=10, max_redraws=0))
    with pytest.raises(
        RouteError, match=r"comes within 0\.\d\d m of '(table_01|picture|bench)' at frame \d+; at least 0\.9\d m"
    ):
        plan_routes(ROOM, unreachable, config, 60, 12.0, SEED)


def violation_rules(position_m: np.ndarray, heading_rad: np.ndarray) -> set[str]:
    paths = TimedPaths(position_m, heading_rad, 0.1)
    return {violation.rule for violation in find_violations(paths, GRID, RoutesConfig())}


def test_checks_find_each_kind_of_breach() -> None:
    x = np.linspace(-2.0, 0.0, 21)
    calm = np.stack([np.stack([x, np.full(21, y)], axis=1) for y in (-1.2, 1.2)])
    ahead = np.zeros((2, 21))
    assert violation_rules(calm, ahead) == set()
    assert violation_rules(calm, ahead + np.pi) == {"sidestep"}
    assert violation_rules(calm * np.array([1.0, 0.0]), ahead) == {"clearance", "separation"}
    assert violation_rules(calm[:, ::4], ahead[:, ::4]) == {"speed"}
    jerky = calm.copy()
    jerky[0, 10, 0] += 0.08
    assert "acceleration" in violation_rules(jerky, ahead)
    assert "turn rate" in violation_rules(calm, ahead + np.array([[0.0], [1.0]]) * np.arange(21) * 0.4)
