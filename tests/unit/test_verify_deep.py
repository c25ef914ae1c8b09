"""verify --deep: rays at the meshes find what files alone cannot show."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from synthetic_scene import make_scene
from synthetic_sequence import write_scene

from perpetua.audit.config import AuditConfig
from perpetua.audit.deep import DeepScene, verify_deep
from perpetua.audit.files import load_files

FRAMES = 3


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("deep") / "sequence"
    write_scene(folder)
    return folder


@pytest.fixture
def sequence(good: Path, tmp_path: Path) -> Path:
    shutil.copytree(good, tmp_path / "sequence")
    return tmp_path / "sequence"


def _deep(folder: Path, with_index: bool = True) -> dict[str, tuple[bool, float, str]]:
    scene = make_scene()
    index = tuple(view.object_index for view in scene.views) if with_index else None
    files, _ = load_files(folder)
    checks = verify_deep(files, DeepScene(scene.room, scene.actors, index), AuditConfig(), FRAMES)
    return {check.name: (check.passed, check.value, check.detail) for check in checks}


def _change(path: Path, entry: tuple[object, ...], value: object) -> None:
    array = np.load(path)
    array[entry] = value
    np.save(path, array)


@pytest.mark.parametrize("with_index", [True, False])
def test_good_data_agrees_with_rays_everywhere(good: Path, with_index: bool) -> None:
    assert {name: value for name, (_, value, _) in _deep(good, with_index).items()} == {
        "depth by rays": 1.0,
        "objects by rays": 1.0,
        "visibility by rays": 1.0,
    }


def test_depth_two_millimetres_off_is_caught(sequence: Path) -> None:
    depth_m = np.load(sequence / "1/depth.npy")
    _change(sequence / "1/depth.npy", (5,), depth_m[5] + np.float32(0.002))
    passed, _, detail = _deep(sequence)["depth by rays"]
    assert not passed and "view 1, frame 5" in detail


def test_each_wrong_bit_of_visibility_counts(sequence: Path) -> None:
    visibility = np.load(sequence / "2/visibility.npy")
    entries = 3 * FRAMES * visibility.shape[1]
    hidden, seen = np.flatnonzero(~visibility[0]), np.flatnonzero(visibility[0])
    for tracks, wrong in ((hidden[:1], True), (seen[:2], False)):
        _change(sequence / "2/visibility.npy", (0,), visibility[0])
        _change(sequence / "2/visibility.npy", (0, tracks), wrong)
        passed, value, detail = _deep(sequence)["visibility by rays"]
        assert value == pytest.approx(1.0 - len(tracks) / entries, abs=1e-9)
        assert passed == (len(tracks) / entries <= 0.001)
        assert passed or f"view 2, frame 0, at [{tracks[0]}]" in detail


def test_a_mask_that_shows_other_objects_is_caught(sequence: Path) -> None:
    _change(sequence / "0/foreground_mask.npy", (0, slice(20, 40)), True)
    assert not _deep(sequence, with_index=False)["objects by rays"][0]
    assert _deep(sequence, with_index=True)["objects by rays"][0], "the rendered index is what is asked first"


def test_tracks_one_frame_late_are_caught(sequence: Path) -> None:
    tracks = np.load(sequence / "tracks_xyz.npy")
    np.save(sequence / "tracks_xyz.npy", np.roll(tracks, 1, axis=0))
    assert not _deep(sequence)["visibility by rays"][0]
