"""``perpetua preview``: the set of pictures, each showing what the sequence holds."""

import shutil
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from perpetua.cli.app import main
from perpetua.errors import SequenceFormatError
from perpetua.formats.reader import Sequence, read_sequence
from perpetua.formats.source import ExportSource
from perpetua.report.pictures import video
from perpetua.report.pictures.depth_sheet import write_depth_sheet
from perpetua.report.pictures.object_sheet import write_object_sheet
from perpetua.report.pictures.sheets import CELL_WIDTH_PX, GAP_PX, HEADING_PX, MARGIN_PX
from perpetua.report.pictures.track_marks import choose_tracks, draw_tracks
from perpetua.runs.export import load_source
from perpetua.scene.scene import Scene
from perpetua.testing.synthetic_sequence import write_scene

# The synthetic scene: 6 frames of 2 or more views of 96 x 72 px.
CELL_HEIGHT_PX = CELL_WIDTH_PX * 72 // 96


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Scene]:
    folder = tmp_path_factory.mktemp("preview") / "sequence"
    scene, _ = write_scene(folder)
    return folder, scene


@pytest.fixture
def sequence(made: tuple[Path, Scene]) -> Sequence:
    return read_sequence(made[0])


def sheet_cell(picture: Path, row: int, column: int) -> np.ndarray:
    top, left = HEADING_PX + row * (CELL_HEIGHT_PX + GAP_PX), MARGIN_PX + column * (CELL_WIDTH_PX + GAP_PX)
    return np.asarray(Image.open(picture).convert("RGB"))[top : top + CELL_HEIGHT_PX, left : left + CELL_WIDTH_PX]


def test_video_shows_all_views_in_step_at_the_sequences_rate(sequence: Sequence, tmp_path: Path) -> None:
    video.write_video(sequence, 12.0, tmp_path / "video.mp4")
    with av.open(str(tmp_path / "video.mp4")) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        assert float(stream.average_rate or 0) == 12.0
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(frames) == len(sequence.tracks_m)
    shown = choose_tracks(sequence)
    height_px = video.CELL_WIDTH_PX * 72 // 96
    for number in (0, 3, 5):
        for index, view in enumerate(sequence.views):
            top, left = (index // 2) * (height_px + video.GAP_PX), (index % 2) * (video.CELL_WIDTH_PX + video.GAP_PX)
            # Below the view's name.
            got = frames[number][top + 30 : top + height_px, left : left + video.CELL_WIDTH_PX].astype(float)
            errors = [
                np.abs(got - np.asarray(draw_tracks(sequence, view, frame, shown, video.CELL_WIDTH_PX))[30:]).mean()
                for frame in range(len(frames))
            ]
            assert int(np.argmin(errors)) == number
            assert errors[number] < 4.0


def test_animation_repeats_the_video_in_time(made: tuple[Path, Scene], tmp_path: Path) -> None:
    code, said = run(str(made[0]), "--out", str(tmp_path / "set"), "--only", "animation")
    assert code == 0, said
    source = load_source(made[0])
    with Image.open(tmp_path / "set" / "animation.webp") as picture:
        assert getattr(picture, "n_frames", 1) == len(source.sequence.tracks_m)
        assert picture.width == video.ANIMATION_WIDTH_PX and picture.info["loop"] == 0
        wanted = [Image.fromarray(large).resize(picture.size) for large in video._frames(source.sequence)]
        for number in range(len(wanted)):
            picture.seek(number)
            picture.load()
            got = np.asarray(picture.convert("RGB"), float)
            errors = [np.abs(got - np.asarray(frame, float)).mean() for frame in wanted]
            assert int(np.argmin(errors)) == number and errors[number] < 6.0
            assert picture.info["timestamp"] == pytest.approx(number * 1000.0 / source.fps, abs=number)


@pytest.mark.parametrize("views", [1, 2, 3])
def test_video_of_any_number_of_views_has_even_sides(sequence: Sequence, tmp_path: Path, views: int) -> None:
    video.write_video(replace(sequence, views=sequence.views[:views]), 24.0, tmp_path / "video.mp4")
    with av.open(str(tmp_path / "video.mp4")) as container:
        stream = container.streams.video[0]
        assert stream.width % 2 == stream.height % 2 == 0
        assert stream.frames == len(sequence.tracks_m)


def test_a_hidden_point_is_a_ring_and_a_visible_one_is_filled(sequence: Sequence) -> None:
    """One track in the middle of a black image, called visible or hidden."""
    view = sequence.views[0]
    black = replace(view, jpeg=tuple(_black_jpeg(96, 72) for _ in view.jpeg))
    inner = view.intrinsics_px.astype(float)
    world_from_camera = np.linalg.inv(view.camera_from_world[0].astype(float))
    middle = np.array([(48 - inner[2]) / inner[0] * 2.0, (36 - inner[3]) / inner[1] * 2.0, 2.0, 1.0])
    tracks_m = np.tile((world_from_camera @ middle)[:3].astype(np.float32), (len(sequence.tracks_m), 1, 1))
    for visible, is_filled in ((True, True), (False, False)):
        marked = replace(black, visible=np.full((len(tracks_m), 1), visible))
        one = replace(sequence, tracks_m=tracks_m, queries_xytv=sequence.queries_xytv[:1], views=(marked,))
        level = np.asarray(draw_tracks(one, marked, 0, choose_tracks(one), 960)).astype(int).max(axis=2)
        x, y = 485, 365
        assert (level[y, x] > 120) == is_filled
        assert level[y - 4 : y + 5, x - 4 : x + 5].max() > 80
        level[y - 6 : y + 7, x - 6 : x + 7] = 0
        assert level.max() < 20


def _black_jpeg(width_px: int, height_px: int) -> np.ndarray:
    import cv2

    encoded: np.ndarray = cv2.imencode(".jpg", np.zeros((height_px, width_px, 3), np.uint8))[1]
    return encoded.ravel()


def test_depth_sheet_has_one_scale_for_all_views(sequence: Sequence, tmp_path: Path) -> None:
    write_depth_sheet(sequence, tmp_path / "depth.png", times=2)
    depths_m, levels = [], []
    for row, view in enumerate(sequence.views):
        assert view.depth_m is not None
        cell = sheet_cell(tmp_path / "depth.png", row, 1)
        rows, columns = (np.arange(72) + 0.5) * CELL_HEIGHT_PX / 72, (np.arange(96) + 0.5) * CELL_WIDTH_PX / 96
        levels.append(cell[rows.astype(int)][:, columns.astype(int)].astype(int).sum(axis=2).ravel())
        depths_m.append(view.depth_m[5].ravel())
    depth_m, level = np.concatenate(depths_m), np.concatenate(levels)
    order = np.argsort(depth_m[depth_m > 0])
    # Brightness falls with depth, over the views together.
    assert (np.diff(level[depth_m > 0][order]) <= 6).all()
    assert (level[depth_m == 0] == 0).all()


def test_depth_sheet_says_which_view_has_no_depth(sequence: Sequence, tmp_path: Path) -> None:
    bare = replace(sequence, views=(sequence.views[0], replace(sequence.views[1], depth_m=None)))
    with pytest.raises(SequenceFormatError, match=r"view 1 has no depth\.npy"):
        write_depth_sheet(bare, tmp_path / "depth.png")


def test_object_sheet_tells_objects_apart(made: tuple[Path, Scene], sequence: Sequence, tmp_path: Path) -> None:
    rendered = tuple(view.object_index for view in made[1].views)
    source = ExportSource("sequence", sequence, rendered)
    write_object_sheet(source, tmp_path / "objects.png", times=2)
    for row, object_index in enumerate(rendered):
        cell = sheet_cell(tmp_path / "objects.png", row, 0)
        shown = {tuple(colour) for colour in cell.reshape(-1, 3).tolist()}
        for index in np.unique(object_index[0]).tolist():
            assert (source.object_colour(index) if index else (0, 0, 0)) in shown


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["preview", *arguments])
    return result.exit_code, result.output


