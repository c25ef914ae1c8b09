"""Predicted tracks, and the ``.npz`` file that holds them.

For a sequence of C views, F frames and P tracks a file holds some of these arrays. K is P, or the length of
``track_index`` where only some tracks were predicted; what is not predicted counts as a failure, and so does a position
that is NaN or infinite.

==========================  =============  ==============  ==========================================================
``tracks_xyz_camera``       (C, F, K, 3)   float           points in the axes of each view's camera at each frame
                                                           (X right, Y down, Z forward)
``tracks_xyz_world``        (F, K, 3)      float           points in the axes of the first view's camera at the first
                                                           frame
``visibility``              (C, F, K) or   bool            whether each view shows the point, or (without views) whether
                            (F, K)                         any does; ``tracks_xyz_camera`` needs the first form
``track_index``             (K,)           integer         which tracks of the sequence these are; optional
``geometry_pixels_xytv``    (G, 4)         integer         pixels x, y of frame t and view v (as queries, whole numbers)
                                                           whose surface was reconstructed; optional
``geometry_xyz_world``      (G, 3)         float           where these surfaces are, in the frame of
                                                           ``tracks_xyz_world``
==========================  =============  ==============  ==========================================================

``visibility`` and at least one of the two ``tracks_xyz`` are required. Units are free: scores allow for scale. With
geometry the world tracks are also scored after the similarity transform that brings it onto the true surfaces.
Nothing in a file is ever run: no array may need pickle, and types and sizes are checked before anything is read.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int64

from perpetua.errors import InputError
from perpetua.io.npz import ArchiveError, open_npz

CAMERA, WORLD, VISIBILITY, INDEX = "tracks_xyz_camera", "tracks_xyz_world", "visibility", "track_index"
GEOMETRY_PIXELS, GEOMETRY = "geometry_pixels_xytv", "geometry_xyz_world"
KINDS = {CAMERA: "f", WORLD: "f", VISIBILITY: "b", INDEX: "iu", GEOMETRY_PIXELS: "iu", GEOMETRY: "f"}
KIND_NAMES = {"f": "floating point", "b": "bool", "iu": "integer"}
MOST_GEOMETRY = 5_000_000
EXAMPLE = "`perpetua evaluate --help` describes the file"


@dataclass(frozen=True)
class SequenceSize:
    """How many views, frames and tracks a sequence has."""

    views: int
    frames: int
    tracks: int


@dataclass(frozen=True)
class Geometry:
    """Surfaces reconstructed at pixels (x, y, frame, view), in the frame of the world tracks."""

    pixels_xytv: Int64[np.ndarray, "G 4"]
    point: Float[np.ndarray, "G 3"]


@dataclass(frozen=True)
class Predictions:
    """Predicted tracks of a sequence, all P of them; NaN where one is missing.

    ``camera`` is in each camera's axes, ``world`` in those of the first camera at the first frame; each may be None.
    ``visible`` is None where only ``visible_anywhere`` was predicted.
    """

    camera: Float[np.ndarray, "C F P 3"] | None
    world: Float[np.ndarray, "F P 3"] | None
    visible: Bool[np.ndarray, "C F P"] | None
    visible_anywhere: Bool[np.ndarray, "F P"]
    geometry: Geometry | None


def write_predictions(path: Path, predictions: Predictions) -> None:
    """Writes the file that ``read_predictions`` reads."""
    seen = predictions.visible_anywhere if predictions.visible is None else predictions.visible
    arrays: dict[str, Any] = {CAMERA: predictions.camera, WORLD: predictions.world, VISIBILITY: seen}
    if predictions.geometry is not None:
        arrays |= {GEOMETRY_PIXELS: predictions.geometry.pixels_xytv, GEOMETRY: predictions.geometry.point}
    np.savez_compressed(path, **{name: array for name, array in arrays.items() if array is not None})


def read_predictions(path: Path, size: SequenceSize) -> Predictions:
    """Reads and checks predictions for a sequence of a given size.

    Raises:
        InputError: the file is missing, damaged, needs pickle, or an array is not of the type and size above.
    """
    arrays = _read_arrays(path, size)
    if VISIBILITY not in arrays or not {CAMERA, WORLD} & set(arrays):
        raise InputError(
            f"'{path}' must hold '{VISIBILITY}' and at least one of '{CAMERA}' and '{WORLD}', and holds "
            f"{', '.join(sorted(arrays)) or 'nothing'}: {EXAMPLE}"
        )
    index = _track_index(path, arrays, size)
    seen = _spread(arrays[VISIBILITY], index, size, False)
    if CAMERA in arrays and seen.ndim == 2:
        raise InputError(f"'{path}': '{CAMERA}' needs '{VISIBILITY}' for each view, (C, F, K), not {seen.shape}")
    return Predictions(
        camera=_spread(arrays[CAMERA], index, size, np.nan) if CAMERA in arrays else None,
        world=_spread(arrays[WORLD], index, size, np.nan) if WORLD in arrays else None,
        visible=seen if seen.ndim == 3 else None,
        visible_anywhere=seen.any(axis=0) if seen.ndim == 3 else seen,
        geometry=_geometry(path, arrays),
    )


def _read_arrays(path: Path, size: SequenceSize) -> dict[str, np.ndarray]:
    try:
        with open_npz(path, _most_bytes(size)) as file:
            if len(set(file.names)) < len(file.names) or not set(file.names) <= set(KINDS):
                known = ", ".join(KINDS)
                raise InputError(f"'{path}' may hold {known}, each once, and holds {', '.join(file.names)}: {EXAMPLE}")
            headers = {name: file.header(name) for name in file.names}
            for name, header in headers.items():
                if header.dtype.kind not in KINDS[name] or header.dtype.itemsize > 8:
                    kind = KIND_NAMES[KINDS[name]]
                    raise InputError(f"'{path}': '{name}' must be {kind} of at most 64 bits, not {header.dtype}")
            _check_shapes(path, {name: header.shape for name, header in headers.items()}, size)
            return {name: file.read(name) for name in file.names}
    except ArchiveError as error:
        raise InputError(f"cannot read predictions from '{path}': {error}: {EXAMPLE}") from None


def _most_bytes(size: SequenceSize) -> int:
    """What the largest array may hold: positions in every view, or geometry, with a header."""
    return 2**16 + 8 * max(3 * size.views * size.frames * size.tracks, 4 * MOST_GEOMETRY)


def _check_shapes(path: Path, shapes: dict[str, tuple[int, ...]], size: SequenceSize) -> None:
    count = size.tracks
    if INDEX in shapes:
        count = shapes[INDEX][0] if len(shapes[INDEX]) == 1 else -1
        if not 0 <= count <= size.tracks:
            raise InputError(f"'{path}': '{INDEX}' must name at most {size.tracks} tracks, (K,), not {shapes[INDEX]}")
    allowed: dict[str, list[tuple[int, ...]]] = {
        CAMERA: [(size.views, size.frames, count, 3)],
        WORLD: [(size.frames, count, 3)],
        VISIBILITY: [(size.views, size.frames, count), (size.frames, count)],
        INDEX: [(count,)],
    }
    for name, wanted in allowed.items():
        if name in shapes and shapes[name] not in wanted:
            shown = " or ".join(str(shape) for shape in wanted)
            raise InputError(f"'{path}': '{name}' must have shape {shown} for this sequence, not {shapes[name]}")
    if (GEOMETRY in shapes) != (GEOMETRY_PIXELS in shapes):
        raise InputError(f"'{path}' must hold both '{GEOMETRY}' and '{GEOMETRY_PIXELS}', or neither")
    if GEOMETRY in shapes:
        points = shapes[GEOMETRY][0] if shapes[GEOMETRY] else 0
        if shapes[GEOMETRY] != (points, 3) or shapes[GEOMETRY_PIXELS] != (points, 4) or points > MOST_GEOMETRY:
            raise InputError(
                f"'{path}': '{GEOMETRY}' must be (G, 3) and '{GEOMETRY_PIXELS}' (G, 4) with G at most {MOST_GEOMETRY}, "
                f"not {shapes[GEOMETRY]} and {shapes[GEOMETRY_PIXELS]}"
            )


def _track_index(path: Path, arrays: dict[str, np.ndarray], size: SequenceSize) -> Int64[np.ndarray, " K"] | None:
    if INDEX not in arrays:
        return None
    given = arrays[INDEX]
    if len(given) and (int(given.min()) < 0 or int(given.max()) >= size.tracks):
        raise InputError(f"'{path}': '{INDEX}' must lie in 0..{size.tracks - 1}, not {given.min()}..{given.max()}")
    if len(np.unique(given)) < len(given):
        raise InputError(f"'{path}': '{INDEX}' must name each track at most once")
    return given.astype(np.int64)


def _spread(values: np.ndarray, index: np.ndarray | None, size: SequenceSize, missing: float | bool) -> np.ndarray:
    """Values of some tracks among all tracks; the track axis is the last of bools and the last but one of points."""
    if index is None:
        return values
    axis = values.ndim - (1 if values.dtype == np.bool_ else 2)
    shape = list(values.shape)
    shape[axis] = size.tracks
    everything = np.full(shape, missing, values.dtype)
    np.moveaxis(everything, axis, 0)[index] = np.moveaxis(values, axis, 0)
    return everything


def _geometry(path: Path, arrays: dict[str, np.ndarray]) -> Geometry | None:
    if GEOMETRY not in arrays:
        return None
    if WORLD not in arrays:
        raise InputError(f"'{path}': '{GEOMETRY}' is in the frame of '{WORLD}', which is missing")
    return Geometry(arrays[GEOMETRY_PIXELS].astype(np.int64), arrays[GEOMETRY])
