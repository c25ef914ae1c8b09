"""Real renders of small scenes: exact ground truth, exposure, and identical bytes after a kill."""

import logging
import multiprocessing
import os
import signal
import sys
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float64
from PIL import Image

from perpetua.geometry.pinhole import Intrinsics, unproject
from perpetua.geometry.transforms import look_at, transform_points
from perpetua.rendering.render import render_views
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.scene import RenderedView
from tests.support.plane_scene import (
    ACTOR_INDEX,
    CONFIG,
    FRAMES,
    NORMAL,
    OFFSET_M,
    PATCH_HEIGHT_M,
    PLANE_INDEX,
    assert_same,
    patch,
    plane_room,
    two_cameras,
)
from tests.support.waiting import has_ended, wait_for

pytestmark = pytest.mark.blender


def _points_at(camera: CameraPath, depth_m: Float64[np.ndarray, "H W"], frame: int) -> Float64[np.ndarray, "H W 3"]:
    """World point of every pixel's centre at a depth."""
    rows, columns = np.mgrid[: camera.intrinsics.height_px, : camera.intrinsics.width_px]
    pixel_px = np.stack([columns, rows], axis=-1).astype(np.float64)
    points_m = unproject(camera.intrinsics, pixel_px, depth_m)
    return transform_points(camera.world_from_camera[frame], points_m.reshape(-1, 3)).reshape(points_m.shape)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> tuple[RenderedView, ...]:
    folder = tmp_path_factory.mktemp("undisturbed")
    return render_views(plane_room(), (patch(),), two_cameras(), CONFIG, "cpu", folder, lambda *_: None)


def test_every_pixel_lies_on_the_surface_it_shows(undisturbed: tuple[RenderedView, ...]) -> None:
    for camera, view in zip(two_cameras(), undisturbed, strict=True):
        for frame in range(FRAMES):
            along_normal_m = _points_at(camera, view.depth_m[frame].astype(np.float64), frame) @ NORMAL
            index = view.object_index[frame]
            assert set(np.unique(index)) == {PLANE_INDEX, ACTOR_INDEX}
            np.testing.assert_allclose(along_normal_m[index == PLANE_INDEX], OFFSET_M, atol=1e-4)
            expected_m = OFFSET_M + PATCH_HEIGHT_M[frame]
            np.testing.assert_allclose(along_normal_m[index == ACTOR_INDEX], expected_m, atol=1e-4)


def test_the_actor_is_exactly_where_its_vertices_are(undisturbed: tuple[RenderedView, ...]) -> None:
    """A pixel shows the actor exactly if its ray meets the patch, but for rays within 1 mm of the patch's rim."""
    for camera, view in zip(two_cameras(), undisturbed, strict=True):
        for frame in range(FRAMES):
            corners_m = patch().vertices_m[frame].astype(np.float64)
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
    camera = CameraPath(0, two_cameras()[0].world_from_camera[:1], two_cameras()[0].intrinsics)
    actor = ActorMesh(0, ACTOR_INDEX, "", patch().parts, patch().vertices_m[:1])
    levels = []
    for power_w in (4e4, 4e6):
        folder = tmp_path / f"{power_w:g}"
        (view,) = render_views(plane_room(power_w), (actor,), (camera,), CONFIG, "cpu", folder, lambda *_: None)
        levels.append(float(np.asarray(Image.open(BytesIO(view.jpeg[0]))).mean()))
    assert 60.0 < levels[0] < 190.0
    assert abs(levels[0] - levels[1]) < 3.0


def test_white_balance_takes_the_lamps_colour_out(tmp_path: Path) -> None:
    """A grey plane under an orange lamp."""
    camera = CameraPath(0, two_cameras()[0].world_from_camera[:1], two_cameras()[0].intrinsics)
    room = plane_room()
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
        (view,) = render_views(plane_room(), (), (camera,), CONFIG, absent, tmp_path, lambda *_: None)
    assert not view.depth_m.any()
    assert not view.object_index.any()
    assert f"no {absent} device" in caplog.text


def test_a_blender_program_renders_the_same(tmp_path: Path, undisturbed: tuple[RenderedView, ...]) -> None:
    """A stand-in that takes Blender's arguments and runs the script as Blender does: its own arguments and all."""
    program = tmp_path / "blender"
    program.write_text(
        f"#!{sys.executable}\nimport runpy, sys\n"
        "print('Blender 4.2.0 (a stand-in)', flush=True)\n"
        "assert sys.argv[1:4] == ['-b', '--factory-startup', '--disable-autoexec']\n"
        "runpy.run_path(sys.argv[sys.argv.index('-P') + 1], run_name='__main__')\n"
    )
    program.chmod(0o755)
    config = CONFIG.model_copy(update={"blender": str(program), "threads": 1})
    views = render_views(plane_room(), (patch(),), two_cameras(), config, "cpu", tmp_path / "job", lambda *_: None)
    assert_same(views, undisturbed)


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

    views = render_views(plane_room(), (patch(),), two_cameras(), CONFIG, "cpu", tmp_path, kill_after_first_frame)
    assert [first_frame.stat().st_mtime_ns] == changed_ns
    assert_same(views, undisturbed)


def _render_until_killed(folder: Path) -> None:
    def die(done: int, total: int, seconds: float) -> None:
        (folder / "child").write_text(" ".join(map(str, _children())))
        os.kill(os.getpid(), signal.SIGKILL)

    render_views(plane_room(), (patch(),), two_cameras(), CONFIG, "cpu", folder, die)


def test_when_the_parent_is_killed_blender_ends_and_another_run_resumes(
    tmp_path: Path, undisturbed: tuple[RenderedView, ...]
) -> None:
    process = multiprocessing.get_context("spawn").Process(target=_render_until_killed, args=(tmp_path,))
    process.start()
    process.join(60.0)
    assert process.exitcode == -signal.SIGKILL
    pids = [int(pid) for pid in (tmp_path / "child").read_text().split()]
    assert pids
    wait_for(lambda: all(has_ended(pid) for pid in pids), "Blender to end after its parent", most_s=60.0)
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "frames").glob("0*")}
    assert len(kept) >= 1
    progress: list[int] = []
    views = render_views(
        plane_room(), (patch(),), two_cameras(), CONFIG, "cpu", tmp_path, lambda done, *_: progress.append(done)
    )
    assert progress == list(range(len(kept) + 1, FRAMES + 1))
    assert kept == {path: path.stat().st_mtime_ns for path in kept}
    assert_same(views, undisturbed)
