"""perpetua evaluate as a user meets it."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from perpetua.cli.app import main
from perpetua.evaluation.protocol import OTHER_VIEWS, QUERY_VIEW, WORLD_MEDIAN
from perpetua.testing.synthetic_sequence import write_scene


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("evaluate") / "train" / "room"
    write_scene(folder)
    return folder


@pytest.fixture(scope="module")
def truth_npz(folder: Path) -> Path:
    """The truth, written by hand from the files."""
    tracks_m = np.load(folder / "tracks_xyz.npy")
    poses = [np.load(folder / view / "extrinsics_w2c.npy") for view in "012"]
    homogeneous = np.concatenate([tracks_m, np.ones((*tracks_m.shape[:2], 1))], axis=2)
    path = folder.parents[1] / "truth.npz"
    np.savez(
        path,
        tracks_xyz_camera=np.stack([np.einsum("fij,fpj->fpi", pose, homogeneous)[..., :3] for pose in poses]),
        tracks_xyz_world=np.einsum("ij,fpj->fpi", poses[0][0], homogeneous)[..., :3],
        visibility=np.stack([np.load(folder / view / "visibility.npy") for view in "012"]),
    )
    return path


def _evaluate(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, ["evaluate", *map(str, arguments)])


def _report(*arguments: str | Path) -> dict[str, Any]:
    done = _evaluate(*arguments, "--json")
    assert done.exit_code == 0, done.output
    return dict(json.loads(done.output))


def test_the_truth_in_a_file_scores_one(folder: Path, truth_npz: Path) -> None:
    report = _report(truth_npz, folder)
    assert set(report["mean"]) == {QUERY_VIEW, OTHER_VIEWS, WORLD_MEDIAN}
    for scores in report["mean"].values():
        assert scores["average_jaccard"] == scores["average_position_accuracy"] == scores["occlusion_accuracy"] == 1.0
    table = _evaluate(truth_npz, folder)
    assert table.exit_code == 0
    assert table.output.count("1.0000") == 9 and "world, median scale" in table.output


def test_a_saved_baseline_scores_as_the_baseline(folder: Path, tmp_path: Path) -> None:
    saved = tmp_path / "still.npz"
    at_once = _report("--baseline", "still", "--save", saved, folder)
    assert _report(saved, folder) == at_once
    assert 0.0 < at_once["mean"][QUERY_VIEW]["average_jaccard"] < 1.0


def test_a_sequence_without_prediction_counts_as_a_failure(folder: Path, truth_npz: Path, tmp_path: Path) -> None:
    for name in ("room", "other"):
        shutil.copytree(folder, tmp_path / "data" / "train" / name)
    (tmp_path / "predictions").mkdir()
    shutil.copy(truth_npz, tmp_path / "predictions" / "room.npz")
    report = _report(tmp_path / "predictions", tmp_path / "data")
    assert report["sequences"]["other"] is None
    for scores in report["mean"].values():
        assert (scores["average_jaccard"], scores["occlusion_accuracy"]) == (0.5, 0.5)
    done = _evaluate(truth_npz, tmp_path / "data")
    assert done.exit_code == 2 and "2 sequences" in done.output
    done = _evaluate(tmp_path / "data", folder)
    assert done.exit_code == 2 and "'room.npz'" in done.output


def test_input_errors_are_told_in_words(folder: Path, truth_npz: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.npz"
    broken.write_bytes(b"no archive")
    cases: list[tuple[list[str | Path], str]] = [
        ([broken, folder], "cannot read predictions"),
        ([tmp_path / "none.npz", folder], "cannot read predictions"),
        ([truth_npz, tmp_path], "holds no sequence"),
        ([truth_npz], "needs PRED and DIR"),
        ([truth_npz, folder, "--baseline", "still"], "needs PRED and DIR"),
        ([truth_npz, folder, "--save", tmp_path / "x.npz"], "--save"),
        ([folder, "--baseline", "raft"], "'raft' is not one of"),
    ]
    for arguments, message in cases:
        done = _evaluate(*arguments)
        assert done.exit_code == 2 and message in done.output, (arguments, done.output)
        assert "Traceback" not in done.output
