"""The camera stage on a small room: what comes out keeps the rules, moves, sees people, and repeats bit by bit."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from perpetua.cameras.config import CamerasConfig
from perpetua.cameras.plan import CameraPlan, plan_cameras
from perpetua.cameras.views import view_coverage
from perpetua.errors import CameraError
from perpetua.geometry.mesh import join
from perpetua.geometry.raycast import Caster
from perpetua.seeding import StageSeed
from tests.support.camera_scene import camera_room, walker, walkers

FRAMES, FPS = 16, 8.0
CONFIG = CamerasConfig(candidates=2, steps=100, voxel_m=0.12)
SEED = StageSeed(5, 0, "cameras")


@pytest.fixture(scope="module")
def plan() -> CameraPlan:
    return plan_cameras(camera_room(), walkers(FRAMES), CONFIG, FRAMES, FPS, 96, 72, SEED)


def test_every_view_moves_and_keeps_its_distance(plan: CameraPlan) -> None:
    assert plan.audit.passed and len(plan.paths) == 4
    assert (plan.audit.scene_distance_m >= CONFIG.scene_clearance_m).all()
    assert (plan.audit.actor_distance_m >= CONFIG.actor_clearance_m).all()
    assert (plan.audit.travel_m > 0.3).all() and (plan.audit.travel_m < 2.5).all()


def test_views_see_their_focus_from_different_sides(plan: CameraPlan) -> None:
    assert plan.audit.focus_fraction.mean() >= 0.95
    caster = Caster(join([obj.mesh for obj in camera_room().objects]))
    coverage = view_coverage(plan.paths, walkers(FRAMES), caster)
    assert np.degrees(np.nanmean(coverage.apart_rad)) >= 60.0
    assert (coverage.sees.sum(axis=0) >= 2).mean(axis=0).min() >= 0.7


def test_poses_are_rigid_and_level_within_the_sway(plan: CameraPlan) -> None:
    for path in plan.paths:
        rotation = path.world_from_camera[:, :3, :3]
        identity = np.broadcast_to(np.eye(3), rotation.shape)
        np.testing.assert_allclose(np.swapaxes(rotation, 1, 2) @ rotation, identity, atol=1e-12)
        np.testing.assert_allclose(np.linalg.det(rotation), 1.0)
        roll_deg = np.degrees(np.arcsin(np.abs(rotation[:, 2, 0])))
        assert roll_deg.max() <= CONFIG.sway_deg + 1e-9
        assert (path.intrinsics.width_px, path.intrinsics.height_px) == (96, 72)


def test_paths_are_neither_straight_nor_all_alike(plan: CameraPlan) -> None:
    positions_m = np.stack([path.world_from_camera[:, :3, 3] for path in plan.paths])
    between_m = np.linalg.norm(positions_m[:, None] - positions_m[None], axis=-1)
    assert between_m[~np.eye(4, dtype=bool)].min() > 0.5
    ends_m = np.linalg.norm(positions_m[:, -1] - positions_m[:, 0], axis=-1)
    assert (plan.audit.travel_m > 1.0001 * ends_m).all()


def test_same_seed_same_bits_whatever_the_threads(plan: CameraPlan) -> None:
    threads = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        again = plan_cameras(camera_room(), walkers(FRAMES), CONFIG, FRAMES, FPS, 96, 72, SEED).paths
    finally:
        torch.set_num_threads(threads)
    for first, second in zip(plan.paths, again, strict=True):
        assert np.array_equal(first.world_from_camera, second.world_from_camera)
        assert first.intrinsics == second.intrinsics


def test_another_room_of_the_same_seed_differs(plan: CameraPlan) -> None:
    quick = CONFIG.model_copy(update={"steps": 30, "candidates": 1, "min_focus_share": 0.0})
    other = plan_cameras(camera_room(), walkers(FRAMES), quick, FRAMES, FPS, 96, 72, replace(SEED, room=1)).paths
    assert not np.allclose(other[0].world_from_camera, plan.paths[0].world_from_camera, atol=0.1)


@pytest.mark.parametrize(("frames", "fps", "cameras"), [(2, 24.0, 1), (6, 6.0, 3)])
def test_short_sequences_and_other_numbers_of_views(frames: int, fps: float, cameras: int) -> None:
    config = CamerasConfig(candidates=2, steps=40, voxel_m=0.12, count=cameras)
    paths = plan_cameras(camera_room(), walkers(frames)[:cameras], config, frames, fps, 64, 48, SEED).paths
    assert len(paths) == cameras
    assert all(path.world_from_camera.shape == (frames, 4, 4) for path in paths)
    assert all((path.world_from_camera[0] != path.world_from_camera[-1]).any() for path in paths)


def test_a_static_view_only_turns() -> None:
    config = CONFIG.model_copy(update={"styles": ("static",), "steps": 40, "candidates": 1, "min_focus_share": 0.0})
    paths = plan_cameras(camera_room(), walkers(FRAMES), config, FRAMES, FPS, 96, 72, SEED).paths
    for path in paths:
        assert np.ptp(path.world_from_camera[:, :3, 3], axis=0).max() < 1e-12
    assert max(np.ptp(path.world_from_camera[:, :3, 2], axis=0).max() for path in paths) > 0.02


def test_rules_that_cannot_be_kept_are_an_error_that_names_them() -> None:
    config = CamerasConfig(candidates=1, steps=10, voxel_m=0.15, max_redraws=1, max_speed_mps=0.001)
    with pytest.raises(CameraError, match=r"1 redraws.*greatest speed.*at most 0.001 is required: raise"):
        plan_cameras(camera_room(), walkers(6), config, 6, 6.0, 64, 48, SEED)


def test_inputs_that_do_not_fit_are_errors() -> None:
    room, still = camera_room(), np.zeros((3, 2))
    with pytest.raises(CameraError, match="at least one actor"):
        plan_cameras(room, (), CONFIG, 3, 6.0, 64, 48, SEED)
    with pytest.raises(CameraError, match="at least 2 frames"):
        plan_cameras(room, (walker(0, still[:1]),), CONFIG, 1, 6.0, 64, 48, SEED)
    with pytest.raises(CameraError, match="actor 0 has 3 frames where the sequence has 4"):
        plan_cameras(room, (walker(0, still),), CONFIG, 4, 6.0, 64, 48, SEED)
