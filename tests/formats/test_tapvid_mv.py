"""What is written in the benchmark layout, and what the reader makes of it."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from perpetua.errors import ConfigError, SequenceFormatError
from perpetua.formats.reader import read_sequence
from perpetua.formats.source import EXPORTERS
from perpetua.testing.synthetic_sequence import write_scene


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("written") / "sequence"
    write_scene(folder)
    return folder


@pytest.fixture
def sequence(written: Path, tmp_path: Path) -> Path:
    """A copy to damage."""
    copy = tmp_path / "sequence"
    for path in sorted(written.rglob("*")):
        if path.is_file():
            target = copy / path.relative_to(written)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
    return copy


def test_every_file_has_the_type_and_shape_of_the_layout(written: Path) -> None:
    expected = {
        "tracks_xyz.npy": ("float32", (6, 200, 3)),
        "queries_xytv.npy": ("float32", (200, 4)),
        "surface_xyz.npy": ("float32", (6, 200, 3, 3)),
    }
    for view in range(3):
        expected |= {
            f"{view}/images_jpeg_bytes.npy": ("object", (6,)),
            f"{view}/intrinsics.npy": ("float32", (4,)),
            f"{view}/extrinsics_w2c.npy": ("float32", (6, 4, 4)),
            f"{view}/visibility.npy": ("bool", (6, 200)),
            f"{view}/depth.npy": ("float32", (6, 72, 96)),
            f"{view}/foreground_mask.npy": ("bool", (6, 72, 96)),
            f"{view}/tracks_xy.npy": ("float32", (6, 200, 2)),
        }
    expected |= {
        "object_poses.npy": ("float32", (6, 6, 4, 4)),
        "object_boxes.npy": ("float32", (6, 6, 2, 3)),
    }
    names = {path.relative_to(written).as_posix() for path in written.rglob("*") if path.is_file()}
    assert names == {*expected, "sequence.json"}
    for name, (dtype, shape) in expected.items():
        array = np.load(written / name, allow_pickle=dtype == "object")
        assert (str(array.dtype), array.shape, array.flags.c_contiguous) == (dtype, shape, True), name


def test_plain_numpy_reads_the_jpegs(written: Path) -> None:
    jpegs = np.load(written / "0" / "images_jpeg_bytes.npy", allow_pickle=True)
    assert all(jpeg.dtype == np.uint8 and jpeg.ndim == 1 and bytes(jpeg[:2]) == b"\xff\xd8" for jpeg in jpegs)


def test_reads_back_what_was_written(tmp_path: Path) -> None:
    scene, tracks = write_scene(tmp_path)
    sequence = read_sequence(tmp_path)
    np.testing.assert_array_equal(sequence.tracks_m, tracks.points.position_m.astype(np.float32))
    np.testing.assert_array_equal(sequence.queries_xytv, tracks.queries_xytv)
    for index, (view, rendered) in enumerate(zip(sequence.views, scene.views, strict=True)):
        assert tuple(bytes(jpeg) for jpeg in view.jpeg) == rendered.jpeg
        np.testing.assert_array_equal(view.visible, tracks.views.visible[index])
        assert view.depth_m is not None and view.foreground is not None
        np.testing.assert_array_equal(view.depth_m, rendered.depth_m)
        np.testing.assert_array_equal(view.foreground, rendered.object_index > 4)
        assert view.image(0).shape == (72, 96, 3)
        poses = view.camera_from_world.astype(np.float64) @ scene.cameras[index].world_from_camera
        np.testing.assert_allclose(poses, np.tile(np.eye(4), (6, 1, 1)), atol=1e-6)


def test_record_ties_tracks_to_surfaces_and_hashes_every_file(written: Path) -> None:
    record = json.loads((written / "sequence.json").read_text())
    corner_m = np.load(written / "surface_xyz.npy").astype(np.float64)
    position_m = np.einsum("nk,tnkc->tnc", np.array(record["tracks"]["barycentric"]), corner_m)
    np.testing.assert_allclose(position_m, np.load(written / "tracks_xyz.npy"), atol=1e-6)
    assert record["seed"] == 5
    assert set(record["tracks"]["category"]) == {"shell", "crate", "table", "vase", "person"}
    people = [category == "person" for category in record["tracks"]["category"]]
    assert [kind != "static" for kind in record["tracks"]["class"]] == people
    for name, digest in record["files"].items():
        assert hashlib.sha256((written / name).read_bytes()).hexdigest() == digest
    assert len(record["files"]) == 5 + 3 * 7
    actor = [None if index <= 4 else index - 5 for index in record["tracks"]["object_index"]]
    assert record["tracks"]["actor"] == actor


def test_equal_input_gives_equal_bytes(written: Path, tmp_path: Path) -> None:
    write_scene(tmp_path)
    for path in sorted(tmp_path.rglob("*")):
        if path.is_file():
            assert path.read_bytes() == (written / path.relative_to(tmp_path)).read_bytes(), path.name


def test_depth_stays_on_disk(written: Path) -> None:
    assert isinstance(read_sequence(written).views[0].depth_m, np.memmap)


@pytest.mark.parametrize(
    ("name", "message"),
    [("tracks_xyz.npy", "tracks_xyz"), ("1/visibility.npy", "visibility"), ("1/images_jpeg_bytes.npy", "images")],
)
def test_truncated_and_missing_files_are_named(sequence: Path, name: str, message: str) -> None:
    content = (sequence / name).read_bytes()
    (sequence / name).write_bytes(content[: len(content) // 2])
    with pytest.raises(SequenceFormatError, match=message):
        read_sequence(sequence)
    (sequence / name).unlink()
    with pytest.raises(SequenceFormatError, match=message):
        read_sequence(sequence)


def test_wrong_type_names_both_types(sequence: Path) -> None:
    np.save(sequence / "tracks_xyz.npy", np.load(sequence / "tracks_xyz.npy").astype(np.float64))
    with pytest.raises(SequenceFormatError, match=r"must be float32 .* not float64"):
        read_sequence(sequence)


def test_a_gap_between_views_is_an_error(sequence: Path) -> None:
    (sequence / "1").rename(sequence / "7")
    with pytest.raises(SequenceFormatError, match="without a gap, not 0, 2, 7"):
        read_sequence(sequence)


def test_a_file_that_leads_out_of_the_folder_is_not_read(sequence: Path, tmp_path: Path) -> None:
    outside = tmp_path / "elsewhere.npy"
    (sequence / "0" / "visibility.npy").rename(outside)
    (sequence / "0" / "visibility.npy").symlink_to(outside)
    with pytest.raises(SequenceFormatError, match="outside"):
        read_sequence(sequence)


def test_depth_and_masks_may_be_missing(sequence: Path) -> None:
    (sequence / "2" / "depth.npy").unlink()
    (sequence / "sequence.json").unlink()
    read = read_sequence(sequence)
    assert read.views[2].depth_m is None and read.views[1].depth_m is not None and read.record is None


def test_unknown_exporter_names_the_nearest() -> None:
    with pytest.raises(ConfigError, match="did you mean 'tapvid3d'"):
        EXPORTERS["tapvid3"]
