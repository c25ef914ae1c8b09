"""Baking: the baked room looks the same, has the same ground truth, and is made once."""

import logging
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float64
from PIL import Image

from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.pinhole import Intrinsics
from perpetua.geometry.transforms import look_at
from perpetua.rendering import bake
from perpetua.rendering.config import RenderConfig
from perpetua.rendering.render import render_views
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room, SceneObject
from perpetua.scene.scene import RenderedView

pytestmark = pytest.mark.blender

CONFIG = RenderConfig(width_px=96, height_px=48, samples=48, noise_threshold=0.0, max_texels=60_000)


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Room:
    folder = tmp_path_factory.mktemp("room")
    blend = folder / "room.blend"
    script = Path(__file__).parent / "make_procedural_room.py"
    subprocess.run(
        [sys.executable, str(script), str(blend)],
        check=True,
        capture_output=True,
        env={"BLENDER_USER_RESOURCES": str(folder), "PATH": ""},
    )
    corners_m = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    boards = tuple(
        SceneObject(
            k,
            f"board_{k}",
            "board",
            TriMesh(corners_m + np.array([x_m, y_m, 0.0]), np.array([[0, 1, 2], [0, 2, 3]], np.int32)),
            None,
            False,
            True,
        )
        for k, (x_m, y_m) in enumerate([(-2.1, 0.0), (0.0, 0.0), (2.1, 0.0), (0.0, 2.1)], start=1)
    )
    return Room("boards", "livingroom", np.zeros((4, 2)), 2.5, boards, (), blend)


def _camera() -> CameraPath:
    pose = look_at(np.array([[0.2, -2.6, 3.4]]), np.array([[0.0, 0.0, 0.0]]))
    return CameraPath(0, pose, Intrinsics.centred(96, 48, 1.5))


def _render(room: Room, config: RenderConfig, folder: Path) -> RenderedView:
    return render_views(room, (), (_camera(),), config, "cpu", folder, lambda *_: None)[0]


def _picture(view: RenderedView) -> Float64[np.ndarray, "H W 3"]:
    return np.asarray(Image.open(BytesIO(view.jpeg[0])), np.float64)


def test_a_baked_room_looks_the_same(
    room: Room, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(bake, "MIN_SAMPLES", 0)
    monkeypatch.setattr(bake, "MIN_TEXELS", 60_000)
    with caplog.at_level(logging.INFO):
        baked = _render(room, CONFIG, tmp_path / "baked")
    # The two boards that share a mesh share its images; the plain board and the screen need none.
    assert "baked 4 images" in caplog.text
    plain = _render(room, CONFIG.model_copy(update={"bake": False}), tmp_path / "plain")
    np.testing.assert_array_equal(baked.depth_m, plain.depth_m)
    np.testing.assert_array_equal(baked.object_index, plain.object_index)
    difference = np.abs(_picture(baked) - _picture(plain))
    for index in (1, 2, 3, 4):
        assert difference[plain.object_index[0] == index].mean() < 5.0
    # The screen shines.
    assert _picture(baked)[plain.object_index[0] == 4].max() > 100.0
    # The checks are there: an edge of the original is an edge of the baked picture.
    seen = plain.object_index[0] == 2
    reds = _picture(plain)[..., 0][seen], _picture(baked)[..., 0][seen]
    assert np.corrcoef(*reds)[0, 1] > 0.95
    assert reds[0].std() > 20.0


def test_a_second_sequence_bakes_only_what_is_seen_otherwise(
    room: Room, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(bake, "MIN_SAMPLES", 0)
    cache = tmp_path / "baked"

    def baked(camera: CameraPath, config: RenderConfig = CONFIG) -> tuple[Path, int]:
        """The baked file, and how many images had to be baked for it."""
        caplog.clear()
        with caplog.at_level(logging.INFO):
            path = bake.bake_room(room, (camera,), config, 1, cache)
        counts = re.findall(r"baked (\d+) images", caplog.text)
        return path, int(counts[0]) if counts else 0

    first, count = baked(_camera())
    assert count == 4
    stamps = {path.name: path.stat().st_mtime_ns for path in first.parent.iterdir()}
    assert baked(_camera()) == (first, 0)
    # Other cameras that are as close find the images, and get a .blend of their own.
    beside = _camera()
    beside.world_from_camera[:, 0, 3] += 0.01
    second, count = baked(beside)
    assert count == 0
    assert second != first
    assert all((first.parent / name).stat().st_mtime_ns == stamps[name] for name in stamps if name.endswith(".png"))
    # Closer ones need finer textures.
    closer = _camera()
    closer.world_from_camera[:, :3, 3] *= 0.3
    assert baked(closer)[1] == 4
    # What was baked of another room goes.
    other = replace(room, blend_path=tmp_path / "other.blend")
    shutil.copy(room.blend_path or "", other.blend_path or "")
    with (tmp_path / "other.blend").open("ab") as stream:
        stream.write(b" ")
    bake.bake_room(other, (_camera(),), CONFIG, 1, cache)
    assert not first.exists()
