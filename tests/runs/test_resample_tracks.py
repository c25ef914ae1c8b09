"""Other tracks of a finished sequence, from the work area."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from perpetua.audit.config import AuditConfig
from perpetua.audit.verify import verify_sequence
from perpetua.cli.app import main
from perpetua.errors import InputError, SequenceFormatError
from perpetua.geometry.pinhole import project
from perpetua.geometry.transforms import invert_rigid, transform_points
from perpetua.pipeline.work_area import load_scene
from perpetua.runs.resample_tracks import PixelChoice, write_other_tracks
from perpetua.testing.synthetic_scene import make_scene
from tests.support.small_run import write_run

SEED, ROOM = 5, 2


@pytest.fixture(scope="module")
def sequence(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sequence's folder, in a run whose work area is kept."""
    return write_run(tmp_path_factory.mktemp("run"), SEED, ROOM)


def test_any_number_is_written_as_a_whole_sequence_that_passes(sequence: Path, tmp_path: Path) -> None:
    made = write_other_tracks(sequence, tmp_path / "more", 300, 3, None)
    assert made.points.position_m.shape == (6, 300, 3)
    report = verify_sequence(tmp_path / "more", AuditConfig(), load_scene(sequence).scene, 2)
    assert report.passed, [str(check) for check in report.checks if not check.passed]
    assert not report.skipped
    again = write_other_tracks(sequence, tmp_path / "again", 300, 3, None)
    other = write_other_tracks(sequence, tmp_path / "other", 300, 4, None)
    assert again.points.position_m.tobytes() == made.points.position_m.tobytes()
    assert other.points.position_m.tobytes() != made.points.position_m.tobytes()


def test_pixels_are_followed_from_their_centres(sequence: Path, tmp_path: Path) -> None:
    view, frame, step = 1, 3, 4
    made = write_other_tracks(sequence, tmp_path / "pixels", 1, 0, PixelChoice(view, frame, step), ("flow",))
    assert np.load(tmp_path / "pixels/1/flow.npy").shape == (5, 72, 96, 2)
    camera = make_scene().cameras[view]
    in_camera_m = transform_points(invert_rigid(camera.world_from_camera)[frame], made.points.position_m[frame])
    pixel_px = project(camera.intrinsics, in_camera_m)
    np.testing.assert_allclose(pixel_px, step * np.round(pixel_px / step), atol=2e-3)
    assert len(pixel_px) > 0.95 * (96 / step) * (72 / step)
    assert made.views.visible[view, frame].mean() > 0.98, "they are seen where they come from"
    report = verify_sequence(tmp_path / "pixels", AuditConfig(), load_scene(sequence).scene, 2)
    assert report.passed, [str(check) for check in report.checks if not check.passed]


def test_bad_requests_are_refused_with_a_remedy(sequence: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"exists: choose another --out"):
        write_other_tracks(sequence, tmp_path, 5, 0, None)
    with pytest.raises(InputError, match=r"work area of .* is gone"):
        write_other_tracks(shutil.copytree(sequence, tmp_path / "elsewhere"), tmp_path / "new", 5, 0, None)
    with pytest.raises(SequenceFormatError, match=r"is not the folder of a sequence"):
        write_other_tracks(sequence.parent, tmp_path / "new", 5, 0, None)
    with pytest.raises(InputError, match=r"view in 0\.\.2 and a frame in 0\.\.5"):
        write_other_tracks(sequence, tmp_path / "new", 5, 0, PixelChoice(3, 0, 1))
    for text in ("1:2", "a:b:c", "0:1:-2"):
        with pytest.raises(InputError, match="VIEW:FRAME:STEP"):
            PixelChoice.parse(text)
    assert not (tmp_path / "new").exists()
    asked = CliRunner().invoke(main, ["tracks", str(sequence), "--from-pixels", "x", "--out", str(tmp_path / "new")])
    assert asked.exit_code == 2 and "VIEW:FRAME:STEP" in asked.output
