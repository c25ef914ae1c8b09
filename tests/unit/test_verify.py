"""Good data passes the audit, and each planted fault is caught by the check that is meant for it."""

import hashlib
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic_sequence import write_scene

from perpetua.audit.config import AuditConfig
from perpetua.audit.verify import find_sequences, verify_sequence
from perpetua.errors import SequenceFormatError

BOUNDS = AuditConfig()
Fault = Callable[[Path], None]


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("good") / "sequence"
    write_scene(folder)
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


def record_hashes(folder: Path) -> None:
    """Makes the record agree with the files, so that a fault has to be found in what the files say."""
    record = json.loads((folder / "sequence.json").read_text())
    record["files"] = {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*.npy")
    }
    (folder / "sequence.json").write_text(json.dumps(record))


def failed_checks(folder: Path) -> dict[str, str]:
    report = verify_sequence(folder, BOUNDS)
    return {check.name: check.detail for check in report.checks if not check.passed}


def change(name: str, alter: Callable[[np.ndarray], Any]) -> Fault:
    """Loads an array, alters it (in place, or into what ``alter`` returns), and saves it."""

    def plant(folder: Path) -> None:
        array = np.load(folder / name)
        altered = alter(array)
        np.save(folder / name, array if altered is None else altered)

    return plant


def assign(name: str, index: Any, value: Any) -> Fault:
    def alter(array: np.ndarray) -> None:
        array[index] = value

    return change(name, alter)


def swap(first: str, second: str) -> Fault:
    def plant(folder: Path) -> None:
        (folder / first).rename(folder / "aside")
        (folder / second).rename(folder / first)
        (folder / "aside").rename(folder / second)

    return plant


def ray_length(folder: Path) -> None:
    fx, fy, cx, cy = np.load(folder / "0/intrinsics.npy")
    depth = np.load(folder / "0/depth.npy")
    rows, columns = np.mgrid[: depth.shape[1], : depth.shape[2]]
    np.save(
        folder / "0/depth.npy", (depth * np.hypot(np.hypot((columns - cx) / fx, (rows - cy) / fy), 1.0)).astype("f4")
    )


def redraw_queries(folder: Path) -> None:
    """Sound queries of another seed."""
    tracks = np.load(folder / "tracks_xyz.npy").astype(np.float64)
    visible = np.stack([np.load(folder / f"{view}/visibility.npy") for view in range(3)])
    rng = np.random.default_rng(43)
    queries = np.empty((tracks.shape[1], 4), np.float32)
    for track in range(tracks.shape[1]):
        pairs = np.argwhere(visible[:, :, track])
        view, frame = pairs[rng.integers(len(pairs))]
        fx, fy, cx, cy = np.load(folder / f"{view}/intrinsics.npy").astype(np.float64)
        x, y, z, _ = np.load(folder / f"{view}/extrinsics_w2c.npy")[frame].astype(np.float64) @ [
            *tracks[frame, track],
            1,
        ]
        queries[track] = fx * x / z + cx, fy * y / z + cy, frame, view
    np.save(folder / "queries_xytv.npy", queries)


