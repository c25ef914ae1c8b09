"""Files of predictions: what is read is what was written, and whatever else they hold is refused."""

import io
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from perpetua.errors import InputError
from perpetua.evaluation.predictions import Geometry, Predictions, SequenceSize, read_predictions, write_predictions

SIZE = SequenceSize(views=2, frames=3, tracks=5)


def _arrays(tracks: int = 5) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    return {
        "tracks_xyz_camera": rng.normal(size=(2, 3, tracks, 3)).astype(np.float32),
        "tracks_xyz_world": rng.normal(size=(3, tracks, 3)),
        "visibility": rng.random((2, 3, tracks)) < 0.5,
    }


def _save(folder: Path, arrays: dict[str, Any]) -> Path:
    path = folder / "predictions.npz"
    np.savez(path, **arrays)
    return path


def test_what_was_written_is_read(tmp_path: Path) -> None:
    given = _arrays()
    geometry = Geometry(np.array([[1, 2, 0, 1]] * 4, np.int64), np.arange(12.0).reshape(4, 3))
    seen = given["visibility"]
    written = Predictions(given["tracks_xyz_camera"], given["tracks_xyz_world"], seen, seen.any(axis=0), geometry)
    write_predictions(tmp_path / "p.npz", written)
    found = read_predictions(tmp_path / "p.npz", SIZE)
    assert found.camera is not None and found.world is not None and found.visible is not None
    assert found.geometry is not None
    assert np.array_equal(found.camera, given["tracks_xyz_camera"])
    assert np.array_equal(found.world, given["tracks_xyz_world"])
    assert np.array_equal(found.visible, seen)
    assert np.array_equal(found.visible_anywhere, seen[0] | seen[1])
    assert np.array_equal(found.geometry.pixels_xytv, geometry.pixels_xytv)
    assert np.array_equal(found.geometry.point, geometry.point)


def test_world_tracks_need_no_views(tmp_path: Path) -> None:
    given = _arrays()
    seen = given["visibility"][0]
    path = _save(tmp_path, {"tracks_xyz_world": given["tracks_xyz_world"], "visibility": seen})
    found = read_predictions(path, SIZE)
    assert found.camera is None and found.visible is None
    assert np.array_equal(found.visible_anywhere, seen)


def test_tracks_that_the_index_leaves_out_are_missing(tmp_path: Path) -> None:
    given = _arrays(2)
    found = read_predictions(_save(tmp_path, {**given, "track_index": np.array([4, 1], np.uint16)}), SIZE)
    assert found.camera is not None and found.world is not None and found.visible is not None
    assert np.array_equal(found.camera[:, :, [4, 1]], given["tracks_xyz_camera"])
    assert np.array_equal(found.world[:, [4, 1]], given["tracks_xyz_world"])
    assert np.array_equal(found.visible[:, :, [4, 1]], given["visibility"])
    assert np.isnan(found.camera[:, :, [0, 2, 3]]).all() and np.isnan(found.world[:, [0, 2, 3]]).all()
    assert not found.visible[:, :, [0, 2, 3]].any()


def _without(name: str) -> dict[str, Any]:
    return {key: value for key, value in _arrays().items() if key != name}


FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "nothing": ({}, "holds nothing"),
    "no visibility": (_without("visibility"), "must hold 'visibility'"),
    "no tracks": ({"visibility": _arrays()["visibility"]}, "at least one of 'tracks_xyz_camera'"),
    "unknown name": ({**_arrays(), "visibilty": np.zeros(3)}, "may hold tracks_xyz_camera"),
    "other count": (_arrays(4), r"must have shape \(2, 3, 5, 3\)"),
    "transposed": (
        {**_arrays(), "visibility": _arrays()["visibility"].transpose(0, 2, 1)},
        r"must have shape \(2, 3, 5\) or \(3, 5\)",
    ),
    "visibility as numbers": ({**_arrays(), "visibility": np.zeros((2, 3, 5))}, "must be bool"),
    "positions as integers": ({**_arrays(), "tracks_xyz_world": np.zeros((3, 5, 3), int)}, "must be floating point"),
    "complex positions": ({**_arrays(), "tracks_xyz_world": np.zeros((3, 5, 3), complex)}, "must be floating point"),
    "long doubles": ({**_arrays(), "tracks_xyz_world": np.zeros((3, 5, 3), np.longdouble)}, "at most 64 bits"),
    "objects": ({**_arrays(), "tracks_xyz_world": np.full((3, 5, 3), None)}, "never pickled objects"),
    "one visibility for views": ({**_arrays(), "visibility": np.ones((3, 5), bool)}, "for each view"),
    "track out of range": ({**_arrays(2), "track_index": np.array([0, 5])}, r"must lie in 0\.\.4"),
    "negative track": ({**_arrays(2), "track_index": np.array([-1, 2])}, r"must lie in 0\.\.4"),
    "track named twice": ({**_arrays(2), "track_index": np.array([3, 3])}, "at most once"),
    "too many tracks": ({**_arrays(6), "track_index": np.arange(6)}, "at most 5 tracks"),
    "index of two axes": ({**_arrays(1), "track_index": np.zeros((1, 1), int)}, "at most 5 tracks"),
    "half a geometry": ({**_arrays(), "geometry_xyz_world": np.zeros((4, 3))}, "both"),
    "unequal geometry": (
        {**_arrays(), "geometry_xyz_world": np.zeros((4, 3)), "geometry_pixels_xytv": np.zeros((5, 4), int)},
        r"must be \(G, 3\)",
    ),
    "geometry without a world": (
        {
            **_without("tracks_xyz_world"),
            "geometry_xyz_world": np.zeros((4, 3)),
            "geometry_pixels_xytv": np.zeros((4, 4), int),
        },
        "which is missing",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_wrong_arrays_are_refused(tmp_path: Path, fault: str) -> None:
    arrays, message = FAULTS[fault]
    with pytest.raises(InputError, match=message):
        read_predictions(_save(tmp_path, arrays), SIZE)


class _Bomb:
    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (Path("bomb-went-off"),)


def _npy(shape: tuple[int, ...], data: bytes, descr: str = "<f8") -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": descr, "fortran_order": False, "shape": shape})
    return buffer.getvalue() + data


HOSTILE: dict[str, bytes] = {
    "pickle": _npy((), pickle.dumps(_Bomb()), "|O"),
    "a header that promises petabytes": _npy((10**6, 10**6, 10**6), b""),
    "more sides than data": _npy((3, 5, 3), b"\0" * 8),
    "negative side": _npy((-3, 5, 3), b"\0" * 8),
    "a header that is no header": b"\x93NUMPY\x01\x00\x08\x00import x" + b"\0" * 40,
    "version 9": b"\x93NUMPY\x09\x00" + b"\0" * 60,
    "no array": b"hello",
    "empty": b"",
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_members_raise_and_run_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "hostile.npz"
    np.savez(path, visibility=_arrays()["visibility"])
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("tracks_xyz_world.npy", HOSTILE[case])
    with pytest.raises(InputError, match=r"hostile\.npz"):
        read_predictions(path, SIZE)
    assert not (tmp_path / "bomb-went-off").exists()


def test_a_name_given_twice_is_refused(tmp_path: Path) -> None:
    path = _save(tmp_path, _arrays())
    with pytest.warns(UserWarning, match="Duplicate"), zipfile.ZipFile(path, "a") as archive:
        archive.writestr("visibility.npy", _npy((0,), b""))
    with pytest.raises(InputError, match="each once"):
        read_predictions(path, SIZE)


def test_files_that_are_no_archive_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "p.npz"
    whole = _save(tmp_path, _arrays()).read_bytes()
    contents = [b"", b"not a zip", whole[: len(whole) // 2], pickle.dumps(_Bomb())]
    for content in contents:
        path.write_bytes(content)
        with pytest.raises(InputError, match="cannot read predictions"):
            read_predictions(path, SIZE)
    for missing in (tmp_path / "none.npz", tmp_path):
        with pytest.raises(InputError, match="cannot read predictions"):
            read_predictions(missing, SIZE)


def test_damaged_data_are_refused(tmp_path: Path) -> None:
    path = _save(tmp_path, _arrays())
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(InputError, match="cannot read predictions"):
        read_predictions(path, SIZE)
