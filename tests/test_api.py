"""Perpetua from Python: the same work and the same errors as the command line, and a light import."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import perpetua
from perpetua.cli.app import main
from perpetua.errors import GenerationError, InputError, PerpetuaError, SequenceFormatError
from perpetua.formats.reader import read_sequence
from perpetua.pipeline.layout import read_run
from perpetua.runs import generate as generation
from perpetua.testing.synthetic_sequence import write_scene


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Takes the place of the work: notes what was asked for, and lets the rooms in ``fails`` fail."""
    noted: dict[str, Any] = {"fails": {}}

    def note(rooms: range, workers: int, work: object, on_event: object) -> dict[int, str]:
        noted.update(rooms=list(rooms), workers=workers)
        return dict(noted["fails"])

    monkeypatch.setattr(generation, "run_rooms", note)
    return noted


def test_importing_brings_nothing_heavy() -> None:
    code = (
        "import sys, perpetua; print(sorted({'torch', 'bpy', 'anny', 'cv2', 'scipy', 'pydantic', 'rich'} & "
        "set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_open_gives_typed_arrays(tmp_path: Path) -> None:
    scene, tracks = write_scene(tmp_path / "train" / "made")
    sequence = perpetua.open(str(tmp_path / "train" / "made"))
    assert perpetua.sequences(tmp_path) == [sequence.folder]
    assert sequence.tracks_m.dtype == np.float32
    assert np.allclose(sequence.tracks_m, tracks.points.position_m, atol=1e-6)
    assert len(sequence.views) == len(scene.views)
    for view, rendered in zip(sequence.views, scene.views, strict=True):
        assert view.depth_m is not None and np.array_equal(view.depth_m, rendered.depth_m)
        assert view.image(0).shape == (*view.depth_m.shape[1:], 3)


def test_what_a_notebook_shows_of_a_sequence_is_a_line(tmp_path: Path) -> None:
    write_scene(tmp_path / "made")
    sequence = perpetua.open(tmp_path / "made")
    frames, tracks, _ = sequence.tracks_m.shape
    assert (
        repr(sequence)
        == f"Sequence('{tmp_path / 'made'}': {frames} frames, {len(sequence.views)} views, {tracks:,} tracks)"
    )
    assert repr(sequence.views[0]) == f"SequenceView({frames} frames, depth_m, foreground)"


def test_generate_returns_the_folders_in_order(asked: dict[str, Any], tmp_path: Path) -> None:
    settings = {"actors.count": 2, "sequence.frames": 4}
    made = perpetua.generate(tmp_path, seed=5, rooms=range(3, 5), preset="tiny", settings=settings, quiet=True)
    assert made == [tmp_path / "train" / "seed5-room0003", tmp_path / "train" / "seed5-room0004"]
    assert asked["rooms"] == [3, 4]
    config = read_run(tmp_path).config
    assert (config.actors.count, config.sequence.frames, config.render.width_px) == (2, 4, 64)


def test_failed_rooms_raise_with_the_reason_of_each(asked: dict[str, Any], tmp_path: Path) -> None:
    asked["fails"] = {1: "no room"}
    with pytest.raises(GenerationError, match="1 of 3 rooms failed:\nroom 1: no room") as caught:
        perpetua.generate(tmp_path, rooms=3, preset="tiny", quiet=True)
    assert caught.value.failures == {1: "no room"}
    assert caught.value.exit_code == 1
    assert isinstance(caught.value, PerpetuaError)


@pytest.mark.parametrize(
    ("wrong", "options"),
    [
        ({"preset": "tinny"}, ("--preset", "tinny")),
        ({"settings": {"render.sample": 3}}, ("--set", "render.sample=3")),
        ({"settings": {"actors.body": "smpl"}}, ("--set", "actors.body=smpl")),
        ({"config": "no-such.yaml"}, ("--config", "no-such.yaml")),
        ({"out": "/dev/null/out"}, ("--out", "/dev/null/out")),
    ],
)
def test_errors_are_those_of_the_command_line(wrong: dict[str, Any], options: tuple[str, ...]) -> None:
    printed = CliRunner().invoke(main, ["generate", *options])
    with pytest.raises(InputError) as caught:
        perpetua.generate(**wrong)
    assert printed.exit_code == caught.value.exit_code == 2
    assert printed.output == f"perpetua: {caught.value}\n"


@pytest.mark.parametrize("wrong", [{"rooms": 0}, {"rooms": range(0)}, {"seed": -1}, {"workers": 0}])
def test_numbers_out_of_range_are_refused(wrong: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f"{next(iter(wrong))} must be"):
        perpetua.generate(tmp_path / "out", **wrong)
    assert not (tmp_path / "out").exists()


def test_other_settings_need_replace(asked: dict[str, Any], tmp_path: Path) -> None:
    perpetua.generate(tmp_path, preset="tiny", quiet=True)
    with pytest.raises(InputError, match=r"actors\.count 4, now 3"):
        perpetua.generate(tmp_path, preset="tiny", settings={"actors.count": 3}, quiet=True)
    assert perpetua.generate(tmp_path, preset="tiny", settings={"actors.count": 3}, replace=True, quiet=True)


def test_what_is_no_sequence_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SequenceFormatError, match="does not exist"):
        perpetua.open(tmp_path / "nowhere")
    with pytest.raises(SequenceFormatError, match="holds no sequence"):
        perpetua.sequences(tmp_path)
    write_scene(tmp_path / "made")
    (tmp_path / "made" / "0" / "visibility.npy").unlink()
    with pytest.raises(SequenceFormatError, match=r"visibility\.npy' is missing: the sequence is not whole"):
        read_sequence(tmp_path / "made")
