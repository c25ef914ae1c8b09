from pathlib import Path

import pytest

from perpetua.pipeline import store


def _finished(room_folder: Path, key: str = "k1") -> store.StageFolder:
    folder = store.StageFolder(room_folder, 10, "room")
    partial = folder.begin(key, resumable=False)
    (partial / "value.json").write_text("1")
    (partial / "deep").mkdir()
    (partial / "deep" / "mesh.npy").write_bytes(b"mesh")
    folder.finish(store.Manifest(key, "room", 1, 7, 0, {}, store.output_hashes(partial), 0.5, 10.0))
    return folder


def test_finished_stage_is_complete_under_its_key_only(tmp_path: Path) -> None:
    folder = _finished(tmp_path)
    assert folder.is_complete("k1")
    assert not folder.is_complete("k2")
    assert not folder.partial.exists()
    manifest = folder.manifest()
    assert manifest is not None
    assert set(manifest.outputs) == {"value.json", "deep/mesh.npy"}


@pytest.mark.parametrize("damage", ["change", "truncate", "remove", "add", "manifest"])
def test_damage_makes_a_stage_incomplete(tmp_path: Path, damage: str) -> None:
    folder = _finished(tmp_path)
    mesh = folder.final / "deep" / "mesh.npy"
    if damage == "change":
        mesh.write_bytes(b"mash")
    elif damage == "truncate":
        mesh.write_bytes(b"me")
    elif damage == "remove":
        mesh.unlink()
    elif damage == "add":
        (folder.final / "more").write_text("x")
    else:
        (folder.final / store.MANIFEST_FILE).write_text("{")
    assert not folder.is_complete("k1")


def test_interrupted_work_is_kept_only_for_the_same_key_of_a_resumable_stage(tmp_path: Path) -> None:
    folder = store.StageFolder(tmp_path, 70, "render")
    (folder.begin("k1", resumable=True) / "frame").write_text("done")
    assert (folder.begin("k1", resumable=True) / "frame").exists()
    assert not (folder.begin("k2", resumable=True) / "frame").exists()
    (folder.partial / "frame").write_text("done")
    assert not (folder.begin("k2", resumable=False) / "frame").exists()


def test_key_depends_on_content_not_on_order() -> None:
    assert store.key_of({"a": 1, "b": [1.5, None]}) == store.key_of({"b": [1.5, None], "a": 1})
    assert store.key_of({"a": 1}) != store.key_of({"a": "1"})


def test_replaced_folder_is_whole(tmp_path: Path) -> None:
    for name, content in (("old", "1"), ("new", "2")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text(content)
    store.replace_folder(tmp_path / "new", tmp_path / "old")
    assert (tmp_path / "old" / "file").read_text() == "2"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["old"]


def test_linked_tree_shares_space_and_outlives_its_source(tmp_path: Path) -> None:
    folder = _finished(tmp_path)
    store.link_tree(folder.final, tmp_path / "copy")
    original, copy = folder.final / "deep" / "mesh.npy", tmp_path / "copy" / "deep" / "mesh.npy"
    assert original.stat().st_ino == copy.stat().st_ino
    original.unlink()
    assert copy.read_bytes() == b"mesh"
