"""A path that keeps every rule passes; each planted fault is found, by its rule and value."""

from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float64

from perpetua.cameras.audit import CameraAudit, audit_paths
from perpetua.cameras.config import CamerasConfig
from perpetua.cameras.moving_mesh import MovingMesh
from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.raycast import Caster
from tests.support.camera_scene import camera_path, camera_room, walker

FRAMES, FPS = 12, 12.0
START_M, END_M = np.array([-2.4, 0.5, 1.4]), np.array([-2.4, -0.5, 1.4])
TARGET_M = np.array([1.5, 0.5, 1.2])
ROOM = camera_room()
CASTER = Caster(join([obj.mesh for obj in ROOM.objects]))


def _line(start_m: Float64[np.ndarray, "3"], end_m: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "T 3"]:
    fraction = np.linspace(0.0, 1.0, FRAMES)[:, None]
    return np.asarray((1.0 - fraction) * start_m + fraction * end_m)


def _audit(
    position_m: Float64[np.ndarray, "T 3"],
    target_m: Float64[np.ndarray, "3"] = TARGET_M,
    min_focus_share: float = 0.5,
) -> CameraAudit:
    actors = (walker(0, _line(np.array([1.5, 0.5, 0.0]), np.array([1.2, 0.9, 0.0]))[:, :2]),)
    focus = np.ones((1, FRAMES, 1), bool)
    meshes = tuple(MovingMesh(actor) for actor in actors)
    paths = (camera_path(position_m, target_m),)
    config = CamerasConfig(count=1, min_focus_share=min_focus_share)
    return audit_paths(paths, focus, ROOM, actors, meshes, CASTER, FPS, config)


def _only_rule(audit: CameraAudit) -> str:
    assert len(audit.violations) == 1, audit.violations
    assert "is required" in audit.violations[0].message
    return audit.violations[0].rule


def test_a_good_path_passes_with_exact_figures() -> None:
    audit = _audit(_line(START_M, END_M))
    assert audit.passed and audit.focus_fraction[0] == 1.0
    assert audit.scene_distance_m[0] == pytest.approx(0.6, abs=1e-5)
    assert audit.travel_m[0] == pytest.approx(1.0)


def test_a_thin_sheet_crossed_between_two_frames_is_found() -> None:
    """No frame is closer than 0.17 m to the table top; the way between two frames goes through it."""
    position_m = _line(np.array([0.0, -0.35, 1.0]), np.array([0.0, -0.3, 1.0]))
    position_m[6:, 2] = 0.5
    audit = _audit(position_m)
    assert "scene" in {violation.rule for violation in audit.violations}
    assert audit.scene_distance_m[0] < 0.02


def test_too_near_the_wall() -> None:
    beside_wall_m = np.array([-2.9, 0.0, 0.0]) + np.array([0.0, 1.0, 1.0]) * _line(START_M, END_M)
    audit = _audit(beside_wall_m)
    assert _only_rule(audit) == "scene"
    assert audit.violations[0].value == pytest.approx(0.1, abs=1e-5)


def test_too_near_an_actor() -> None:
    """The capsule's surface is 0.2 m from its axis."""
    axis_m = _line(np.array([1.5, 0.5, 0.0]), np.array([1.2, 0.9, 0.0]))
    audit = _audit(axis_m + np.array([0.0, 0.45, 1.4]), np.array([1.5, 0.0, 1.4]), min_focus_share=0.0)
    assert _only_rule(audit) == "actor"
    # A capsule of ten segments lies up to 1 - cos(18 degrees) of its radius inside the round one.
    assert 0.25 - 1e-6 <= audit.actor_distance_m[0] < 0.262


def test_distance_to_an_actor_is_the_least_of_all_sub_steps() -> None:
    """Camera and actor pass each other; the nearest moment lies between frames."""
    camera_m = _line(np.array([-2.0, 1.7, 1.4]), np.array([-0.8, 1.5, 1.4]))
    walk_m = _line(np.array([-0.9, 0.9, 0.0]), np.array([-1.9, 0.8, 0.0]))
    actor = walker(0, walk_m[:, :2])
    focus = np.ones((1, FRAMES, 1), bool)
    paths, meshes = (camera_path(camera_m, TARGET_M),), (MovingMesh(actor),)
    audit = audit_paths(paths, focus, ROOM, (actor,), meshes, CASTER, FPS, CamerasConfig(count=1))
    fraction = np.linspace(0.0, 1.0, 8 * (FRAMES - 1) + 1)[:, None]
    between_m = (1.0 - fraction) * (camera_m[0] - walk_m[0]) + fraction * (camera_m[-1] - walk_m[-1])
    still = Caster(TriMesh(walker(0, np.zeros((1, 2))).vertices_m[0].astype(np.float64), actor.faces))
    assert audit.actor_distance_m[0] == pytest.approx(still.closest_distance(between_m).min(), abs=1e-4)


