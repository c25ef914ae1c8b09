"""Writer of the benchmark layout; ``perpetua.formats.layout`` lists its files."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from perpetua.actors.types import ActorMesh
from perpetua.cameras.types import CameraPath
from perpetua.files import file_sha256
from perpetua.formats import layout
from perpetua.geometry.transforms import invert_rigid
from perpetua.rendering.types import RenderedView
from perpetua.rooms.types import Room
from perpetua.tracks.motion import MOVING_M, is_fast, travel_m
from perpetua.tracks.surface import SceneMeshes, SurfacePoints, bind
from perpetua.tracks.types import PointTracks, SequenceTracks


def write_sequence(
    folder: Path,
    room: Room,
    actors: tuple[ActorMesh, ...],
    cameras: tuple[CameraPath, ...],
    views: tuple[RenderedView, ...],
    tracks: SequenceTracks,
    record: dict[str, Any],
) -> None:
    """Writes a sequence into ``folder``, which is made if need be; equal arguments give equal bytes.

    ``record`` says where the sequence comes from.
    """
    folder.mkdir(parents=True, exist_ok=True)
    _write_tracks(folder, tracks, SceneMeshes.of(room, actors))
    actor_indices = [actor.object_index for actor in actors]
    for index, (camera, view) in enumerate(zip(cameras, views, strict=True)):
        view_folder = folder / str(index)
        view_folder.mkdir(exist_ok=True)
        np.save(view_folder / layout.VISIBILITY, tracks.views.visible[index])
        _write_camera(view_folder, camera)
        _write_frames(view_folder, view, actor_indices)
    _write_record(folder, tracks.points, record)


def _write_tracks(folder: Path, tracks: SequenceTracks, meshes: SceneMeshes) -> None:
    points = tracks.points
    np.save(folder / layout.TRACKS, points.position_m.astype(np.float32))
    np.save(folder / layout.QUERIES, tracks.queries_xytv)
    bound = bind(meshes, SurfacePoints(points.object_index, points.face, points.barycentric))
    frames, count, _ = points.position_m.shape
    corners = (bound.corner_m(frame).astype(np.float32) for frame in range(frames))
    _save_frames(folder / layout.SURFACE, (frames, count, 3, 3), np.float32, corners)


def _write_camera(folder: Path, camera: CameraPath) -> None:
    inner = camera.intrinsics
    np.save(folder / layout.INTRINSICS, np.array([inner.fx_px, inner.fy_px, inner.cx_px, inner.cy_px], np.float32))
    np.save(folder / layout.EXTRINSICS, invert_rigid(camera.world_from_camera).astype(np.float32))


def _write_frames(folder: Path, view: RenderedView, actor_indices: list[int]) -> None:
    """Frame by frame: a view's depth may be larger than memory allows for."""
    jpegs = np.empty(len(view.jpeg), object)
    for frame, jpeg in enumerate(view.jpeg):
        jpegs[frame] = np.frombuffer(jpeg, np.uint8).copy()
    np.save(folder / layout.IMAGES, jpegs, allow_pickle=True)
    shape = view.depth_m.shape
    _save_frames(folder / layout.DEPTH, shape, np.float32, (np.asarray(depth_m) for depth_m in view.depth_m))
    masks = (np.isin(object_index, actor_indices) for object_index in view.object_index)
    _save_frames(folder / layout.FOREGROUND, shape, np.bool_, masks)


def _save_frames(path: Path, shape: tuple[int, ...], dtype: type[np.generic], frames: Iterator[np.ndarray]) -> None:
    """A ``.npy`` file of stacked frames that are never all in memory."""
    header = {"descr": np.lib.format.dtype_to_descr(np.dtype(dtype)), "fortran_order": False, "shape": shape}
    with path.open("wb") as handle:
        np.lib.format.write_array_header_1_0(handle, header)
        for frame in frames:
            handle.write(np.ascontiguousarray(frame, dtype).tobytes())


def _write_record(folder: Path, points: PointTracks, record: dict[str, Any]) -> None:
    category = {thing["object_index"]: thing["category"] for thing in record.get("objects", [])}
    merged = {
        **record,
        "tracks": {
            "object_index": points.object_index.tolist(),
            "category": [category.get(index) for index in points.object_index.tolist()],
            "class": _classes(points.position_m),
            "face": points.face.tolist(),
            "barycentric": points.barycentric.tolist(),
        },
        "files": {
            path.relative_to(folder).as_posix(): file_sha256(path)
            for path in sorted(folder.rglob("*"))
            if path.is_file() and path.name != layout.RECORD
        },
    }
    (folder / layout.RECORD).write_text(json.dumps(merged, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _classes(position_m: Float64[np.ndarray, "T N 3"]) -> list[str]:
    """ "static" never moves; "dynamic" moves more than 5 cm, "fast" more than 2 m within 24 frames; else "slow"."""
    reach_m = travel_m(position_m)
    names = np.select(
        [is_fast(position_m, reach_m), reach_m > MOVING_M, reach_m > 0.0], ["fast", "dynamic", "slow"], "static"
    )
    return [str(name) for name in names]
