"""``perpetua preview --rooms`` on a folder whose rooms are published."""

import json
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner
from PIL import Image

from perpetua.cli.app import main
from perpetua.config import load_config
from perpetua.pipeline.layout import RunLayout
from perpetua.pipeline.runner import stage_keys
from perpetua.runs import preview_rooms


def _draw(room: object, stem: Path, *more: object) -> None:
    for name in preview_rooms.VIEW_NAMES:
        Image.new("RGB", (8, 8)).save(stem.with_name(f"{stem.name}_{name}.jpg"))


@pytest.mark.parametrize("freed", [False, True], ids=["work area kept", "work area freed"])
def test_published_rooms_are_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, freed: bool) -> None:
    monkeypatch.setattr(preview_rooms, "draw_room", _draw)
    command = ["preview", "--rooms", "1", "--seed", "7", "--preset", "tiny", "--out", str(tmp_path)]
    assert CliRunner().invoke(main, command).exit_code == 0
    config = load_config("tiny")
    layout = RunLayout(tmp_path, config.export, 7).room(0)
    layout.sequence_folder.mkdir(parents=True)
    audit = {"key": stage_keys(config, 7, 0)["audit"], "rejected_draws": 0}
    (layout.sequence_folder / "audit.json").write_text(json.dumps(audit))
    shutil.rmtree(tmp_path / "pictures")
    if freed:
        shutil.rmtree(layout.run.work_area)
    done = CliRunner().invoke(main, command)
    assert done.exit_code == 0, done.output
    assert "room 0: drawing" in done.output
    assert "free floor" in (tmp_path / "index.html").read_text(encoding="utf-8")
