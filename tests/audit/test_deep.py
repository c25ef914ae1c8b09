"""verify --deep: rays at the meshes find what files alone cannot show."""

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from perpetua.audit.config import AuditConfig
from perpetua.audit.verify import verify_sequence
from perpetua.testing.synthetic_scene import make_scene
from perpetua.testing.synthetic_sequence import write_scene
from tests.support.planted_faults import Fault, assign, change

FRAMES = 3
DEEP = ("depth by rays", "objects by rays", "visibility by rays", "tracks on meshes")


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("deep") / "sequence"
    write_scene(folder)
    return folder


@pytest.fixture
def sequence(good: Path, tmp_path: Path) -> Path:
    shutil.copytree(good, tmp_path / "sequence")
    return tmp_path / "sequence"


def _deep(folder: Path, with_index: bool = True, swapped: bool = False) -> dict[str, tuple[bool, float, str]]:
    scene = make_scene()
    views = list(scene.views)
    if swapped:
        views[0], views[1] = views[1], views[0]
    deep = replace(scene, views=tuple(views) if with_index else ())
    report = verify_sequence(folder, AuditConfig(), deep, FRAMES)
    return {check.name: (check.passed, check.value, check.detail) for check in report.checks if check.name in DEEP}


def _change(path: Path, entry: tuple[object, ...], value: object) -> None:
    array = np.load(path)
    array[entry] = value
    np.save(path, array)


@pytest.mark.parametrize("with_index", [True, False])
def test_good_data_agrees_with_rays_everywhere(good: Path, with_index: bool) -> None:
    found = _deep(good, with_index)
    assert set(found) == set(DEEP) and all(passed for passed, _, _ in found.values()), found
    assert [found[name][1] for name in DEEP[:3]] == [1.0, 1.0, 1.0]
    assert found["tracks on meshes"][1] < 1e-6


def test_depth_two_millimetres_off_is_caught(sequence: Path) -> None:
    depth_m = np.load(sequence / "1/depth.npy")
    _change(sequence / "1/depth.npy", (5,), depth_m[5] + np.float32(0.002))
    passed, _, detail = _deep(sequence)["depth by rays"]
    assert not passed and "1/depth.npy[5, " in detail


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
        assert passed or f"2/visibility.npy[0, {tracks[0]}]" in detail


def test_a_mask_that_shows_other_objects_is_caught(sequence: Path) -> None:
    _change(sequence / "0/foreground_mask.npy", (0, slice(20, 40)), True)
    assert not _deep(sequence, with_index=False)["objects by rays"][0]
    assert _deep(sequence, with_index=True)["objects by rays"][0], "the rendered index is what is asked first"


def _record(name: str, alter: Callable[[list[Any]], Any]) -> Fault:
    """Alters one column of the record's table of tracks in place."""

    def plant(folder: Path) -> None:
        record = json.loads((folder / "sequence.json").read_text())
        alter(record["tracks"][name])
        (folder / "sequence.json").write_text(json.dumps(record))

    return plant


def _scaled_world(folder: Path) -> None:
    """Everything one percent larger, in all files alike."""
    for path in (folder / "tracks_xyz.npy", folder / "surface_xyz.npy", *folder.glob("*/depth.npy")):
        np.save(path, np.load(path) * np.float32(1.01))
    for path in folder.glob("*/extrinsics_w2c.npy"):
        pose = np.load(path)
        pose[:, :3, 3] *= np.float32(1.01)
        np.save(path, pose)


def _actors_exchanged(column: list[int]) -> None:
    column[:] = [{5: 6, 6: 5}.get(index, index) for index in column]


def _hide_a_block(visible: np.ndarray) -> None:
    visible[2, np.flatnonzero(visible[2])[:5]] = False


def _camera_aside(poses: np.ndarray) -> None:
    poses[:, 0, 3] += 0.01


def _closer_by_two_millimetres(depth_m: np.ndarray) -> None:
    depth_m[depth_m > 0] -= 0.002


def _first_corner_last(weights: list[list[float]]) -> None:
    weights[7] = weights[7][::-1]


# The files agree with one another in most of these: only the meshes tell.
FAULTS: dict[str, tuple[Fault, str, str]] = {
    "depth two millimetres too near in one view": (
        change("2/depth.npy", _closer_by_two_millimetres), "depth by rays", "2/depth.npy"),
    "depth in half precision": (
        change("0/depth.npy", lambda a: a.astype("f2").astype("f4")), "depth by rays", r"0/depth.npy\[0"),
    "depth one frame late": (change("0/depth.npy", lambda a: np.roll(a, 1, axis=0)), "depth by rays", "0/depth.npy"),
    "a camera one centimetre aside": (change("1/extrinsics_w2c.npy", _camera_aside), "depth by rays", "1/depth.npy"),
    "a focal length half a percent too long": (
        change("1/intrinsics.npy", lambda a: a * np.array([1.005, 1.005, 1, 1], "f4")), "depth by rays", "1/depth.npy"),
    "a block called visible": (
        assign("0/visibility.npy", (2, slice(None, 40)), True), "visibility by rays", r"0/visibility.npy\[2"),
    "a block called hidden": (change("0/visibility.npy", _hide_a_block), "visibility by rays", r"0/visibility.npy\[2"),
    "visibility one frame late": (
        change("1/visibility.npy", lambda a: np.roll(a, 1, axis=0)), "visibility by rays", "1/visibility.npy"),
    "tracks one frame late": (
        change("tracks_xyz.npy", lambda a: np.roll(a, 1, axis=0)), "tracks on meshes", r"tracks_xyz.npy\[\d, \d+\]"),
    "triangles one frame late": (
        change("surface_xyz.npy", lambda a: np.roll(a, 1, axis=0)), "tracks on meshes", "surface_xyz.npy"),
    "the world scaled": (_scaled_world, "tracks on meshes", "m from face"),
    "one track on another object": (_record("object_index", lambda c: c.__setitem__(7, 3)), "tracks on meshes", ", 7"),
    "one track on an object that does not exist": (
        _record("object_index", lambda c: c.__setitem__(7, 99)), "tracks on meshes", "is inf m from face"),
    "one track on the next face": (
        _record("face", lambda c: c.__setitem__(7, c[7] + 1)), "tracks on meshes", ", 7"),
    "two actors exchanged": (_record("object_index", _actors_exchanged), "tracks on meshes", "object [56]"),
    "one barycentric point turned round": (_record("barycentric", _first_corner_last), "tracks on meshes", ", 7"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_planted_fault_is_caught_by_rays_or_meshes(sequence: Path, name: str) -> None:
    plant, check, words = FAULTS[name]
    plant(sequence)
    passed, value, detail = _deep(sequence)[check]
    assert not passed and re.search(words, detail), (value, detail)


def test_object_indices_of_two_views_exchanged_are_caught(good: Path) -> None:
    passed, _, detail = _deep(good, swapped=True)["objects by rays"]
    assert not passed and "object index of view 0[0, " in detail


def test_without_a_sound_table_of_tracks_no_rays_are_cast(sequence: Path) -> None:
    _record("face", lambda column: column.pop())(sequence)
    scene = make_scene()
    report = verify_sequence(sequence, AuditConfig(), scene, FRAMES)
    assert any("rays at the meshes: sequence.json must have one entry" in reason for reason in report.skipped)
