"""Sequences that are damaged or meant to hurt: each is refused with a message, quickly, and nothing is run or read
elsewhere. The checks of ``verify`` say so as a failed check instead."""

import io
import json
import os
import pickle
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from perpetua.audit.files import load_files
from perpetua.errors import SequenceFormatError
from perpetua.formats.reader import read_sequence
from perpetua.io.npy import open_npy
from tests.support.robustness import BadInput

FRAMES, TRACKS, WIDTH_PX, HEIGHT_PX = 3, 5, 8, 6
MOST_SECONDS = 10.0


def write_sequence(folder: Path) -> Path:
    """A sequence of one view, as small as can be."""
    view = folder / "0"
    view.mkdir(parents=True)
    np.save(folder / "tracks_xyz.npy", np.zeros((FRAMES, TRACKS, 3), np.float32))
    np.save(folder / "queries_xytv.npy", np.zeros((TRACKS, 4), np.float32))
    np.save(view / "intrinsics.npy", np.array([8.0, 8.0, 3.5, 2.5], np.float32))
    np.save(view / "extrinsics_w2c.npy", np.tile(np.eye(4, dtype=np.float32), (FRAMES, 1, 1)))
    np.save(view / "visibility.npy", np.ones((FRAMES, TRACKS), bool))
    np.save(view / "depth.npy", np.ones((FRAMES, HEIGHT_PX, WIDTH_PX), np.float32))
    np.save(view / "foreground_mask.npy", np.zeros((FRAMES, HEIGHT_PX, WIDTH_PX), bool))
    images = np.empty(FRAMES, object)
    for frame in range(FRAMES):
        images[frame] = np.arange(9, dtype=np.uint8)
    np.save(view / "images_jpeg_bytes.npy", images, allow_pickle=True)
    (folder / "sequence.json").write_text("{}")
    return folder


def _save(name: str, array: np.ndarray) -> Callable[[Path], None]:
    return lambda folder: np.save(folder / name, array, allow_pickle=True)


def _write(name: str, content: bytes) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        (folder / name).write_bytes(content)

    return spoil


def _header(description: str) -> bytes:
    """A ``.npy`` file with any text for its header, and 48 bytes of data."""
    text = description.encode("latin1")
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(48)


