"""The sheet of actors: every figure is there, seen from the sides that are asked for."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from perpetua.config import load_config
from perpetua.runs import preview_actors as actor_sheets


@pytest.mark.blender
def test_a_row_shows_nine_figures_wide_from_front_and_narrow_from_the_side(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scale = 0.25
    monkeypatch.setattr(actor_sheets, "HEIGHT_PX", round(400 * scale))
    monkeypatch.setattr(actor_sheets, "SCALE_PX_PER_M", 196.0 * scale)
    monkeypatch.setattr(actor_sheets, "_NEAR_WIDTH_PX", round(340 * scale))
    picture = tmp_path / "actors.png"
    actor_sheets.write_actor_sheet(1, 7, load_config("tiny"), "cpu", picture)
    sheet = np.asarray(Image.open(picture).convert("RGB")).astype(float)
    caption = sheet.shape[0] - round(400 * scale)
    cells = np.split(sheet[caption:, -9 * round(0.92 * 196 * scale) :], 9, axis=1)
    # Arms and trunk, at the height of the chest, against the wall behind them.
    chest = slice(round(0.30 * cells[0].shape[0]), round(0.42 * cells[0].shape[0]))
    widths = []
    for cell in cells:
        wall = np.median(cell[chest, [0, 1, -2, -1]], axis=(0, 1))
        differs = np.abs(cell[chest] - wall).max(axis=2) > 40
        widths.append(float(differs.mean()))
    assert min(widths) > 0.1, "a figure is missing"
    front, left, back, right = widths[:4]
    assert min(front, back) > 1.2 * max(left, right)
