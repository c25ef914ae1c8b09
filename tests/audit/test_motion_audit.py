"""The exact measurements of people's and cameras' ways, against shapes whose distances are known."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from perpetua.audit.clearance import FAR_M, pillars_to_mesh_m, points_to_mesh_m, points_to_moving_mesh_m
from perpetua.audit.motion_audit import MotionAudit, MotionLimits, audit_motion
from perpetua.cameras.config import CamerasConfig
from perpetua.geometry.mesh import join
from perpetua.navigation.config import NavigationConfig
from perpetua.routes.config import RoutesConfig
from perpetua.scene.actor import ActorMesh, Route
from perpetua.scene.camera import CameraPath
from tests.support.camera_scene import as_tri_mesh, camera_path, camera_room, walker, walkers

FPS = 24.0
FRAMES = 9
ROOM = camera_room()
LIMITS = MotionLimits(RoutesConfig(max_speed_mps=2.0), CamerasConfig(), NavigationConfig())
BALL = as_tri_mesh(trimesh.creation.icosphere(subdivisions=4, radius=0.5))


def test_points_are_measured_to_the_nearest_triangle() -> None:
    rng = np.random.default_rng(1)
    direction = rng.normal(size=(50, 3))
    radius_m = rng.uniform(0.6, 3.0, size=50)
    points_m = direction / np.linalg.norm(direction, axis=1, keepdims=True) * radius_m[:, None]
    assert points_to_mesh_m(points_m, BALL) == pytest.approx(np.minimum(radius_m - 0.5, FAR_M), abs=2e-3)


def test_pillars_are_measured_sideways_and_what_is_stepped_over_does_not_count() -> None:
    box = trimesh.creation.box((1.0, 1.0, 0.6)).apply_translation([0.0, 0.0, 0.3])
    low = trimesh.creation.box((1.0, 1.0, 0.06)).apply_translation([2.0, 0.0, 0.03])
    mesh = join([as_tri_mesh(box), as_tri_mesh(low)])
    feet_m = np.array([[0.9, 0.0, 0.0], [0.8, 0.9, 0.0], [-0.51, 0.2, 0.0], [0.2, 0.2, 0.0], [2.0, 0.0, 0.0]])
    wanted_m = [0.4, 0.5, 0.01, 0.0, 1.0]
    assert pillars_to_mesh_m(feet_m, 0.08, 1.9, mesh) == pytest.approx(wanted_m, abs=2e-3)


def test_a_mesh_is_measured_where_it_is_between_frames() -> None:
    shift_m = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    vertices_m = (BALL.vertices_m[None] + shift_m[:, None]).astype(np.float32)
    points_m = np.array([[0.5, 0.7, 0.0]]).repeat(3, axis=0)
    found_m = points_to_moving_mesh_m(points_m, np.array([0.0, 0.5, 1.0]), vertices_m, BALL.faces)
    assert found_m == pytest.approx([np.hypot(0.5, 0.7) - 0.5, 0.2, np.hypot(0.5, 0.7) - 0.5], abs=2e-3)


def _route(actor: ActorMesh) -> Route:
    axis_m = actor.vertices_m.mean(axis=1).astype(np.float64)
    axis_m[:, 2] = 0.0
    return Route(actor.actor, axis_m, np.zeros(len(axis_m)))


def _cameras() -> tuple[CameraPath, ...]:
    start_m = np.array([[-2.5, 2.0, 1.5], [2.4, 2.0, 1.6]])
    way_m = np.linspace(0.0, 0.1, FRAMES)[:, None] * np.array([1.0, 0.0, 0.0])
    return tuple(camera_path(place_m + way_m, np.array([0.0, 0.0, 1.2])) for place_m in start_m)


def _audit(actors: tuple[ActorMesh, ...] | None = None, cameras: tuple[CameraPath, ...] | None = None) -> MotionAudit:
    actors = walkers(FRAMES) if actors is None else actors
    cameras = _cameras() if cameras is None else cameras
    focus = np.zeros((len(cameras), FRAMES, len(actors)), bool)
    focus[:, :, 0] = True
    return audit_motion(ROOM, tuple(_route(actor) for actor in actors), actors, cameras, focus, FPS / 6, LIMITS)


def _broken(audit: MotionAudit) -> list[str]:
    return [check.name for check in audit.checks if not check.passed]


def test_a_good_plan_passes_and_its_curves_are_true() -> None:
    audit = _audit()
    assert audit.passed, _broken(audit)
    # The first walker starts 0.8 m from the wall at x = -3 and 0.9 m from the one at y = -2.5.
    assert audit.actor_scene_m[0, 0] == pytest.approx(0.8, abs=0.03)
    assert audit.camera_scene_m[0] == pytest.approx(0.5 + np.linspace(0.0, 0.1, FRAMES), abs=2e-3)
    assert audit.camera_speed_mps[0] == pytest.approx(np.full(FRAMES, 0.1 / (FRAMES - 1) * FPS / 6), rel=1e-6)
    assert audit.views_seeing.shape == audit.apart_rad.shape == (4, FRAMES)
    assert audit.views_seeing.max() == 2.0
    # Only the first actor is asked for.
    assert (audit.focus_seen.sum(axis=0) == audit.views_seeing[0]).all() and audit.focus_seen.max() == 1.0


def test_a_wall_hides_and_the_image_ends() -> None:
    outside = camera_path(np.tile([0.0, -4.0, 1.5], (FRAMES, 1)), np.array([0.0, 0.0, 1.2]))
    away = camera_path(np.tile([0.0, 1.5, 1.5], (FRAMES, 1)), np.array([0.0, 2.4, 1.5]))
    assert _audit(cameras=(outside, away)).views_seeing.max() == 0.0


def _moved(path: CameraPath, frame: int, place_m: tuple[float, float, float]) -> CameraPath:
    poses = path.world_from_camera.copy()
    poses[frame:, :3, 3] += np.array(place_m) - poses[frame, :3, 3]
    return replace(path, world_from_camera=poses)


def test_each_rule_catches_what_breaks_it() -> None:
    first, second = _cameras()
    near_wall = _moved(first, 0, (-2.9, 2.0, 1.5))
    assert _broken(_audit(cameras=(near_wall, second))) == ["camera to scene"]
    # It is through the cupboard between two frames, and clear of it at both.
    through = _moved(_moved(first, 0, (1.5, -1.8, 1.9)), 4, (2.5, -1.0, 2.3))
    assert "camera to scene" in _broken(_audit(cameras=(through, second)))
    walker_m = walkers(FRAMES)[0].vertices_m[3].mean(axis=0)
    beside = _moved(first, 0, (float(walker_m[0]) + 0.45, float(walker_m[1]), 1.2))
    assert _broken(_audit(cameras=(beside, second))) == ["camera to actors"]
    jump = _moved(first, 5, (-2.0, 2.0, 1.5))
    assert _broken(_audit(cameras=(jump, second))) == ["camera speed"]
    turned = first.world_from_camera.copy()
    turned[5:, :3, :2] *= -1.0
    spun = replace(first, world_from_camera=turned)
    assert _broken(_audit(cameras=(spun, second))) == ["camera turning"]


def test_rules_for_people_catch_what_breaks_them() -> None:
    rest = walkers(FRAMES)[1:]

    def along(start: tuple[float, float], end: tuple[float, float]) -> list[str]:
        fraction = np.linspace(0.0, 1.0, FRAMES)[:, None]
        return _broken(_audit((walker(0, (1.0 - fraction) * np.array(start) + fraction * np.array(end)), *rest)))

    assert along((-2.2, -1.6), (-1.0, -1.2)) == []
    assert along((-2.8, -1.6), (-1.6, -1.2)) == ["route clearance"]
    assert along((-1.8, 0.9), (-0.9, 1.2)) == ["route separation"]
    assert along((-2.35, -2.05), (1.75, -2.05)) == ["route speed"]
