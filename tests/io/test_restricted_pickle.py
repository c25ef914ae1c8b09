"""Hostile pickles raise an error, and nothing of theirs runs."""

import io
import os
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from perpetua.errors import SequenceFormatError
from perpetua.io.restricted_pickle import read_byte_arrays


def save_pickle(path: Path, content: bytes, length: int = 1) -> None:
    """A ``.npy`` object array with any pickle for content."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "|O", "fortran_order": False, "shape": (length,)})
    path.write_bytes(header.getvalue() + content)


def jpeg_like(*lengths: int) -> np.ndarray:
    arrays = np.empty(len(lengths), object)
    for index, length in enumerate(lengths):
        arrays[index] = np.arange(length, dtype=np.uint8)
    return arrays


class Call:
    """Pickles as a call of any function."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.function, self.arguments = function, arguments

    def __reduce__(self) -> tuple[Any, ...]:
        return self.function, self.arguments


@pytest.mark.parametrize("protocol", range(6))
def test_honest_arrays_of_every_protocol_are_read(tmp_path: Path, protocol: int) -> None:
    arrays = jpeg_like(3, 1, 250)
    save_pickle(tmp_path / "a.npy", pickle.dumps(arrays, protocol=protocol), 3)
    read = read_byte_arrays(tmp_path / "a.npy")
    assert [array.tolist() for array in read] == [array.tolist() for array in arrays]
    assert all(array.dtype == np.uint8 for array in read)


def test_numpy_files_are_read(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", jpeg_like(5, 9), allow_pickle=True)
    assert [len(array) for array in read_byte_arrays(tmp_path / "a.npy")] == [5, 9]


@pytest.mark.parametrize("where", ["file", "element"])
def test_a_command_does_not_run(tmp_path: Path, where: str) -> None:
    mark = tmp_path / "ran"
    payload = Call(os.system, f"touch {mark}")
    content: Any = payload
    if where == "element":
        content = jpeg_like(3)
        content[0] = payload
    save_pickle(tmp_path / "evil.npy", pickle.dumps(content))
    with pytest.raises(SequenceFormatError, match=r"posix\.system"):
        read_byte_arrays(tmp_path / "evil.npy")
    assert not mark.exists()
    np.load(tmp_path / "evil.npy", allow_pickle=True)
    assert mark.exists(), "the payload works where it is not stopped"


@pytest.mark.parametrize(
    "call",
    [
        Call(eval, "1"),
        Call(exec, ""),
        Call(getattr, 1, "real"),
        Call(np.load, "x.npy"),
        Call(np.memmap, "x", "uint8", "w+"),
        Call(io.open, "x", "w"),
        Call(pickle.loads, b""),
    ],
    ids=lambda call: call.function.__qualname__ + call.function.__module__,
)
def test_no_other_name_is_known(tmp_path: Path, call: Call) -> None:
    save_pickle(tmp_path / "evil.npy", pickle.dumps(call))
    with pytest.raises(SequenceFormatError, match="no array of JPEG bytes needs"):
        read_byte_arrays(tmp_path / "evil.npy")


@pytest.mark.parametrize(
    "content",
    [
        # A data type whose state claims that pointers are plain bytes, and an array of such "objects".
        b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(K\x00tC\x01btR(K\x01(K\x01tcnumpy\ndtype\n(X\x01\x00\x00\x00O\x89\x88tR(K\x03X\x01\x00\x00\x00|NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb\x89C\x08AAAAAAAAtb.",
        # Attributes set on what the names stand for.
        b"cnumpy\ndtype\n}X\x08\x00\x00\x00__func__cnumpy\nndarray\nsb.",
        b"cnumpy\nndarray\n}X\x04\x00\x00\x00nameX\x01\x00\x00\x00xsb.",
        b"cnumpy.core.multiarray\n_reconstruct.__func__\n.",
        b"\x80\x04cnumpy\n__loader__.load_module\n.",
        b"",
        b"garbage",
        b"N.",
        b"]K\x01a.",
    ],
)
def test_forged_pickles_are_refused(tmp_path: Path, content: bytes) -> None:
    save_pickle(tmp_path / "evil.npy", content)
    with pytest.raises(SequenceFormatError, match=r"evil\.npy"):
        read_byte_arrays(tmp_path / "evil.npy")


def wrong_elements() -> list[np.ndarray]:
    floats, square, text = jpeg_like(4), jpeg_like(4), jpeg_like(4)
    floats[0] = np.zeros(4)
    square[0] = np.zeros((2, 2), np.uint8)
    text[0] = "text"
    return [floats, square, text]


@pytest.mark.parametrize("arrays", wrong_elements(), ids=["floats", "square", "text"])
def test_only_one_dimensional_bytes_are_elements(tmp_path: Path, arrays: np.ndarray) -> None:
    np.save(tmp_path / "a.npy", arrays, allow_pickle=True)
    with pytest.raises(SequenceFormatError, match="entry 0 must be a 1-D uint8 array"):
        read_byte_arrays(tmp_path / "a.npy")


def test_length_must_be_that_of_the_header(tmp_path: Path) -> None:
    save_pickle(tmp_path / "a.npy", pickle.dumps(jpeg_like(2, 2), protocol=3), 3)
    with pytest.raises(SequenceFormatError, match="3 arrays"):
        read_byte_arrays(tmp_path / "a.npy")


def test_plain_arrays_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.zeros(4, np.uint8))
    with pytest.raises(SequenceFormatError, match="object array"):
        read_byte_arrays(tmp_path / "a.npy")
