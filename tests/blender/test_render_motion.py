"""Motion blur: pictures are blurred by moving actors and cameras, ground truth is not; cameras that deviate."""

from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float64
from PIL import Image

from perpetua.rendering.config import RenderConfig
from perpetua.rendering.render import render_views
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.scene import RenderedView
from perpetua.seeding import StageSeed
from tests.support.plane_scene import (
    CONFIG,
    FRAMES,
    NORMAL,
    PATCH_HEIGHT_M,
    assert_same,
    patch,
    plane_room,
    two_cameras,
)

pytestmark = pytest.mark.blender

SHARP = CONFIG.model_copy(update={"noise_threshold": 0.0})
BLURRED = SHARP.model_copy(update={"motion_blur": True, "shutter": 1.0})


def _render(
    folder: Path, config: RenderConfig, actor: ActorMesh, cameras: tuple[CameraPath, ...], seed: int = 0
) -> tuple[RenderedView, ...]:
    stage_seed = StageSeed(seed, 0, "render")
    return render_views(plane_room(), (actor,), cameras, config, "cpu", folder, lambda *_: None, seed=stage_seed)


def _picture(view: RenderedView, frame: int) -> Float64[np.ndarray, "H W 3"]:
    return np.asarray(Image.open(BytesIO(view.jpeg[frame])), np.float64)


def _redness(view: RenderedView, frame: int) -> Float64[np.ndarray, "H W"]:
    picture = _picture(view, frame)
    return np.asarray(np.maximum(picture[..., 0] - picture[..., 1:].mean(axis=2) - 25.0, 0.0))


def _sliding_patch() -> ActorMesh:
    """A patch that slides along the plane, 0.4 m a frame."""
    along_m = 0.4 * np.arange(FRAMES)[:, None] * np.cross(NORMAL, [0.0, 0.0, 1.0]) / 0.6
    still_m = patch().vertices_m[0] + NORMAL * (PATCH_HEIGHT_M[1] - PATCH_HEIGHT_M[0])
    return replace(patch(), vertices_m=(still_m + along_m[:, None]).astype(np.float32))


def _still_cameras() -> tuple[CameraPath, ...]:
    return tuple(
        replace(camera, world_from_camera=np.tile(camera.world_from_camera[:1], (FRAMES, 1, 1)))
        for camera in two_cameras()
    )


def test_a_moving_actor_is_blurred_about_its_place_and_the_ground_truth_is_not(tmp_path: Path) -> None:
    """Every view and frame: Cycles keeps its data from one to the next, which must not keep an old motion."""
    actor, cameras = _sliding_patch(), _still_cameras()
    sharp = _render(tmp_path / "sharp", SHARP, actor, cameras)
    blurred = _render(tmp_path / "blurred", BLURRED, actor, cameras)
    for plain, moving in zip(sharp, blurred, strict=True):
        np.testing.assert_array_equal(plain.depth_m, moving.depth_m)
        np.testing.assert_array_equal(plain.object_index, moving.object_index)
        for frame in range(FRAMES):
            sharp_red, blurred_red = _redness(plain, frame), _redness(moving, frame)
            full = sharp_red.max()
            partly = [((red > 0.15 * full) & (red < 0.85 * full)).sum() for red in (sharp_red, blurred_red)]
            assert partly[1] > partly[0] + 20
            middles = [(red.sum(axis=0) * np.arange(64)).sum() / red.sum() for red in (sharp_red, blurred_red)]
            assert abs(middles[0] - middles[1]) < 0.7


def test_moving_cameras_blur_the_plane_and_not_the_ground_truth(tmp_path: Path) -> None:
    actor = replace(patch(), vertices_m=np.tile(patch().vertices_m[:1], (FRAMES, 1, 1)))
    sharp = _render(tmp_path / "sharp", SHARP, actor, two_cameras())
    blurred = _render(tmp_path / "blurred", BLURRED, actor, two_cameras())
    for plain, moving in zip(sharp, blurred, strict=True):
        np.testing.assert_array_equal(plain.depth_m, moving.depth_m)
        np.testing.assert_array_equal(plain.object_index, moving.object_index)
        for frame in range(FRAMES):
            steps = [
                np.quantile(np.abs(np.diff(_picture(view, frame).mean(axis=2), axis=1)), 0.95)
                for view in (plain, moving)
            ]
            assert steps[1] < 0.8 * steps[0]


def test_a_sensor_adds_noise_and_cameras_differ_and_the_geometry_stays(tmp_path: Path) -> None:
    sensor = SHARP.sensor.model_copy(update={"shot_noise": 0.1, "read_noise": 0.02, "exposure_spread_ev": 1.0})
    config = SHARP.model_copy(update={"sensor": sensor})
    still = replace(patch(), vertices_m=np.tile(patch().vertices_m[:1], (FRAMES, 1, 1)))
    ideal = _render(tmp_path / "ideal", SHARP, still, _still_cameras())
    views = _render(tmp_path / "real", config, still, _still_cameras())
    assert_same(views, _render(tmp_path / "again", config, still, _still_cameras()))
    for view, clean in zip(views, ideal, strict=True):
        np.testing.assert_array_equal(view.depth_m, clean.depth_m)
        np.testing.assert_array_equal(view.object_index, clean.object_index)
    change = [
        [_picture(view, k) - _picture(clean, k) for k in (0, 2)] for view, clean in zip(views, ideal, strict=True)
    ]
    brighter = np.array([[difference.mean() for difference in frames] for frames in change])
    # One exposure per view, kept over the sequence.
    assert np.abs(brighter[:, 0] - brighter[:, 1]).max() < 2.0
    assert abs(brighter[0, 0] - brighter[1, 0]) > 5.0
    for frames in change:
        grain = [difference - difference.mean() for difference in frames]
        assert grain[0].std() > 5.0
        # Each frame has noise of its own.
        assert abs(np.corrcoef(grain[0].ravel(), grain[1].ravel())[0, 1]) < 0.5
