"""Real renders of small scenes: exact ground truth, exposure, and identical bytes after a kill."""

import logging
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float64
from PIL import Image

from perpetua.actors.types import ActorMesh, ActorPart
from perpetua.cameras.types import CameraPath
from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.pinhole import Intrinsics, unproject
from perpetua.geometry.transforms import look_at, transform_points
from perpetua.rendering.config import RenderConfig
from perpetua.rendering.render import render_views
from perpetua.rendering.types import RenderedView
from perpetua.rooms.types import AreaLight, Material, Room, SceneObject

pytestmark = pytest.mark.blender

FRAMES = 3
PLANE_INDEX, PATCH_INDEX, ACTOR_INDEX = 7, 300, 41
# The slanted plane n . x = d; no symmetry that a wrong axis or sign could hide behind.
NORMAL = np.array([0.36, -0.48, 0.8])
OFFSET_M = -0.5
# The actor's front is a square patch parallel to the plane, this far before it at frame t.
PATCH_HEIGHT_M = np.array([0.3, 0.5, 0.75])
CONFIG = RenderConfig(width_px=64, height_px=48, samples=8, denoise=True)
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
TWO_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def _in_plane(offset_m: float, half_side_m: float) -> Float64[np.ndarray, "4 3"]:
    """Corners of a square with ``NORMAL`` in the plane n . x = offset_m."""
    across = np.cross(NORMAL, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    up = np.cross(NORMAL, across)
    return np.asarray(NORMAL * offset_m + half_side_m * (SQUARE[:, :1] * across + SQUARE[:, 1:] * up))


def _room(power_w: float = 400.0) -> Room:
    grey = Material("grey", (0.5, 0.5, 0.5), (0.2, 0.2, 0.2), pattern="checks", scale_m=0.5)
    plane = SceneObject(
        PLANE_INDEX, "plane", "wall", TriMesh(_in_plane(OFFSET_M, 20.0), TWO_TRIANGLES), grey, False, True
    )
    light = AreaLight((2.0, -3.0, 5.0), (-0.3, 0.4, -1.0), (1.0, 0.5), power_w, (1.0, 0.95, 0.9))
    return Room("plane", "livingroom", SQUARE, 2.5, (plane,), (light,), None)


def _actor() -> ActorMesh:
    vertices_m = np.stack([_in_plane(OFFSET_M + height_m, 0.5) for height_m in PATCH_HEIGHT_M]).astype(np.float32)
    uv = np.zeros((2, 3, 2), np.float32)
    image = np.full((4, 4, 3), (200, 30, 30), np.uint8)
    part = ActorPart("patch", TWO_TRIANGLES, uv, Material("red", (0.5, 0.5, 0.5), image=image))
    return ActorMesh(0, ACTOR_INDEX, "a red patch", (part,), vertices_m)


def _cameras() -> tuple[CameraPath, ...]:
    """One centred camera, and one with its principal point off the centre and rectangular pixels; both move."""
    target_m = NORMAL * OFFSET_M + np.array([0.2, 0.1, 0.0])
    position_m = target_m + NORMAL * 2.5 + np.array([[0.4, -0.7, 0.6], [0.9, -0.4, 0.3], [1.5, 0.3, 0.1]])
    centred = CameraPath(0, look_at(position_m, np.tile(target_m, (FRAMES, 1))), Intrinsics.centred(64, 48, 1.1))
    skewed = Intrinsics(70.0, 55.0, 25.3, 29.1, 64, 48)
    wide = CameraPath(1, look_at(position_m[::-1] + np.array([-1.1, 0.2, 0.4]), np.tile(target_m, (FRAMES, 1))), skewed)
    return centred, wide


def _points_at(camera: CameraPath, depth_m: Float64[np.ndarray, "H W"], frame: int) -> Float64[np.ndarray, "H W 3"]:
    """World point of every pixel's centre at a depth."""
    rows, columns = np.mgrid[: camera.intrinsics.height_px, : camera.intrinsics.width_px]
    pixel_px = np.stack([columns, rows], axis=-1).astype(np.float64)
    points_m = unproject(camera.intrinsics, pixel_px, depth_m)
    return transform_points(camera.world_from_camera[frame], points_m.reshape(-1, 3)).reshape(points_m.shape)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[RenderedView, ...]:
    folder = tmp_path_factory.mktemp("undisturbed")
    return render_views(_room(), (_actor(),), _cameras(), CONFIG, "cpu", folder, lambda *_: None)


def test_every_pixel_lies_on_the_surface_it_shows(undisturbed: tuple[RenderedView, ...]) -> None:
    for camera, view in zip(_cameras(), undisturbed, strict=True):
        for frame in range(FRAMES):
            along_normal_m = _points_at(camera, view.depth_m[frame].astype(np.float64), frame) @ NORMAL
            index = view.object_index[frame]
            assert set(np.unique(index)) == {PLANE_INDEX, ACTOR_INDEX}
            np.testing.assert_allclose(along_normal_m[index == PLANE_INDEX], OFFSET_M, atol=1e-4)
            expected_m = OFFSET_M + PATCH_HEIGHT_M[frame]
            np.testing.assert_allclose(along_normal_m[index == ACTOR_INDEX], expected_m, atol=1e-4)


def test_the_actor_is_exactly_where_its_vertices_are(undisturbed: tuple[RenderedView, ...]) -> None:
    """A pixel shows the actor exactly if its ray meets the patch, but for rays within 1 mm of the patch's rim."""
    for camera, view in zip(_cameras(), undisturbed, strict=True):
        for frame in range(FRAMES):
            corners_m = _actor().vertices_m[frame].astype(np.float64)
            origin_m = camera.world_from_camera[frame][:3, 3]
            rays_m = _points_at(camera, np.ones((48, 64)), frame) - origin_m
            scale = (corners_m[0] @ NORMAL - origin_m @ NORMAL) / (rays_m @ NORMAL)
            hits_m = origin_m + rays_m * scale[..., None] - corners_m.mean(axis=0)
            axes = np.stack([corners_m[1] - corners_m[0], corners_m[3] - corners_m[0]])
            rim_m = np.abs(hits_m @ axes.T).max(axis=-1) - 0.5
            clear = np.abs(rim_m) > 1e-3
            np.testing.assert_array_equal((view.object_index[frame] == ACTOR_INDEX)[clear], (rim_m < 0)[clear])


def test_pictures_show_the_image_texture(undisturbed: tuple[RenderedView, ...]) -> None:
    picture = np.asarray(Image.open(BytesIO(undisturbed[0].jpeg[0])), np.float64)
    assert picture.shape == (48, 64, 3)
    red = picture[undisturbed[0].object_index[0] == ACTOR_INDEX].mean(axis=0)
    grey = picture[undisturbed[0].object_index[0] == PLANE_INDEX].mean(axis=0)
    assert red[0] > 2.0 * red[2]
    assert grey[0] < 1.3 * grey[2]


def test_exposure_makes_up_for_the_lamps(tmp_path: Path, undisturbed: tuple[RenderedView, ...]) -> None:
    """With a hundredth of the light (the sky is far below the lamp) the picture stays about as bright."""
    camera = CameraPath(0, _cameras()[0].world_from_camera[:1], _cameras()[0].intrinsics)
    actor = ActorMesh(0, ACTOR_INDEX, "", _actor().parts, _actor().vertices_m[:1])
    levels = []
    for power_w in (4e4, 4e6):
        folder = tmp_path / f"{power_w:g}"
        (view,) = render_views(_room(power_w), (actor,), (camera,), CONFIG, "cpu", folder, lambda *_: None)
        levels.append(float(np.asarray(Image.open(BytesIO(view.jpeg[0]))).mean()))
    assert 60.0 < levels[0] < 190.0
    assert abs(levels[0] - levels[1]) < 3.0


def test_white_balance_takes_the_lamps_colour_out(tmp_path: Path) -> None:
    """A grey plane under an orange lamp."""
    camera = CameraPath(0, _cameras()[0].world_from_camera[:1], _cameras()[0].intrinsics)
    room = _room()
    orange = replace(room, lights=(replace(room.lights[0], power_w=4e5, color=(1.0, 0.6, 0.3)),))
    red_per_blue = []
    for strength in (0.0, 1.0):
        config = CONFIG.model_copy(update={"white_balance": strength})
        (view,) = render_views(orange, (), (camera,), config, "cpu", tmp_path / f"{strength:g}", lambda *_: None)
        red, _, blue = np.asarray(Image.open(BytesIO(view.jpeg[0])), np.float64).mean(axis=(0, 1))
        red_per_blue.append(red / blue)
    assert red_per_blue[0] > 1.4
    assert 0.95 < red_per_blue[1] < 1.05


def test_background_has_no_depth_and_no_index_and_a_missing_gpu_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A camera that looks away from the plane, on a device that this machine cannot have."""
    absent = "metal" if sys.platform == "linux" else "cuda"
    away = look_at(np.array([[0.4, -2.0, 3.0]]), np.array([[0.4, -5.0, 6.0]]))
    camera = CameraPath(0, away, Intrinsics.centred(64, 48, 1.0))
    with caplog.at_level(logging.WARNING):
        (view,) = render_views(_room(), (), (camera,), CONFIG, absent, tmp_path, lambda *_: None)
    assert not view.depth_m.any()
    assert not view.object_index.any()
    assert f"no {absent} device" in caplog.text


def _assert_same(views: tuple[RenderedView, ...], others: tuple[RenderedView, ...]) -> None:
    for view, other in zip(views, others, strict=True):
        assert view.jpeg == other.jpeg
        np.testing.assert_array_equal(view.depth_m, other.depth_m)
        np.testing.assert_array_equal(view.object_index, other.object_index)


def _children() -> set[int]:
    tasks = Path("/proc/self/task").glob("*/children")
    return {int(pid) for task in tasks for pid in task.read_text().split()}


def test_a_killed_worker_is_replaced_and_the_result_is_the_same(
    tmp_path: Path, undisturbed: tuple[RenderedView, ...]
) -> None:
    others = _children()
    changed_ns: list[int] = []
    first_frame = tmp_path / "frames" / "000000"

    def kill_after_first_frame(done: int, total: int, seconds: float) -> None:
        if done == 1:
            changed_ns.append(first_frame.stat().st_mtime_ns)
            for pid in _children() - others:
                os.kill(pid, signal.SIGKILL)

    views = render_views(_room(), (_actor(),), _cameras(), CONFIG, "cpu", tmp_path, kill_after_first_frame)
    assert [first_frame.stat().st_mtime_ns] == changed_ns
    _assert_same(views, undisturbed)


def _render_until_killed(folder: Path) -> None:
    def die(done: int, total: int, seconds: float) -> None:
        (folder / "child").write_text(" ".join(map(str, _children())))
        os.kill(os.getpid(), signal.SIGKILL)

    render_views(_room(), (_actor(),), _cameras(), CONFIG, "cpu", folder, die)


def test_when_the_parent_is_killed_blender_ends_and_another_run_resumes(
    tmp_path: Path, undisturbed: tuple[RenderedView, ...]
) -> None:
    process = multiprocessing.get_context("spawn").Process(target=_render_until_killed, args=(tmp_path,))
    process.start()
    process.join(60.0)
    assert process.exitcode == -signal.SIGKILL
    deadline = time.monotonic() + 5.0
    pids = (tmp_path / "child").read_text().split()
    assert pids
    while subprocess.run(["ps", "-o", "stat=", "-p", ",".join(pids)], capture_output=True).stdout.strip(b" Z\n"):
        assert time.monotonic() < deadline, "Blender outlived its parent"
        time.sleep(0.05)
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "frames").glob("0*")}
    assert len(kept) >= 1
    progress: list[int] = []
    views = render_views(
        _room(), (_actor(),), _cameras(), CONFIG, "cpu", tmp_path, lambda done, *_: progress.append(done)
    )
    assert progress == list(range(len(kept) + 1, FRAMES + 1))
    assert kept == {path: path.stat().st_mtime_ns for path in kept}
    _assert_same(views, undisturbed)