def truncate(name: str) -> Fault:
    def plant(folder: Path) -> None:
        content = (folder / name).read_bytes()
        (folder / name).write_bytes(content[: len(content) * 2 // 3])

    return plant


def images(alter: Callable[[np.ndarray], Any]) -> Fault:
    def plant(folder: Path) -> None:
        path = folder / "1/images_jpeg_bytes.npy"
        jpegs = np.load(path, allow_pickle=True)
        altered = alter(jpegs)
        np.save(path, jpegs if altered is None else altered, allow_pickle=True)

    return plant


def small_image(jpegs: np.ndarray) -> None:
    import cv2

    picture = cv2.imdecode(jpegs[2], cv2.IMREAD_COLOR)
    jpegs[2] = cv2.imencode(".jpg", cv2.resize(picture, (48, 36)))[1].reshape(-1)


def cut_image(jpegs: np.ndarray) -> None:
    jpegs[3] = jpegs[3][:-20]


def remove(name: str) -> Fault:
    def plant(folder: Path) -> None:
        path = folder / name
        if path.is_dir():
            path.rename(folder.with_name(f"removed_{path.name}"))
        else:
            path.unlink()

    return plant


def shrug_dynamic(folder: Path) -> None:
    """Moving tracks stay where they were first, and say that they are still visible."""
    tracks = np.load(folder / "tracks_xyz.npy")
    tracks[:] = tracks[:1]
    np.save(folder / "tracks_xyz.npy", tracks)


def both(*faults: Fault) -> Fault:
    def plant(folder: Path) -> None:
        for fault in faults:
            fault(folder)

    return plant


# Fault, the check that must catch it, and what its message must name.
FAULTS: dict[str, tuple[Fault, str, str]] = {
    "queries half a pixel off": (
        change("queries_xytv.npy", lambda a: a + np.array([0.5, 0.5, 0, 0], np.float32)),
        "query pixels",
        r"queries_xytv.npy\[0\]",
    ),
    "one query 0.01 px off": (
        change("queries_xytv.npy", lambda a: a + np.eye(1, a.size, 28, dtype="f4").reshape(a.shape) * 0.01),
        "query pixels",
        r"queries_xytv.npy\[7\]",
    ),
    "principal point half a pixel off": (
        change("1/intrinsics.npy", lambda a: a + np.array([0, 0, 0.5, 0.5], "f4")),
        "query pixels",
        "and its track is at",
    ),
    "query where the track is hidden": (redraw_queries, "query draw", "the draw gives"),
    "query of a view that does not exist": (assign("queries_xytv.npy", (3, 3), 9), "query pixels", "view 9"),
    "ray length for Z": (ray_length, "depth agreement", r"0/visibility.npy\[0, "),
    "depth half a pixel off": (
        change("0/depth.npy", lambda a: np.roll(a, 1, axis=2)),
        "depth agreement",
        "visible",
    ),
    "depth in centimetres": (change("2/depth.npy", lambda a: a * np.float32(100)), "values", "2/depth.npy"),
    "depth of two views swapped": (swap("0/depth.npy", "1/depth.npy"), "depth agreement", "depth.npy has"),
    "visibility of two views swapped": (swap("0/visibility.npy", "1/visibility.npy"), "query draw", "draw"),
    "views swapped": (swap("0", "1"), "query pixels", "and its track is at"),
    "cameras swapped": (swap("0/extrinsics_w2c.npy", "1/extrinsics_w2c.npy"), "depth agreement", "0/visibility.npy"),
    "depth one frame late": (change("0/depth.npy", lambda a: np.roll(a, 1, axis=0)), "depth agreement", "visible"),
    "tracks one frame late": (
        change("tracks_xyz.npy", lambda a: np.roll(a, 1, axis=0)),
        "on surface",
        r"tracks_xyz.npy\[\d+, \d+\]",
    ),
    "cameras one frame late": (
        change("2/extrinsics_w2c.npy", lambda a: np.roll(a, 1, axis=0)),
        "query pixels",
        "queries",
    ),
    "masks one frame late": (
        change("0/foreground_mask.npy", lambda a: np.roll(a, 1, axis=0)),
        "foreground agreement",
        "0/visibility.npy",
    ),
    "mask inverted": (change("1/foreground_mask.npy", lambda a: ~a), "foreground agreement", "1/visibility.npy"),
    "extrinsics transposed": (
        change("0/extrinsics_w2c.npy", lambda a: np.ascontiguousarray(a.transpose(0, 2, 1))),
        "cameras",
        r"0/extrinsics_w2c.npy\[",
    ),
    "extrinsics from camera to world": (
        change("0/extrinsics_w2c.npy", lambda a: np.linalg.inv(a).astype("f4")),
        "query pixels",
        "queries",
    ),
    "mirrored camera": (
        change("0/extrinsics_w2c.npy", lambda a: np.diag([-1, 1, 1, 1]).astype("f4") @ a),
        "cameras",
        "rigid",
    ),
    "scaled camera": (change("0/extrinsics_w2c.npy", lambda a: a * np.float32(1.01)), "cameras", "rigid"),
    "a block called visible": (
        assign("1/visibility.npy", (slice(1, 4), slice(0, 60)), True),
        "depth agreement",
        "1/visibility.npy",
    ),
    "a block called hidden": (
        assign("1/visibility.npy", (slice(1, 5), slice(0, 90)), False),
        "hidden for a reason",
        "depth shows its surface",
    ),
    "one visibility bit flipped that a query hangs on": (
        change("1/visibility.npy", lambda a: a ^ np.eye(1, a.size, 511, dtype=bool).reshape(a.shape)),
        "query draw",
        "the draw gives",
    ),
    "a track that is never visible": (
        both(*(assign(f"{view}/visibility.npy", (slice(None), 5), False) for view in range(3))),
        "query draw",
        "track 5 is visible nowhere",
    ),
    "truncated tracks": (truncate("tracks_xyz.npy"), "layout", "tracks_xyz.npy"),
    "truncated depth": (truncate("1/depth.npy"), "layout", "1/depth.npy"),
    "truncated images": (truncate("1/images_jpeg_bytes.npy"), "layout", "1/images_jpeg_bytes.npy"),
    "float64 tracks": (change("tracks_xyz.npy", lambda a: a.astype("f8")), "layout", "must be float32, and is float64"),
    "float16 depth": (change("0/depth.npy", lambda a: a.astype("f2")), "layout", "must be float32, and is float16"),
    "integer visibility": (change("0/visibility.npy", lambda a: a.astype("u1")), "layout", "be bool, and is uint8"),
    "Fortran order": (change("tracks_xyz.npy", np.asfortranarray), "layout", "C order"),
    "frames missing in one view": (change("2/visibility.npy", lambda a: a[:-1]), "layout", "visibility.npy must have"),
    "images of one frame missing": (images(lambda a: a[:-1]), "layout", "must hold 6 images, and holds 5"),
    "intrinsics as a matrix": (change("0/intrinsics.npy", lambda a: np.eye(3, dtype="f4")), "layout", "0/intrinsics"),
    "a missing file": (remove("1/foreground_mask.npy"), "layout", "1/foreground_mask.npy is missing"),
    "a missing view": (remove("1"), "layout", "without a gap, and are 0, 2"),
    "NaN in a track": (assign("tracks_xyz.npy", (2, 3, 1), np.nan), "values", r"tracks_xyz.npy\[2, 3, 1\] is nan"),
    "infinite depth": (assign("0/depth.npy", (1, 5, 6), np.inf), "values", r"0/depth.npy\[1, 5, 6\] is inf"),
    "background of 1e10": (assign("0/depth.npy", (1, 5, 6), 1e10), "values", r"0/depth.npy\[1, 5, 6\]"),
    "NaN in a camera": (assign("0/extrinsics_w2c.npy", (1, 0, 0), np.nan), "cameras", "rigid"),
    "a smaller image": (images(small_image), "images", "36x48 and 72x96"),
    "a cut image": (images(cut_image), "images", r"images_jpeg_bytes.npy\[3\] is not a whole JPEG"),
    "static tracks that tremble": (
        change("tracks_xyz.npy", lambda a: a + np.float32(1e-6) * np.arange(6, dtype="f4")[:, None, None]),
        "static tracks",
        r"tracks_xyz.npy\[:, \d+\]",
    ),
    "nothing moves": (shrug_dynamic, "moving tracks", "0.0% of tracks move"),
    "surfaces of other tracks": (
        change("surface_xyz.npy", lambda a: np.roll(a, 1, axis=1)),
        "on surface",
        "from its triangle",
    ),
}  # fmt: skip


def test_good_data_passes(good: Path) -> None:
    report = verify_sequence(good, BOUNDS)
    assert report.passed and not report.skipped, [str(check) for check in report.checks if not check.passed]
    assert len(report.checks) == 14
    assert json.loads(json.dumps(report.to_json(), allow_nan=False))["passed"] is True
    assert report.table().row_count == 14


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
    images(lambda jpegs: np.roll(jpegs, 1))(sequence)
    assert failed_checks(sequence) == {"sha256": "1/images_jpeg_bytes.npy does not have the recorded sha256"}


def test_a_record_that_names_files_elsewhere_is_refused(sequence: Path) -> None:
    record = json.loads((sequence / "sequence.json").read_text())
    record["files"]["../../etc/passwd"] = "0" * 64
    (sequence / "sequence.json").write_text(json.dumps(record))
    assert "leads out of the folder" in failed_checks(sequence)["sha256"]


def test_data_from_elsewhere_is_verified_as_far_as_it_goes(sequence: Path) -> None:
    (sequence / "sequence.json").unlink()
    (sequence / "surface_xyz.npy").unlink()
    report = verify_sequence(sequence, BOUNDS)
    assert report.passed
    assert "depth agreement of points" in {check.name for check in report.checks}
    assert len(report.skipped) == 2
    ray_length(sequence)
    assert "depth agreement of points" in failed_checks(sequence)


def test_sequences_are_found_below_a_folder(good: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "train" / "room_0", tmp_path / "train" / "room_1"
    copy_of(good, first)
    copy_of(good, second)
    copy_of(good, tmp_path / ".work" / "hidden")
    assert find_sequences(tmp_path) == [first, second]
    assert find_sequences(first) == [first]
    with pytest.raises(SequenceFormatError, match="holds no sequence"):
        find_sequences(first / "0")
