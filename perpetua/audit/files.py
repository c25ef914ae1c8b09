"""Finds and loads the files of a sequence, and checks their names, types and shapes.

The names repeat ``perpetua.formats.layout`` on purpose: the audit shares no code with the writer, so a file that the
writer misnames is found.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from perpetua.audit.report import Check
from perpetua.errors import SequenceFormatError
from perpetua.io.files import load_json
from perpetua.io.npy import open_npy
from perpetua.io.restricted_pickle import read_byte_arrays

# Letters stand for lengths: F frames, E one less, P tracks, K objects, H and W a view's image. The first file that has
# one settles it.
SEQUENCE_FILES: dict[str, tuple[str, tuple[str | int, ...]]] = {
    "tracks_xyz.npy": ("float32", ("F", "P", 3)),
    "queries_xytv.npy": ("float32", ("P", 4)),
}
VIEW_FILES: dict[str, tuple[str, tuple[str | int, ...]]] = {
    "intrinsics.npy": ("float32", (4,)),
    "extrinsics_w2c.npy": ("float32", ("F", 4, 4)),
    "visibility.npy": ("bool", ("F", "P")),
    "depth.npy": ("float32", ("F", "H", "W")),
    "foreground_mask.npy": ("bool", ("F", "H", "W")),
}
# What data from elsewhere may lack.
PICTURE_FILES = ("depth.npy", "foreground_mask.npy")
OPTIONAL_FILES: dict[str, tuple[str, tuple[str | int, ...]]] = {
    "surface_xyz.npy": ("float32", ("F", "P", 3, 3)),
    "object_poses.npy": ("float32", ("F", "K", 4, 4)),
    "object_boxes.npy": ("float32", ("F", "K", 2, 3)),
}
OPTIONAL_VIEW_FILES: dict[str, tuple[str, tuple[str | int, ...]]] = {
    "tracks_xy.npy": ("float32", ("F", "P", 2)),
    "object_index.npy": ("uint16", ("F", "H", "W")),
    "normals.npy": ("float32", ("F", "H", "W", 3)),
    "scene_flow.npy": ("float32", ("E", "H", "W", 3)),
    "flow.npy": ("float32", ("E", "H", "W", 2)),
    "flow_state.npy": ("uint8", ("E", "H", "W")),
}
IMAGES_FILE = "images_jpeg_bytes.npy"
RECORD_FILE = "sequence.json"


@dataclass
class SequenceFiles:
    """Arrays by relative name, as far as they could be read; JPEG bytes by view; the record."""

    folder: Path
    views: list[str] = field(default_factory=list)
    arrays: dict[str, np.ndarray] = field(default_factory=dict)
    jpegs: dict[str, tuple[np.ndarray, ...]] = field(default_factory=dict)
    record: dict[str, Any] | None = None
    lengths: dict[str, int] = field(default_factory=dict)

    def of_view(self, view: int, name: str) -> np.ndarray:
        """An array of a view."""
        return self.arrays[f"{view}/{name}"]

    def every_view_has(self, *names: str) -> bool:
        """Whether all views have some files."""
        return all(f"{view}/{name}" in self.arrays for view in self.views for name in names)

    @property
    def actors(self) -> list[int]:
        """Object indices of the record's actors; none where there is no sound record."""
        try:
            return [int(obj["object_index"]) for obj in (self.record or {})["objects"] if "actor" in obj]
        except (KeyError, TypeError, ValueError):
            return []


def load_files(folder: Path) -> tuple[SequenceFiles, list[Check]]:
    """Loads what can be loaded; the checks say what could not."""
    files = SequenceFiles(folder)
    faults: list[str] = []
    files.views = _views(folder, faults)
    for name, rule in SEQUENCE_FILES.items():
        _load(files, name, rule, faults)
    for name, rule in OPTIONAL_FILES.items():
        if (folder / name).exists():
            _load(files, name, rule, faults)
    _load_record(files, faults)
    for view in files.views:
        for name, rule in VIEW_FILES.items():
            # Ours always has depth and masks; others may do without.
            if files.record is not None or name not in PICTURE_FILES or (folder / view / name).exists():
                _load(files, f"{view}/{name}", rule, faults)
        for name, rule in _optional_of_view(files.views, view).items():
            if (folder / view / name).exists():
                _load(files, f"{view}/{name}", rule, faults)
        _load_images(files, view, faults)
    bound = "every file of the layout, exact types and shapes"
    return files, [Check("layout", not faults, float(len(faults)), bound, "; ".join(faults[:5]))]