def _promise(shape: str, descr: str = "<f4") -> bytes:
    return _header(f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n")


def _cut(folder: Path) -> None:
    path = folder / "tracks_xyz.npy"
    path.write_bytes(path.read_bytes()[:-4])


def _longer(folder: Path) -> None:
    with (folder / "tracks_xyz.npy").open("ab") as handle:
        handle.write(bytes(4))


def _link_out(folder: Path) -> None:
    outside = folder.parent / "outside.npy"
    (folder / "tracks_xyz.npy").rename(outside)
    (folder / "tracks_xyz.npy").symlink_to(outside)


def _link_view_out(folder: Path) -> None:
    outside = folder.parent / "view"
    (folder / "0").rename(outside)
    (folder / "0").symlink_to(outside, target_is_directory=True)


def _link_record_out(folder: Path) -> None:
    (folder / "sequence.json").unlink()
    (folder / "sequence.json").symlink_to("/etc/hostname")


def _pipe(name: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        (folder / name).unlink()
        os.mkfifo(folder / name)

    return spoil


def _folder(folder: Path) -> None:
    (folder / "tracks_xyz.npy").unlink()
    (folder / "tracks_xyz.npy").mkdir()


def _archive(folder: Path) -> None:
    packed = io.BytesIO()
    np.savez(packed, tracks=np.zeros((FRAMES, TRACKS, 3), np.float32))
    (folder / "tracks_xyz.npy").write_bytes(packed.getvalue())


def _rename(name: str, new: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        (folder / name).rename(folder / new)

    return spoil


class _Command:
    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, ...]:
        return os.system, (f"touch {self.mark}",)


def _command(folder: Path) -> None:
    (folder / "tracks_xyz.npy").write_bytes(pickle.dumps(_Command(folder.parent / "ran")))


TRACKS_FILE = "tracks_xyz.npy"
BAD_SEQUENCES = (
    BadInput("file missing", lambda folder: (folder / TRACKS_FILE).unlink(), "tracks_xyz.npy"),
    BadInput("file empty", _write(TRACKS_FILE, b""), "EOF"),
    BadInput("file cut short", _cut, "does not fit"),
    BadInput("file with a tail", _longer, "does not fit"),
    BadInput("text in place of an array", _write(TRACKS_FILE, b"hello " * 40), "magic string is not correct"),
    BadInput("archive in place of an array", _archive, "magic string is not correct"),
    BadInput("pickled command in place of an array", _command, "magic string is not correct"),
    BadInput("folder in place of a file", _folder, "no regular file"),
    BadInput("pipe in place of a file, which would block for ever", _pipe(TRACKS_FILE), "no regular file"),
    BadInput("pipe in place of the images", _pipe("0/images_jpeg_bytes.npy"), "no regular file"),
    BadInput("pipe in place of the record", _pipe("sequence.json"), "no regular file"),
    BadInput("header of a shape of 4 TB", _write(TRACKS_FILE, _promise("(1000000000000, 1, 3)")), "does not fit"),
    BadInput(
        "header whose product overflows to the size",
        _write(TRACKS_FILE, _promise("(4611686018427387908, 1, 3)")),
        "does not fit",
    ),
    BadInput("header of a negative shape", _write(TRACKS_FILE, _promise("(-1, -4, 3)")), "does not fit"),
    BadInput(
        "header of elements of 1 GB", _write(TRACKS_FILE, _promise("(1, 1, 3)", "|V1000000000")), "only plain numbers"
    ),
    BadInput("header of Python objects", _save(TRACKS_FILE, np.full((FRAMES, TRACKS, 3), None)), "only plain numbers"),
    BadInput("header that is code", _write(TRACKS_FILE, _header("__import__('os').system('true')\n")), "cannot read"),
    BadInput("header nested 5,000 deep", _write(TRACKS_FILE, _header("(" * 5000 + ")" * 5000 + "\n")), "cannot read"),
    BadInput("header of an unknown version", _write(TRACKS_FILE, b"\x93NUMPY\x09\x00" + bytes(64)), "version"),
    BadInput("big-endian numbers", _save(TRACKS_FILE, np.zeros((FRAMES, TRACKS, 3), ">f4")), "must be float32"),
    BadInput("double precision", _save(TRACKS_FILE, np.zeros((FRAMES, TRACKS, 3))), "must be float32"),
    BadInput("complex numbers", _save(TRACKS_FILE, np.zeros((FRAMES, TRACKS, 3), np.complex64)), "must be float32"),
    BadInput(
        "wrong number of axes",
        _save(TRACKS_FILE, np.zeros((FRAMES, 3), np.float32)),
        "must be float32 ('any', 'any', 3)",
    ),
    BadInput(
        "queries of another number of tracks",
        _save("queries_xytv.npy", np.zeros((4, 4), np.float32)),
        "must be float32 (5, 4)",
    ),
    BadInput("visibility as numbers", _save("0/visibility.npy", np.ones((FRAMES, TRACKS), np.uint8)), "must be bool"),
    BadInput(
        "depth of another number of frames",
        _save("0/depth.npy", np.ones((9, 6, 8), np.float32)),
        "must be float32 (3, 'any', 'any')",
    ),
    BadInput(
        "images of another number of frames", _save("0/images_jpeg_bytes.npy", np.empty(0, object)), "has 0 frames"
    ),
    BadInput("link to a file outside", _link_out, "lies outside"),
    BadInput("link to a view outside", _link_view_out, "lies outside"),
    BadInput("link to a record outside", _link_record_out, "lies outside"),
    BadInput("no view", _rename("0", "zero"), "has no view"),
    BadInput("views with a gap", _rename("0", "1"), "without a gap"),
    BadInput(
        "record nested 100,000 deep", _write("sequence.json", b"[" * 100_000 + b"]" * 100_000), "nested too deeply"
    ),
    BadInput("record cut short", _write("sequence.json", b'{"seed": 1'), "not valid JSON"),
    BadInput("record in another encoding", _write("sequence.json", b'{"name": "\xff\xfe"}'), "not valid JSON"),
    BadInput("record that is a list", _write("sequence.json", b"[1]"), "must be a JSON object"),
)


def _tree(folder: Path) -> list[str]:
    return sorted(str(path) for path in folder.rglob("*"))


@pytest.mark.parametrize("case", BAD_SEQUENCES, ids=str)
def test_bad_sequence_is_refused_and_nothing_happens(tmp_path: Path, case: BadInput) -> None:
    folder = write_sequence(tmp_path / "sequence")
    case.spoil(folder)
    before, started = _tree(tmp_path), time.process_time()
    with pytest.raises(SequenceFormatError) as caught:
        _ = read_sequence(folder).record
    assert case.says in str(caught.value)
    assert caught.value.exit_code == 2
    assert time.process_time() - started < MOST_SECONDS
    assert _tree(tmp_path) == before


@pytest.mark.parametrize("case", BAD_SEQUENCES, ids=str)
def test_bad_sequence_fails_verify(tmp_path: Path, case: BadInput) -> None:
    folder = write_sequence(tmp_path / "sequence")
    assert load_files(folder)[1][0].passed
    case.spoil(folder)
    before = _tree(tmp_path)
    _, checks = load_files(folder)
    assert not checks[0].passed
    assert checks[0].detail
    assert _tree(tmp_path) == before


def test_good_sequence_is_read(tmp_path: Path) -> None:
    sequence = read_sequence(write_sequence(tmp_path / "sequence"))
    assert sequence.record == {}
    assert len(sequence.views[0].jpeg) == FRAMES


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(position=st.integers(0, 187), byte=st.integers(0, 255), cut=st.integers(0, 400))
def test_any_damage_is_an_array_or_an_error(tmp_path: Path, position: int, byte: int, cut: int) -> None:
    path = tmp_path / "a.npy"
    array = np.arange(FRAMES * TRACKS, dtype=np.float32).reshape(FRAMES, TRACKS)
    np.save(path, array)
    content = bytearray(path.read_bytes())
    content[position] = byte
    path.write_bytes(content[: len(content) - cut] if cut < len(content) else b"")
    try:
        found = open_npy(path)
    except ValueError:
        return
    assert found.nbytes <= array.nbytes


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    content=st.one_of(
        st.binary(max_size=200),
        st.recursive(st.none() | st.integers() | st.text(), st.lists).map(lambda tree: json.dumps(tree).encode()),
    )
)
def test_any_record_is_read_or_refused(tmp_path: Path, content: bytes) -> None:
    folder = tmp_path / "sequence"
    if not folder.exists():
        write_sequence(folder)
    (folder / "sequence.json").write_bytes(content)
    with pytest.raises(SequenceFormatError):
        _ = read_sequence(folder).record


def test_plain_arrays_come_back(tmp_path: Path) -> None:
    for array in (
        np.arange(6.0).reshape(2, 3),
        np.asfortranarray(np.arange(6).reshape(2, 3)),
        np.zeros((0, 3)),
        np.array(7),
    ):
        np.save(tmp_path / "a.npy", array)
        found = open_npy(tmp_path / "a.npy")
        np.testing.assert_array_equal(found, array)
        assert found.dtype == array.dtype
