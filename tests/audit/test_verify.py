"""Good data passes the audit, and each planted fault is caught by the check that is meant for it."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from perpetua.audit.config import AuditConfig
from perpetua.audit.verify import find_sequences, verify_sequence
from perpetua.errors import SequenceFormatError
from perpetua.formats.config import OUTPUTS
from perpetua.testing.synthetic_sequence import write_scene
from tests.support.planted_faults import FAULTS, images, other_way, ray_length, record_hashes, swap

BOUNDS = AuditConfig()


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With all labels that there are."""
    folder = tmp_path_factory.mktemp("good") / "sequence"
    write_scene(folder, OUTPUTS)
    return folder


def copy_of(good: Path, folder: Path) -> Path:
    for path in sorted(good.rglob("*")):
        if path.is_file():
            target = folder / path.relative_to(good)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    return folder


@pytest.fixture
def sequence(good: Path, tmp_path: Path) -> Path:
    """A copy to damage."""
    return copy_of(good, tmp_path / "sequence")


def failed_checks(folder: Path) -> dict[str, str]:
    report = verify_sequence(folder, BOUNDS)
    return {check.name: check.detail for check in report.checks if not check.passed}


CHECKS = {
    "layout", "values", "images", "cameras", "sha256", "query pixels", "query draw", "track pixels", "object poses",
    "moving tracks", "static tracks", "on surface", "visible on image", "depth agreement", "foreground agreement",
    "hidden for a reason", "images of their frames", "views agree", "object index", "object index of tracks", "normals",
    "normals of tracks", "flow", "flow against depth", "flow of tracks", "view flow", "view flow against depth",
    "view flow of tracks", "scene flow", "scene flow of tracks",
}  # fmt: skip


def test_good_data_passes(good: Path) -> None:
    report = verify_sequence(good, BOUNDS)
    assert report.passed and not report.skipped, [str(check) for check in report.checks if not check.passed]
    assert {check.name for check in report.checks} == CHECKS
    assert json.loads(json.dumps(report.to_json(), allow_nan=False))["passed"] is True
    assert report.table().row_count == len(CHECKS)


def test_unsound_but_good_looking_files_would_be_noticed(good: Path) -> None:
    """The margin with which good data passes: far from the bounds on both sides."""
    values = {check.name: check.value for check in verify_sequence(good, BOUNDS).checks}
    assert values["depth agreement"] == 1.0
    assert values["query pixels"] < 1e-4
    assert values["moving tracks"] == pytest.approx(0.3)


@pytest.mark.parametrize("name", FAULTS)
def test_planted_fault_is_caught(sequence: Path, name: str) -> None:
    plant, check, words = FAULTS[name]
    plant(sequence)
    record_hashes(sequence)
    failures = failed_checks(sequence)
    assert check in failures, failures
    assert re.search(words, failures[check]), failures[check]


def test_hashes_catch_what_no_other_check_sees(sequence: Path) -> None:
    """A comment in a JPEG file changes no pixel."""

    def comment(jpegs: np.ndarray) -> None:
        jpegs[2] = np.concatenate([jpegs[2][:2], np.frombuffer(b"\xff\xfe\x00\x04ab", np.uint8), jpegs[2][2:]])

    images(comment)(sequence)
    assert failed_checks(sequence) == {"sha256": "1/images_jpeg_bytes.npy does not have the recorded sha256"}


def test_a_record_that_names_files_elsewhere_is_refused(sequence: Path) -> None:
    record = json.loads((sequence / "sequence.json").read_text())
    record["files"]["../../etc/passwd"] = "0" * 64
    (sequence / "sequence.json").write_text(json.dumps(record))
    assert "leads out of the folder" in failed_checks(sequence)["sha256"]


LABELS = ("object_index", "normals", "flow", "flow_state", "scene_flow", "flow_to_0", "flow_to_1", "flow_to_2",
          "flow_to_0_state", "flow_to_1_state", "flow_to_2_state", "tracks_xy")  # fmt: skip


def strip(sequence: Path) -> None:
    """Leaves what others have too."""
    for name in ("sequence.json", "surface_xyz.npy", "object_poses.npy", "object_boxes.npy"):
        (sequence / name).unlink()
    for view in range(3):
        for name in LABELS:
            (sequence / f"{view}/{name}.npy").unlink(missing_ok=True)


def test_data_from_elsewhere_is_verified_as_far_as_it_goes(sequence: Path) -> None:
    strip(sequence)
    report = verify_sequence(sequence, BOUNDS)
    assert report.passed, [str(check) for check in report.checks if not check.passed]
    assert {"depth agreement of points", "views agree", "images of their frames"} <= {c.name for c in report.checks}
    assert len(report.skipped) == 3
    ray_length(sequence)
    assert {"depth agreement of points", "views agree"} <= set(failed_checks(sequence))


def test_data_without_depth_and_masks_has_its_tracks_verified(sequence: Path) -> None:
    strip(sequence)
    for view in range(3):
        (sequence / f"{view}/depth.npy").unlink()
        (sequence / f"{view}/foreground_mask.npy").unlink()
    report = verify_sequence(sequence, BOUNDS)
    assert report.passed and any(line.startswith("depth agreement, views agree, labels") for line in report.skipped)
    swap("0/extrinsics_w2c.npy", "1/extrinsics_w2c.npy")(sequence)
    assert {"query pixels", "images of their frames"} <= set(failed_checks(sequence))


def test_labels_are_verified_without_a_record(sequence: Path) -> None:
    """Labels of others count too, with no table of objects and no triangles under tracks."""
    for name in ("sequence.json", "surface_xyz.npy"):
        (sequence / name).unlink()
    report = verify_sequence(sequence, BOUNDS)
    assert report.passed, [str(check) for check in report.checks if not check.passed]
    assert {"object index", "normals", "flow", "view flow", "scene flow"} <= {check.name for check in report.checks}
    other_way("0/flow.npy")(sequence)
    assert "flow" in failed_checks(sequence)


def test_sequences_are_found_below_a_folder(good: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "train" / "room_0", tmp_path / "train" / "room_1"
    copy_of(good, first)
    copy_of(good, second)
    copy_of(good, tmp_path / ".work" / "hidden")
    assert find_sequences(tmp_path) == [first, second]
    assert find_sequences(first) == [first]
    with pytest.raises(SequenceFormatError, match="holds no sequence"):
        find_sequences(first / "0")
