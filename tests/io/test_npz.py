"""Archives that nobody vouches for: plain arrays come out, all else raises and runs nothing."""

import io
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from perpetua.io.npz import MOST_MEMBERS, ArchiveError, open_npz

PLAIN = {
    "floats": np.arange(24.0).reshape(2, 3, 4),
    "fortran": np.asfortranarray(np.arange(6, dtype=np.int16).reshape(2, 3)),
    "text": np.array("walks"),
    "bytes": np.array([b"ab", b"c"]),
    "empty": np.zeros((0, 3), np.float32),
    "flags": np.array([True, False]),
}


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_plain_arrays_come_out_as_they_went_in(tmp_path: Path, save: Any) -> None:
    save(tmp_path / "a.npz", **PLAIN)
    with open_npz(tmp_path / "a.npz") as file:
        assert sorted(file.names) == sorted(PLAIN) and "other" not in file
        for name, array in PLAIN.items():
            header, found = file.header(name), file.read(name)
            assert (header.shape, header.dtype) == (found.shape, found.dtype) == (array.shape, array.dtype)
            np.testing.assert_array_equal(found, array)


class _Trap:
    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (Path("sprung"),)


def _npy(shape: tuple[int, ...], data: bytes, descr: Any = "<f8") -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": descr, "fortran_order": False, "shape": shape})
    return buffer.getvalue() + data


HOSTILE: dict[str, tuple[bytes, str]] = {
    "pickle": (_npy((), pickle.dumps(_Trap()), "|O"), "never pickled objects"),
    "records with objects": (_npy((1,), b"\0" * 16, [("a", "<f8"), ("b", "|O")]), "only plain numbers"),
    "records": (_npy((1,), b"\0" * 16, [("a", "<f8"), ("b", "<f8")]), "only plain numbers"),
    "petabytes promised": (_npy((10**6, 10**6, 10**6), b""), "does not fit"),
    "fewer data than promised": (_npy((3,), b"\0" * 8), "does not fit"),
    "more data than promised": (_npy((1,), b"\0" * 16), "does not fit"),
    "a side below nothing": (_npy((-1,), b""), "plain array"),
    "no header": (b"\x93NUMPY\x01\x00\x08\x00import x" + b"\0" * 40, "plain array"),
    "a later version": (b"\x93NUMPY\x09\x00" + b"\0" * 60, r"version \(9, 0\)"),
    "no array": (b"hello", "plain array"),
    "a bomb of zeros": (_npy((2**21,), bytes(2**24)), "unpacks to 16777"),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_all_else_raises_and_runs_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str) -> None:
    monkeypatch.chdir(tmp_path)
    content, message = HOSTILE[case]
    with zipfile.ZipFile("h.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", content)
    with open_npz(Path("h.npz"), 2**20) as file:
        for ask in (file.header, file.read):
            with pytest.raises(ArchiveError, match=message):
                ask("a")
    assert not Path("sprung").exists()


def test_a_directory_that_lies_about_sizes_unpacks_no_more(tmp_path: Path) -> None:
    """The member says 24 bytes of data in its directory and unpacks to 16 MB."""
    honest, bomb = _npy((3,), bytes(24)), _npy((3,), bytes(2**24))
    with zipfile.ZipFile(tmp_path / "h.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", bomb)
    content = (tmp_path / "h.npz").read_bytes()
    old, new = (len(size).to_bytes(4, "little") for size in (bomb, honest))
    assert content.count(old) == 2
    (tmp_path / "h.npz").write_bytes(content.replace(old, new))
    with open_npz(tmp_path / "h.npz") as file, pytest.raises(ArchiveError, match="plain array"):
        file.read("a")


def test_what_is_no_archive_raises(tmp_path: Path) -> None:
    for content in (b"", b"not a zip", pickle.dumps(_Trap())):
        (tmp_path / "h.npz").write_bytes(content)
        with pytest.raises(ArchiveError, match=r"as an \.npz file"), open_npz(tmp_path / "h.npz"):
            pass
    for missing in (tmp_path / "none.npz", tmp_path):
        with pytest.raises(ArchiveError, match=r"as an \.npz file"), open_npz(missing):
            pass
    with zipfile.ZipFile(tmp_path / "many.npz", "w") as archive:
        for member in range(MOST_MEMBERS + 1):
            archive.writestr(f"{member}.npy", b"")
    with pytest.raises(ArchiveError, match="at most 1024"), open_npz(tmp_path / "many.npz"):
        pass


def test_damaged_data_raise(tmp_path: Path) -> None:
    np.savez_compressed(tmp_path / "d.npz", a=np.random.default_rng(1).normal(size=1000))
    content = bytearray((tmp_path / "d.npz").read_bytes())
    content[len(content) // 2] ^= 0xFF
    (tmp_path / "d.npz").write_bytes(content)
    with open_npz(tmp_path / "d.npz") as file, pytest.raises(ArchiveError, match="'a' in"):
        file.read("a")
