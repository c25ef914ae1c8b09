"""Reader of the benchmark layout."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float32, UInt8, UInt16

from perpetua.errors import SequenceFormatError
from perpetua.formats import layout
from perpetua.io.files import load_json
from perpetua.io.npy import open_npy
from perpetua.io.restricted_pickle import read_byte_arrays


@dataclass(frozen=True, repr=False)
class SequenceView:
    """One view. ``depth_m`` (0: none), ``foreground`` and ``object_index`` stay on disk until they are read, and may be
    missing."""

    jpeg: tuple[UInt8[np.ndarray, " _"], ...]
    intrinsics_px: Float32[np.ndarray, "4"]
    camera_from_world: Float32[np.ndarray, "F 4 4"]
    visible: Bool[np.ndarray, "F P"]
    depth_m: Float32[np.ndarray, "F H W"] | None
    foreground: Bool[np.ndarray, "F H W"] | None
    object_index: UInt16[np.ndarray, "F H W"] | None = None

    def __repr__(self) -> str:
        files = [name for name in ("depth_m", "foreground", "object_index") if getattr(self, name) is not None]
        return f"SequenceView({', '.join([f'{len(self.jpeg)} frames', *files])})"

    def image(self, frame: int) -> UInt8[np.ndarray, "H W 3"]:
        """The decoded RGB image of a frame."""
        import cv2

        decoded = cv2.imdecode(self.jpeg[frame], cv2.IMREAD_COLOR)
        if decoded is None:
            raise SequenceFormatError(f"frame {frame} is not a JPEG image")
        return np.ascontiguousarray(decoded[:, :, ::-1], np.uint8)


@dataclass(frozen=True, repr=False)
class Sequence:
    """A sequence as on disk: tracks in world metres, queries (x, y, frame, view), one entry per view."""

    folder: Path
    tracks_m: Float32[np.ndarray, "F P 3"]
    queries_xytv: Float32[np.ndarray, "P 4"]
    views: tuple[SequenceView, ...]

    def __repr__(self) -> str:
        frames, tracks, _ = self.tracks_m.shape
        return f"Sequence('{self.folder}': {frames} frames, {len(self.views)} views, {tracks:,} tracks)"

    @cached_property
    def record(self) -> dict[str, Any] | None:
        """The content of ``sequence.json``, or None where a sequence has none."""
        path = self.folder / layout.RECORD
        if not path.exists():
            return None
        try:
            content = load_json(_inside(self.folder, layout.RECORD))
        except (OSError, ValueError) as error:
            raise SequenceFormatError(f"'{path}' is not valid JSON: {error}") from None
        if not isinstance(content, dict):
            raise SequenceFormatError(f"'{path}' must be a JSON object, not {type(content).__name__}")
        return content


def read_sequence(folder: Path) -> Sequence:
    """Reads a sequence. Depth and masks are memory-mapped; nothing in the files is run, and no file outside is read.

    Raises:
        SequenceFormatError: a file is missing, damaged, or not of the layout's type and shape.
    """
    require_sequence(folder)
    tracks_m = read_array(folder, layout.TRACKS, np.float32, (None, None, 3))
    frames, count, _ = tracks_m.shape
    queries = read_array(folder, layout.QUERIES, np.float32, (count, 4))
    names = view_names(folder)
    if not names:
        raise SequenceFormatError(f"'{folder}' has no view: folders 0, 1, 2, ... are required")
    return Sequence(folder, tracks_m, queries, tuple(read_view(folder, name, frames, count) for name in names))


def require_sequence(folder: Path) -> None:
    """Passes the folder of a sequence.

    Raises:
        SequenceFormatError: it is none; where some lie below it the message names one.
    """
    if not folder.is_dir():
        state = "is a file" if folder.exists() else "does not exist"
        raise SequenceFormatError(f"'{folder}' {state}; the folder of a sequence is required")
    if not (folder / layout.TRACKS).exists():
        below = sorted(folder.glob(f"*/{layout.TRACKS}")) + sorted(folder.glob(f"*/*/{layout.TRACKS}"))
        hint = f"; did you mean '{below[0].parent}'?" if below else ""
        raise SequenceFormatError(f"'{folder}' is not the folder of a sequence: it has no {layout.TRACKS}{hint}")


def view_names(folder: Path) -> list[str]:
    """Names of the view folders, in order.

    Raises:
        SequenceFormatError: the views are not numbered 0, 1, 2, ... without a gap.
    """
    found = sorted((path.name for path in folder.iterdir() if path.is_dir() and path.name.isdecimal()), key=int)
    wanted = [str(index) for index in range(len(found))]
    if found != wanted:
        raise SequenceFormatError(f"'{folder}' must have views 0, 1, 2, ... without a gap, not {', '.join(found)}")
    return found


def read_view(folder: Path, name: str, frames: int, count: int) -> SequenceView:
    """One view of a sequence of ``frames`` frames and ``count`` tracks.

    Raises:
        SequenceFormatError: a file is missing, damaged, or not of the layout's type and shape.
    """
    jpeg = read_byte_arrays(_inside(folder, f"{name}/{layout.IMAGES}"))
    if len(jpeg) != frames:
        raise SequenceFormatError(f"'{folder / name / layout.IMAGES}' has {len(jpeg)} frames; {frames} are required")
    picture = (frames, None, None)
    return SequenceView(
        jpeg,
        read_array(folder, f"{name}/{layout.INTRINSICS}", np.float32, (4,)),
        read_array(folder, f"{name}/{layout.EXTRINSICS}", np.float32, (frames, 4, 4)),
        read_array(folder, f"{name}/{layout.VISIBILITY}", np.bool_, (frames, count)),
        _optional(folder, f"{name}/{layout.DEPTH}", np.float32, picture),
        _optional(folder, f"{name}/{layout.FOREGROUND}", np.bool_, picture),
        _optional(folder, f"{name}/{layout.OBJECT_INDEX}", np.uint16, picture),
    )


def _optional(folder: Path, name: str, dtype: type[np.generic], shape: tuple[int | None, ...]) -> np.ndarray | None:
    return read_array(folder, name, dtype, shape, on_disk=True) if (folder / name).exists() else None


def read_array(
    folder: Path, name: str, dtype: type[np.generic], shape: tuple[int | None, ...], on_disk: bool = False
) -> np.ndarray:
    """An array of a sequence, checked; None in ``shape`` stands for any length.

    Raises:
        SequenceFormatError: the file is missing, damaged, outside the folder, or of another type or shape.
    """
    path = _inside(folder, name)
    try:
        array = open_npy(path)
    except FileNotFoundError:
        raise SequenceFormatError(f"'{path}' is missing: the sequence is not whole") from None
    except (OSError, ValueError) as error:
        raise SequenceFormatError(f"cannot read '{path}': {error}") from None
    fits = len(array.shape) == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if array.dtype != dtype or not fits:
        wanted = tuple("any" if length is None else length for length in shape)
        raise SequenceFormatError(f"'{path}' must be {np.dtype(dtype)} {wanted}, not {array.dtype} {array.shape}")
    return array if on_disk else np.array(array)


def _inside(folder: Path, name: str) -> Path:
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise SequenceFormatError(f"'{path}' lies outside '{folder}'; every file of a sequence must lie in its folder")
    return path
