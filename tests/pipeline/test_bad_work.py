"""Work areas and runs that are damaged or forged: never believed, never followed out of their folder."""

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from perpetua.config import Config
from perpetua.errors import InputError
from perpetua.io.files import read_json
from perpetua.pipeline import codec, store, work_area
from perpetua.pipeline.layout import read_run
from perpetua.pipeline.stages import STAGES
from tests.support.robustness import BadInput


def _value(tree: Any) -> str:
    return json.dumps(tree)


def _write(name: str, content: str | bytes) -> Any:
    def spoil(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())

    return spoil


def _link_out(folder: Path) -> None:
    outside = folder.parent / "outside.npy"
    (folder / "a1.npy").rename(outside)
    (folder / "a1.npy").symlink_to(outside)


def _objects(folder: Path) -> None:
    np.save(folder / "a1.npy", np.full(3, None), allow_pickle=True)


BAD_STAGES = (
    BadInput(
        "value that names a file outside", _write("value.json", _value({"@array": "../outside.npy"})), "leads out"
    ),
    BadInput(
        "value that names a file by its whole path",
        _write("value.json", _value({"@path": "/etc/hostname"})),
        "leads out",
    ),
    BadInput(
        "value of a type that is none of ours", _write("value.json", _value({"@type": "Popen", "fields": {}})), "Popen"
    ),
    BadInput("value whose array is a number", _write("value.json", _value({"@array": 7})), "cannot read the stage"),
    BadInput("value nested 100,000 deep", _write("value.json", "[" * 100_000 + "]" * 100_000), "nested too deeply"),
    BadInput("value cut short", _write("value.json", '{"@tuple": ['), "cannot read the stage"),
    BadInput("array file that is a link outside", _link_out, "leads out"),
    BadInput("array of Python objects", _objects, "Python objects"),
    BadInput("small arrays that are no archive", _write("arrays.npz", b"PK\x03\x04broken"), "cannot read the stage"),
    BadInput("large array cut short", _write("a1.npy", b"\x93NUMPY\x01\x00"), "cannot read the stage"),
)


def _stage(folder: Path) -> Path:
    folder.mkdir(parents=True)
    codec.save((np.zeros(200_000), np.arange(3)), folder)
    return folder


@pytest.mark.parametrize("case", BAD_STAGES, ids=str)
def test_bad_stage_is_refused(tmp_path: Path, case: BadInput) -> None:
    folder = _stage(tmp_path / "stage")
    case.spoil(folder)
    with pytest.raises(codec.DamagedValueError) as caught:
        codec.load(folder)
    assert case.says in str(caught.value)


BAD_RUNS = (
    BadInput("no run.json", lambda folder: (folder / "run.json").unlink(), "holds no run of perpetua"),
    BadInput("run.json empty, as after a power failure", _write("run.json", ""), "--replace"),
    BadInput("run.json cut short", _write("run.json", '{"seed": 1, "rooms": ['), "--replace"),
    BadInput("run.json nested 100,000 deep", _write("run.json", "[" * 100_000 + "]" * 100_000), "nested too deeply"),
    BadInput("run.json that is a list", _write("run.json", "[]"), "--replace"),
    BadInput(
        "run.json with a room that is no number",
        _write("run.json", '{"seed": 1, "rooms": ["../x"], "config": {}}'),
        "../x",
    ),
    BadInput(
        "run.json with settings of another version",
        _write("run.json", '{"seed": 1, "rooms": [0], "config": {"old": 1}}'),
        "old",
    ),
)


@pytest.mark.parametrize("case", BAD_RUNS, ids=str)
def test_bad_run_is_refused(tmp_path: Path, case: BadInput) -> None:
    run = {"seed": 1, "rooms": [0], "config": Config().model_dump(mode="json")}
    (tmp_path / "run.json").write_text(json.dumps(run))
    assert read_run(tmp_path).seed == 1
    case.spoil(tmp_path)
    with pytest.raises(InputError) as caught:
        read_run(tmp_path)
    assert case.says in str(caught.value)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    "content", ["", "[]", "{", "[" * 100_000, "7", "\ud800".encode("utf-8", "surrogatepass").decode("latin1")]
)
def test_notes_that_cannot_be_read_say_nothing(tmp_path: Path, content: str) -> None:
    (tmp_path / "rejected.json").write_text(content, encoding="latin1")
    assert read_json(tmp_path / "rejected.json") == {}


def _finished(work: Path, name: str) -> store.StageFolder:
    stage = next(stage for stage in STAGES if stage.name == name)
    folder = store.StageFolder(work, stage.number, name)
    partial = folder.begin("key", resumable=False)
    codec.save((np.zeros(200_000), np.arange(3)), partial)
    folder.finish(store.Manifest("key", name, 1, 7, 0, {}, store.output_hashes(partial), 0.5, 10.0))
    return folder


@pytest.mark.parametrize("damage", ["flip", "cut", "manifest"])
def test_damaged_work_is_not_used(tmp_path: Path, damage: str) -> None:
    folder = _finished(tmp_path / ".work" / "s", "room")
    path = folder.final / ("manifest.json" if damage == "manifest" else "a1.npy")
    content = bytearray(path.read_bytes())
    content[-9] ^= 1
    path.write_bytes(content if damage == "flip" else content[:-9])
    sequence = tmp_path / "train" / "s"
    sequence.mkdir(parents=True)
    (sequence / "tracks_xyz.npy").touch()
    with pytest.raises(InputError, match="is missing" if damage == "manifest" else r"a1\.npy' is not what was written"):
        work_area.load_scene(sequence)


def test_a_sequence_is_on_disk_before_it_has_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    flushed: set[int] = set()
    truly = os.fsync

    def fsync(handle: int) -> None:
        flushed.add(os.fstat(handle).st_ino)
        truly(handle)

    monkeypatch.setattr(os, "fsync", fsync)
    (tmp_path / "sequence" / "0").mkdir(parents=True)
    (tmp_path / "sequence" / "0" / "depth.npy").write_bytes(b"depth")
    store.flush_tree(tmp_path / "sequence")
    everything = [tmp_path / "sequence", *(tmp_path / "sequence").rglob("*")]
    assert flushed == {path.stat().st_ino for path in everything}
