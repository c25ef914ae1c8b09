import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from perpetua.geometry.mesh import TriMesh
from perpetua.pipeline import codec
from perpetua.pipeline.store import output_hashes
from perpetua.scene.room import AreaLight, Material, Room, SceneObject
from perpetua.tracks.types import VisibilityReport


def _room(folder: Path, big: int = 10) -> Room:
    blend = folder / "room.blend"
    blend.write_bytes(b"blend")
    rng = np.random.default_rng(5)
    mesh = TriMesh(rng.normal(size=(big, 3)), np.arange(big - big % 3, dtype=np.int32).reshape(-1, 3))
    image = rng.integers(0, 255, (4, 5, 3), dtype=np.uint8)
    material = Material("m", (0.1, 0.2, 1 / 3), image=image)
    return Room(
        "r", "kitchen", np.eye(2), 2.5, (SceneObject(1, "a", "table", mesh, material, False, True),),
        (AreaLight((0.0, 0.0, 2.0), (0.0, 0.0, -1.0), (1.0, 1.0), 60.0, (1.0, 1.0, 1.0)),), blend,
    )  # fmt: skip


@pytest.mark.parametrize("big", [10, 60_000])
def test_what_is_saved_is_read_back(tmp_path: Path, big: int) -> None:
    room = _room(tmp_path, big)
    codec.save((room, b"\x00jpeg", None, 3), tmp_path)
    read, raw, nothing, three = codec.load(tmp_path)
    assert (raw, nothing, three) == (b"\x00jpeg", None, 3)
    assert read.blend_path == room.blend_path.resolve() if room.blend_path else False
    assert read.lights == room.lights
    assert read.objects[0].material.base_color == (0.1, 0.2, 1 / 3)
    for name in ("vertices_m", "faces"):
        before, after = getattr(room.objects[0].mesh, name), getattr(read.objects[0].mesh, name)
        np.testing.assert_array_equal(before, after)
        assert before.dtype == after.dtype
    assert isinstance(read.objects[0].mesh.vertices_m, np.memmap) == (big > 1000)


def test_equal_values_give_equal_bytes(tmp_path: Path) -> None:
    hashes = []
    for name in ("a", "b"):
        folder = tmp_path / name
        folder.mkdir()
        codec.save(_room(folder, 60_000), folder)
        hashes.append(output_hashes(folder))
    assert hashes[0] == hashes[1]
    assert len(hashes[0]) >= 4


def test_memory_map_in_the_folder_is_not_copied(tmp_path: Path) -> None:
    np.save(tmp_path / "depth.npy", np.zeros((3, 4), np.float32))
    depth = np.load(tmp_path / "depth.npy", mmap_mode="r")
    codec.save((depth,), tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["depth.npy", codec.VALUE_FILE]
    assert codec.load(tmp_path)[0].shape == (3, 4)


def test_part_of_a_memory_map_is_stored_as_that_part(tmp_path: Path) -> None:
    np.save(tmp_path / "depth.npy", np.arange(12, dtype=np.float32).reshape(3, 4))
    depth = np.load(tmp_path / "depth.npy", mmap_mode="r")
    codec.save((depth[1],), tmp_path)
    np.testing.assert_array_equal(codec.load(tmp_path)[0], [4, 5, 6, 7])


def test_values_without_a_file_form_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TypeError, match="STORED_TYPES"):
        codec.save((object(),), tmp_path)
    with pytest.raises(TypeError, match="must lie in its folder"):
        codec.save((Path("/etc/hosts"),), tmp_path)
    with pytest.raises(TypeError, match="array of Python objects"):
        codec.save((np.array([None]),), tmp_path)


@pytest.mark.parametrize(
    "tree",
    [
        {"@path": "../secret"},
        {"@array": "../secret.npy"},
        {"@type": "Path", "fields": {}},
        {"@type": "TriMesh", "fields": {"unknown": 1}},
        {"@array": "missing.npy"},
    ],
)
def test_damaged_or_hostile_value_is_refused(tmp_path: Path, tree: object) -> None:
    (tmp_path / "stage").mkdir()
    (tmp_path / "stage" / codec.VALUE_FILE).write_text(json.dumps(tree))
    with pytest.raises(codec.DamagedValueError):
        codec.load(tmp_path / "stage")


def test_every_stored_type_is_a_dataclass_of_its_own_name() -> None:
    assert all(dataclasses.is_dataclass(kind) and kind.__name__ == name for name, kind in codec.STORED_TYPES.items())


def test_a_type_under_its_old_name_is_read(tmp_path: Path) -> None:
    codec.save(VisibilityReport(entries=7, visible=3), tmp_path)
    stored = tmp_path / codec.VALUE_FILE
    stored.write_text(stored.read_text().replace("VisibilityReport", "SightReport"))
    assert codec.load(tmp_path) == VisibilityReport(entries=7, visible=3)
