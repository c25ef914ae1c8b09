"""What every exporter keeps, on a small scene that no Blender has seen."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from perpetua.errors import SequenceFormatError
from perpetua.formats.reader import read_sequence
from perpetua.formats.source import EXPORTERS, ExportSource
from perpetua.testing.samples import ExporterSample
from perpetua.testing.synthetic_sequence import write_scene

NAME = "seed5-room0002"
NEXT_NAME = "seed5-room0003"
Chosen = tuple[str, ExporterSample]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished sequence; tests that change it work on a copy."""
    folder = tmp_path_factory.mktemp("finished") / NAME
    write_scene(folder)
    return folder


def _write(chosen: Chosen, sequence: Path, target: Path, name: str = NAME) -> dict[str, bytes]:
    """Exports into a folder, which is made if need be; returns what lies in it then."""
    target.mkdir(parents=True, exist_ok=True)
    EXPORTERS[chosen[0]]().write(ExportSource(name, read_sequence(sequence)), target)
    return _files(target)


def _files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_it_writes_into_its_folder_alone(
    exporter: Chosen, finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("elsewhere", "here"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    before = _files(finished)
    made = _write(exporter, finished, tmp_path / "here" / "target")
    assert made and all(made.values()), "files, none of them empty"
    assert set(_files(tmp_path)) == {f"here/target/{name}" for name in made}
    assert _files(finished) == before, "the sequence stays as it is"


def test_equal_sequences_give_equal_bytes(exporter: Chosen, finished: Path, tmp_path: Path) -> None:
    first, again = (_write(exporter, finished, tmp_path / name) for name in ("first", "again"))
    assert set(first) == set(again)
    if exporter[1].repeatable:
        assert first == again


def test_sequences_lie_beside_each_other(exporter: Chosen, finished: Path, tmp_path: Path) -> None:
    first = _write(exporter, finished, tmp_path)
    both = _write(exporter, finished, tmp_path, NEXT_NAME)
    assert {name: both[name] for name in first} == first, "the one that was there is as it was"
    tops = [{name.partition("/")[0] for name in names} for names in (first, set(both) - set(first))]
    assert all(tops) and not tops[0] & tops[1]


@pytest.mark.parametrize("name", ["../outside", "/outside", "a/b", "..", "wall\\ü\n"])
def test_names_of_objects_do_not_lead_out_of_the_folder(
    exporter: Chosen, finished: Path, tmp_path: Path, name: str
) -> None:
    sequence = Path(shutil.copytree(finished, tmp_path / "sequence" / NAME))
    record = json.loads((sequence / "sequence.json").read_text(encoding="utf-8"))
    record["objects"] = [{**entry, "name": name} for entry in record["objects"]]
    (sequence / "sequence.json").write_text(json.dumps(record), encoding="utf-8")
    made = _or_refused(exporter, sequence, tmp_path / "deep" / "target")
    written = {path for path in _files(tmp_path) if not path.startswith("sequence/")}
    assert written == {f"deep/target/{path}" for path in made}


def _without_depth(folder: Path) -> None:
    for path in folder.rglob("depth.npy"):
        path.unlink()


def _without_record(folder: Path) -> None:
    (folder / "sequence.json").unlink()


def _tracks_of_another_count(folder: Path) -> None:
    record = json.loads((folder / "sequence.json").read_text(encoding="utf-8"))
    record["tracks"] = {**record.get("tracks", {}), "object_index": [1]}
    (folder / "sequence.json").write_text(json.dumps(record), encoding="utf-8")


@pytest.mark.parametrize("take_away", [_without_depth, _without_record, _tracks_of_another_count])
def test_what_it_cannot_say_it_refuses_in_words(
    exporter: Chosen, finished: Path, tmp_path: Path, take_away: object
) -> None:
    assert callable(take_away)
    sequence = Path(shutil.copytree(finished, tmp_path / NAME))
    take_away(sequence)
    made = _or_refused(exporter, sequence, tmp_path / "target")
    assert all(made.values())


def _or_refused(chosen: Chosen, sequence: Path, target: Path) -> dict[str, bytes]:
    """What was written; of a refusal its message names the sequence, and what was begun is no matter."""
    try:
        return _write(chosen, sequence, target)
    except SequenceFormatError as error:
        assert str(error) and "\n" not in str(error)
        return _files(target)


def test_a_sequence_without_a_track_in_sight_is_said_or_refused(
    exporter: Chosen, finished: Path, tmp_path: Path
) -> None:
    sequence = read_sequence(finished)
    for view in sequence.views:
        view.visible.flags.writeable = True
        view.visible[...] = False
    assert not any(np.any(view.visible) for view in sequence.views)
    try:
        EXPORTERS[exporter[0]]().write(ExportSource(NAME, sequence), tmp_path)
    except SequenceFormatError as error:
        assert str(error)