def _views(folder: Path, faults: list[str]) -> list[str]:
    found = sorted((path.name for path in folder.iterdir() if path.is_dir() and path.name.isdecimal()), key=int)
    if not found:
        faults.append("there is no view folder 0")
    elif found != [str(index) for index in range(len(found))]:
        faults.append(f"view folders must be 0, 1, 2, ... without a gap, and are {', '.join(found)}")
        return []
    return found


def _optional_of_view(views: list[str], view: str) -> dict[str, tuple[str, tuple[str | int, ...]]]:
    rules = dict(OPTIONAL_VIEW_FILES)
    for other in views:
        if other != view:
            rules[f"flow_to_{other}.npy"] = ("float32", ("F", "H", "W", 2))
            rules[f"flow_to_{other}_state.npy"] = ("uint8", ("F", "H", "W"))
    return rules


def _load(files: SequenceFiles, name: str, rule: tuple[str, tuple[str | int, ...]], faults: list[str]) -> None:
    dtype, shape = rule
    path = files.folder / name
    if not path.resolve().is_relative_to(files.folder.resolve()):
        faults.append(f"{name} leads out of the folder")
        return
    try:
        array = open_npy(path)
    except (OSError, ValueError) as error:
        faults.append(f"{name} is missing" if not path.exists() else f"{name} cannot be read: {error}")
        return
    fault = _fault(files, name, array, dtype, shape)
    if fault:
        faults.append(f"{name} {fault}")
    else:
        files.arrays[name] = array


def _fault(files: SequenceFiles, name: str, array: np.ndarray, dtype: str, shape: tuple[str | int, ...]) -> str:
    if str(array.dtype) != dtype:
        return f"must be {dtype}, and is {array.dtype}"
    # Views may differ in size, so an image's sides are settled view by view.
    keys = [f"{name.partition('/')[0]}/{length}" if length in ("H", "W") else length for length in shape]
    wanted = tuple(files.lengths.get(key, key) if isinstance(key, str) else key for key in keys)
    fits = array.ndim == len(shape) and all(
        isinstance(want, str) or want == have for want, have in zip(wanted, array.shape, strict=True)
    )
    if not fits:
        return f"must have shape ({', '.join(map(str, wanted))}), and has {array.shape}"
    if not array.flags.c_contiguous:
        return "must be in C order"
    files.lengths |= {key: have for key, have in zip(keys, array.shape, strict=True) if isinstance(key, str)}
    if "F" in files.lengths:
        files.lengths["E"] = files.lengths["F"] - 1
    return ""


def _load_images(files: SequenceFiles, view: str, faults: list[str]) -> None:
    name = f"{view}/{IMAGES_FILE}"
    path = files.folder / name
    if not path.exists():
        faults.append(f"{name} is missing")
        return
    try:
        jpegs = read_byte_arrays(path)
    except SequenceFormatError as error:
        faults.append(str(error))
        return
    if len(jpegs) != files.lengths.get("F", len(jpegs)):
        faults.append(f"{name} must hold {files.lengths['F']} images, and holds {len(jpegs)}")
        return
    files.jpegs[view] = jpegs


def _load_record(files: SequenceFiles, faults: list[str]) -> None:
    path = files.folder / RECORD_FILE
    if not path.exists():
        return
    try:
        record = load_json(path)
    except (OSError, ValueError) as error:
        faults.append(f"{RECORD_FILE} cannot be read: {error}")
        return
    if not isinstance(record, dict):
        faults.append(f"{RECORD_FILE} must be a JSON object")
        return
    files.record = record