def test_outside_of_the_room() -> None:
    """Through the window, where no triangle is near."""
    audit = _audit(_line(np.array([0.0, 2.9, 1.45]), np.array([0.5, 2.9, 1.45])))
    assert _only_rule(audit) == "room"


def test_looking_away_from_the_focus() -> None:
    audit = _audit(_line(START_M, END_M), np.array([-3.0, 0.0, 1.2]))
    assert "focus" in {violation.rule for violation in audit.violations}
    assert audit.focus_fraction[0] == 0.0


def test_too_fast() -> None:
    far_m = START_M + 2.0 * (END_M - START_M)
    audit = _audit(_line(START_M + 1.0 * (START_M - END_M), far_m))
    assert _only_rule(audit) == "speed"
    assert audit.violations[0].value == pytest.approx(3.0 / (FRAMES - 1) * FPS)


def test_a_jerk() -> None:
    position_m = _line(START_M, END_M)
    position_m[5, 2] += 0.04
    assert _only_rule(_audit(position_m)) == "acceleration"


def test_too_steep() -> None:
    audit = _audit(_line(np.array([1.2, 0.4, 2.3]), np.array([1.6, 0.6, 2.3])))
    assert "pitch" in {violation.rule for violation in audit.violations}


def test_too_quick_a_turn() -> None:
    """Passing 0.2 m beside the point looked at, at 1.1 m/s."""
    audit = _audit(_line(START_M, END_M), np.array([-2.2, 0.0, 1.4]), min_focus_share=0.0)
    assert _only_rule(audit) == "turn"
    assert audit.violations[0].value > 200.0


def _two_views(second_target_m: Float64[np.ndarray, "3"], config: CamerasConfig) -> CameraAudit:
    """Two views, 90 degrees apart at the actor; the first sees it."""
    actors = (walker(0, np.tile([[1.0, 1.0]], (FRAMES, 1))),)
    first_m, second_m = np.tile([-2.0, 1.0, 1.4], (FRAMES, 1)), np.tile([1.0, -1.6, 1.4], (FRAMES, 1))
    paths = (camera_path(first_m, np.array([1.0, 1.0, 1.2])), camera_path(second_m, second_target_m))
    meshes = tuple(MovingMesh(actor) for actor in actors)
    focus = np.ones((2, FRAMES, 1), bool)
    return audit_paths(paths, focus, ROOM, actors, meshes, CASTER, FPS, config)


def test_an_actor_seen_by_too_few_views() -> None:
    config = CamerasConfig(count=4, min_focus_share=0.0, min_apart_deg=0.0)
    audit = _two_views(np.array([3.0, -1.6, 1.2]), config)
    assert _only_rule(audit) == "coverage"
    assert audit.violations[0].subject == "actor 0" and audit.covered_fraction.tolist() == [0.0]


def test_views_of_an_actor_from_too_like_directions() -> None:
    seen_m = np.array([1.0, 1.0, 1.2])
    audit = _two_views(seen_m, CamerasConfig(count=4, min_apart_deg=89.0))
    assert audit.passed and audit.covered_fraction.tolist() == [1.0]
    assert audit.apart_deg[0] == pytest.approx(90.0, abs=0.5)
    audit = _two_views(seen_m, CamerasConfig(count=4, min_apart_deg=91.0))
    assert _only_rule(audit) == "apart"


def test_distance_to_a_deforming_mesh_is_exact() -> None:
    """Every vertex goes its own way; each sub-step is compared with a plain search over all triangles."""
    rng = np.random.default_rng(0)
    actor = walker(0, np.zeros((4, 2)))
    actor = replace(
        actor, vertices_m=actor.vertices_m + rng.normal(0.0, 0.05, actor.vertices_m.shape).astype(np.float32)
    )
    points_m = rng.uniform((0.4, -0.5, 0.2), (1.5, 0.5, 2.2), (40, 3))
    frame, fraction = rng.integers(0, 3, 40).astype(np.int32), rng.uniform(0.0, 1.0, 40)
    between_m = (
        actor.vertices_m[frame] * (1.0 - fraction[:, None, None])
        + actor.vertices_m[frame + 1] * fraction[:, None, None]
    )
    exact_m = [
        Caster(TriMesh(vertices_m, actor.faces)).closest_distance(point_m[None])[0]
        for vertices_m, point_m in zip(between_m, points_m, strict=True)
    ]
    mesh = MovingMesh(actor)
    found_m = [mesh.least_distance_m(points_m[i : i + 1], frame[i : i + 1], fraction[i : i + 1]) for i in range(40)]
    np.testing.assert_allclose(found_m, exact_m, atol=1e-5)
    assert mesh.least_distance_m(points_m, frame, fraction) == min(found_m)