def test_the_usual_set_lacks_only_what_the_sequence_lacks(made: tuple[Path, Scene], tmp_path: Path) -> None:
    code, said = run(str(made[0]), "--out", str(tmp_path / "set"), "--times", "2")
    assert code == 0, said
    assert {path.name for path in (tmp_path / "set").iterdir()} == {"sheet.jpg", "video.mp4", "plan.png", "depth.jpg"}
    assert "no objects.png: the object index is neither in the sequence" in said


def test_object_index_of_the_sequences_own_files_is_drawn(made: tuple[Path, Scene], tmp_path: Path) -> None:
    copy = tmp_path / "sequence"
    shutil.copytree(made[0], copy)
    for number, view in enumerate(made[1].views):
        np.save(copy / str(number) / "object_index.npy", view.object_index)
    code, said = run(str(copy), "--out", str(tmp_path / "set"), "--only", "objects")
    assert code == 0, said
    assert [path.name for path in (tmp_path / "set").iterdir()] == ["objects.png"]


def test_only_draws_what_it_names(made: tuple[Path, Scene], tmp_path: Path) -> None:
    code, said = run(str(made[0]), "--out", str(tmp_path / "some"), "--only", "plan", "--only", "depth")
    assert code == 0, said
    assert {path.name for path in (tmp_path / "some").iterdir()} == {"plan.png", "depth.jpg"}


@pytest.mark.parametrize(
    ("arguments", "rule"),
    [
        ([], "needs one of"),
        (["SEQUENCE", "--rooms", "2"], "needs one of"),
        (["SEQUENCE", "--out", "sheet.jpg"], "--only sheet"),
        (["SEQUENCE", "--only", "objects"], "perpetua clean"),
        (["/nowhere"], "the folder of a sequence is required"),
    ],
)
def test_bad_input_says_the_rule(
    made: tuple[Path, Scene], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], rule: str
) -> None:
    monkeypatch.chdir(tmp_path)
    code, said = run(*[str(made[0]) if argument == "SEQUENCE" else argument for argument in arguments])
    assert code == 2
    assert rule in said
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_a_sequence_from_elsewhere_is_previewed(made: tuple[Path, Scene], tmp_path: Path) -> None:
    copy = tmp_path / "foreign"
    shutil.copytree(made[0], copy)
    for name in ("sequence.json", "surface_xyz.npy", "0/depth.npy", "1/foreground_mask.npy"):
        (copy / name).unlink()
    code, said = run(str(copy), "--out", str(tmp_path / "set"), "--times", "1")
    assert code == 0, said
    assert "no depth.jpg: there is no depth.npy in view 0" in said
    assert (tmp_path / "set" / "video.mp4").stat().st_size > 1000
