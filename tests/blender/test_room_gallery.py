"""The page of rooms with real Blender: one room, drawn once, skipped the second time."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from PIL import Image

from perpetua.cli.app import main
from perpetua.runs.preview_rooms import PAPER

pytestmark = [pytest.mark.blender, pytest.mark.slow]


def _preview(out: Path, *more: str) -> Result:
    arguments = ["preview", "--rooms", "1", "--seed", "7", "--preset", "tiny", "--device", "cpu", "--out", str(out)]
    return CliRunner().invoke(main, [*arguments, *more])


def test_a_room_is_drawn_once_lit_and_cut_open(tmp_path: Path) -> None:
    done = _preview(tmp_path)
    assert done.exit_code == 0, done.output
    assert "room 0: drawing" in done.output
    above, *corners = (
        np.array(Image.open(tmp_path / "pictures" / f"seed7-room0000_{name}.jpg")).astype(np.int64)
        for name in ("above", "corner_1", "corner_2")
    )
    for picture in corners:
        assert 60 < picture.mean() < 200
    # Around the room is paper; within it the lit floor, which a ceiling would hide in one even tone.
    assert np.abs(above[:6, :20] - PAPER).max() <= 12
    middle = above[72:216, 96:288]
    assert 40 < middle.mean() < 220
    assert middle.std() > 8
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert page.count("data:image/jpeg;base64,") == 3
    assert "free floor" in page and "lamps" in page

    times = {path: path.stat().st_mtime_ns for path in (tmp_path / "pictures").iterdir()}
    again = _preview(tmp_path)
    assert again.exit_code == 0, again.output
    assert "drawing" not in again.output
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "pictures").iterdir()} == times
    assert not list(tmp_path.glob(".work/*/gallery"))


def test_other_settings_do_not_mix_and_failures_are_told(tmp_path: Path) -> None:
    settings = ("--set", "rooms.min_free_floor_m2=150", "--set", "rooms.max_redraws=0")
    done = _preview(tmp_path, *settings)
    assert done.exit_code == 1, done.output
    assert "rooms.min_free_floor_m2" in done.output
    assert 'class="failure"' in (tmp_path / "index.html").read_text(encoding="utf-8")
    refused = _preview(tmp_path)
    assert refused.exit_code == 2
    assert "choose another --out" in refused.output
