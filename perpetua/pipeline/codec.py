"""Values between stages as files: structure in value.json, arrays beside it; reading runs no code of the data.

Small arrays share one ``arrays.npz``; large ones get a ``.npy`` of their own and come back memory-mapped. A path or
a memory map that already lies in the folder is kept as it is and referred to by name. Equal values give equal
bytes.
"""

import dataclasses
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from perpetua.errors import PerpetuaError
from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.pinhole import Intrinsics
from perpetua.io.files import load_json
from perpetua.navigation.types import NavGrid
from perpetua.scene.actor import ActorMesh, ActorPart, BodyMotion, Dwell, Route, Seat
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import AreaLight, Material, Room, SceneObject, Sky
from perpetua.scene.scene import RenderedView
from perpetua.tracks.types import PointTracks, SequenceTracks, ViewTracks, VisibilityReport

VALUE_FILE = "value.json"
ARRAY_FILE = "arrays.npz"
OWN_FILE_BYTES = 1 << 20

STORED_TYPES = {
    stored.__name__: stored
    for stored in (
        ActorMesh, ActorPart, AreaLight, BodyMotion, CameraPath, Dwell, Intrinsics, Material, NavGrid, PointTracks,
        RenderedView, Room, Route, SceneObject, Seat, SequenceTracks, Sky, VisibilityReport, TriMesh, ViewTracks,
    )
}  # fmt: skip
# Names that types had in older work areas.
OLD_NAMES = {"SightReport": "VisibilityReport"}


class DamagedValueError(PerpetuaError):
    """A stored value cannot be read back; the stage has to be computed again."""


def save(value: object, folder: Path) -> None:
    """Writes a value (dataclasses of ``STORED_TYPES``, tuples, arrays, plain values) into an existing folder.

    Raises:
        TypeError: the value holds something that has no file form.
    """
    writer = _Writer(folder)
    tree = writer.encode(value)
    if writer.small:
        np.savez(folder / ARRAY_FILE, **writer.small)
    (folder / VALUE_FILE).write_text(json.dumps(tree, separators=(",", ":")), encoding="utf-8")


def load(folder: Path) -> Any:
    """Reads what ``save`` wrote.

    Raises:
        DamagedValueError: a file is missing, cut short, or names something outside the folder.
    """
    try:
        return _Reader(folder).decode(load_json(folder / VALUE_FILE))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, EOFError, zipfile.BadZipFile) as error:
        raise DamagedValueError(f"cannot read the stage in '{folder}': {error}") from error


class _Writer:
    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self.small: dict[str, np.ndarray] = {}
        self.count = 0

    def encode(self, value: object) -> Any:
        if value is None or isinstance(value, str | bool):
            return value
        if isinstance(value, int | np.integer):
            return int(value)
        if isinstance(value, float | np.floating):
            return float(value)
        if isinstance(value, np.ndarray):
            return {"@array": self._array(value)}
        if isinstance(value, bytes):
            return {"@bytes": self._array(np.frombuffer(value, np.uint8))}
        if isinstance(value, Path):
            return {"@path": self._inside(value)}
        if isinstance(value, tuple):
            return {"@tuple": [self.encode(item) for item in value]}
        if dataclasses.is_dataclass(value) and type(value).__name__ in STORED_TYPES:
            fields = {field.name: self.encode(getattr(value, field.name)) for field in dataclasses.fields(value)}
            return {"@type": type(value).__name__, "fields": fields}
        raise TypeError(f"a stage cannot store {type(value).__name__}: add it to STORED_TYPES")

    def _array(self, array: np.ndarray) -> str:
        if array.dtype.hasobject:
            raise TypeError("a stage cannot store an array of Python objects: they would need pickle")
        kept = self._file_of(array)
        if kept is not None:
            return self._inside(kept)
        self.count += 1
        if array.nbytes < OWN_FILE_BYTES:
            key = f"a{self.count}"
            self.small[key] = array
            return key
        name = f"a{self.count}.npy"
        np.save(self.folder / name, np.ascontiguousarray(array), allow_pickle=False)
        return name

    def _file_of(self, array: np.ndarray) -> Path | None:
        """The .npy in the folder that a memory map shows whole, if it does."""
        if not isinstance(array, np.memmap) or array.filename is None or not array.flags.c_contiguous:
            return None
        path = Path(array.filename)
        if path.suffix != ".npy" or not path.resolve().is_relative_to(self.folder):
            return None
        whole = np.load(path, mmap_mode="r", allow_pickle=False)
        return path if (whole.shape, whole.dtype) == (array.shape, array.dtype) else None

    def _inside(self, path: Path) -> str:
        resolved = path.resolve()
        if not resolved.is_relative_to(self.folder):
            raise TypeError(f"a stage's file must lie in its folder '{self.folder}', not at '{path}'")
        return resolved.relative_to(self.folder).as_posix()


class _Reader:
    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        small = self.folder / ARRAY_FILE
        self.small: dict[str, np.ndarray] = {}
        if small.exists():
            # Opened here: numpy leaves a file that is no archive open.
            with small.open("rb") as handle, np.load(handle, allow_pickle=False) as archive:
                self.small = {key: archive[key] for key in archive.files}

    def decode(self, tree: Any) -> Any:
        if not isinstance(tree, dict):
            return tree
        if "@array" in tree:
            return self._array(tree["@array"])
        if "@bytes" in tree:
            return self._array(tree["@bytes"]).tobytes()
        if "@path" in tree:
            return self._inside(tree["@path"])
        if "@tuple" in tree:
            return tuple(self.decode(item) for item in tree["@tuple"])
        name: str = tree["@type"]
        stored = STORED_TYPES[OLD_NAMES.get(name, name)]
        return stored(**{name: self.decode(value) for name, value in tree["fields"].items()})

    def _array(self, name: str) -> np.ndarray:
        if not name.endswith(".npy"):
            return self.small[name]
        array: np.ndarray = np.load(self._inside(name), mmap_mode="r", allow_pickle=False)
        return array

    def _inside(self, name: str) -> Path:
        path = (self.folder / name).resolve()
        if not path.is_relative_to(self.folder):
            raise ValueError(f"'{name}' leads out of the folder")
        return path
