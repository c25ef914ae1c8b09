"""The pictures show what the sequence holds, where it is."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from perpetua.formats.reader import read_sequence
from perpetua.report.pictures.contact_sheet import write_contact_sheet
from perpetua.report.pictures.drawing import Canvas, depth_colours
from perpetua.report.pictures.plan_view import CURVES, write_plan_view
from perpetua.report.pictures.sheets import CELL_WIDTH_PX, GAP_PX, HEADING_PX, MARGIN_PX
from perpetua.testing.synthetic_sequence import write_scene


@pytest.fixture(scope="module")
def sequence(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pictures") / "sequence"
    write_scene(folder)
    return folder


def cell(sheet: np.ndarray, row: int, column: int) -> np.ndarray:
    height = CELL_WIDTH_PX * 72 // 96
    top, left = HEADING_PX + row * (height + GAP_PX), MARGIN_PX + column * (CELL_WIDTH_PX + GAP_PX)
    return sheet[top : top + height, left : left + CELL_WIDTH_PX]


def test_each_view_has_a_row_of_frames_and_a_row_of_depth(sequence: Path, tmp_path: Path) -> None:
    write_contact_sheet(read_sequence(sequence), tmp_path / "sheet.png", times=3)
    sheet = np.asarray(Image.open(tmp_path / "sheet.png").convert("RGB"))
    height = CELL_WIDTH_PX * 72 // 96
    assert sheet.shape == (HEADING_PX + 6 * (height + GAP_PX), MARGIN_PX + 3 * (CELL_WIDTH_PX + GAP_PX), 3)
    for row in range(6):
        for column in range(3):
            assert len(np.unique(cell(sheet, row, column).reshape(-1, 3), axis=0)) > 50


def test_frames_are_the_sequences_frames_with_marks_on_them(sequence: Path, tmp_path: Path) -> None:
    write_contact_sheet(read_sequence(sequence), tmp_path / "sheet.png", times=2)
    sheet = np.asarray(Image.open(tmp_path / "sheet.png").convert("RGB"))
    view = read_sequence(sequence).views[1]
    for column, frame in enumerate((0, 5)):
        plain = np.asarray(Image.fromarray(view.image(frame)).resize((320, 240), Image.Resampling.BICUBIC)).astype(int)
        differs = np.abs(cell(sheet, 2, column).astype(int) - plain).max(axis=2) > 20
        assert 0.002 < differs.mean() < 0.3


def test_more_times_than_frames_shows_each_frame_once(sequence: Path, tmp_path: Path) -> None:
    write_contact_sheet(read_sequence(sequence), tmp_path / "sheet.png", times=24)
    with Image.open(tmp_path / "sheet.png") as sheet:
        assert sheet.width == MARGIN_PX + 6 * (CELL_WIDTH_PX + GAP_PX)


def test_dots_lie_on_their_pixels() -> None:
    canvas = Canvas(np.zeros((9, 9, 3), np.uint8))
    canvas.dot(np.array([3.0, 5.0]), (255, 255, 255), 1.2)
    level = np.asarray(canvas.picture()).astype(float).sum(axis=2)
    rows, columns = np.mgrid[:9, :9]
    assert (level * columns).sum() / level.sum() == pytest.approx(3.0, abs=0.15)
    assert (level * rows).sum() / level.sum() == pytest.approx(5.0, abs=0.15)


def test_near_is_brighter_than_far_and_nothing_is_black() -> None:
    level = depth_colours(np.array([[1.0, 2.0, 4.0, 0.0]]), 1.0, 4.0).astype(int).sum(axis=2)[0]
    assert level[0] > level[1] > level[2] > level[3] == 0


def test_plan_shows_cameras_and_tracks_where_nothing_else_is_recorded(sequence: Path, tmp_path: Path) -> None:
    write_plan_view(read_sequence(sequence), tmp_path / "plan.png")
    assert _pixels_near(tmp_path / "plan.png", "black") > 300
    assert _pixels_near(tmp_path / "plan.png", "tab:red") > 100
    assert _pixels_near(tmp_path / "plan.png", "#c9b79c") == 0


def test_plan_shows_furniture_routes_and_curves_that_are_recorded(sequence: Path, tmp_path: Path) -> None:
    copy = tmp_path / "sequence"
    shutil.copytree(sequence, copy)
    record = json.loads((copy / "sequence.json").read_text())
    square_m = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
    record["floor_polygon_m"] = [[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]]
    record["objects"] = [
        {"name": "table", "category": "table", "walkable": False, "height_range_m": [0, 1], "footprint_m": square_m},
        {"name": "actor_0", "category": "person", "route_m": [[-2.0, -2.0, 0.0], [2.0, -2.0, 0.0]]},
    ]
    (copy / "sequence.json").write_text(json.dumps(record))
    curve = [[0.0, 1.0, 2.0]]
    (copy / "audit.json").write_text(json.dumps({"motion": {"curves": {name: curve for _, name, _ in CURVES}}}))
    write_plan_view(read_sequence(copy), tmp_path / "plan.png")
    furniture = _pixels_near(tmp_path / "plan.png", "#c9b79c")
    assert furniture > 3000
    assert _pixels_near(tmp_path / "plan.png", "tab:red") > 1000
    with Image.open(tmp_path / "plan.png") as picture:
        assert picture.width == 1500
    # The hull of a wall around a corner would lie on the floor, as if people walked through it.
    around_m, straight_m = [[-3, -3], [3, -3], [-3, 3]], [[-2, 1], [2, 2], [2, 2.2], [-2, 1.2]]
    for footprint_m, drawn in ((around_m, False), (straight_m, True)):
        wall = record["objects"][0] | {"category": "wall", "footprint_m": footprint_m}
        (copy / "sequence.json").write_text(json.dumps(record | {"objects": [*record["objects"], wall]}))
        write_plan_view(read_sequence(copy), tmp_path / "plan.png")
        assert (_pixels_near(tmp_path / "plan.png", "#c9b79c") > furniture) == drawn


def _pixels_near(picture: Path, colour: str) -> int:
    """How many pixels have a named colour."""
    wanted = 255.0 * np.array(to_rgb(colour))
    pixels = np.asarray(Image.open(picture).convert("RGB")).astype(float)
    return int((np.abs(pixels - wanted).max(axis=2) < 6.0).sum())
