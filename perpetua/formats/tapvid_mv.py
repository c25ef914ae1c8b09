"""Writer of the benchmark layout; ``perpetua.formats.layout`` lists its files."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from perpetua.formats import layout
from perpetua.formats.frame_file import FrameFile
from perpetua.formats.label_files import write_labels
from perpetua.formats.poses import object_poses
from perpetua.geometry.transforms import invert_rigid
from perpetua.io.files import file_sha256
from perpetua.scene.camera import CameraPath
from perpetua.scene.scene import RenderedView, Scene
from perpetua.tracks.motion import MOVING_M, is_fast, travel_m
from perpetua.tracks.surface import SceneMeshes, SurfacePoints, bind
from perpetua.tracks.types import PointTracks, SequenceTracks


def write_sequence(
    folder: Path,
    scene: Scene,
    tracks: SequenceTracks,
    record: dict[str, Any],
    outputs: tuple[str, ...] = (),
) -> None:
    """Writes a sequence into ``folder``, which is made if need be; equal arguments give equal bytes.

    Args:
        folder: where the files go.
        scene: what was rendered.
        tracks: of its points.
        record: says where the sequence comes from, and lists the objects: those of the room in its order, then actors.
        outputs: labels of every pixel to write too, some of ``perpetua.formats.config.OUTPUTS``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    _write_tracks(folder, tracks, SceneMeshes.of(scene))
    actor_indices = [actor.object_index for actor in scene.actors]
    for index, (camera, view) in enumerate(zip(scene.cameras, scene.views, strict=True)):
        view_folder = folder / str(index)
        view_folder.mkdir(exist_ok=True)
        np.save(view_folder / layout.VISIBILITY, tracks.views.visible[index])
        np.save(view_folder / layout.TRACKS_2D, tracks.views.pixel_px[index].astype(np.float32))
        _write_camera(view_folder, camera)
        _write_frames(view_folder, view, actor_indices)
    poses = object_poses(scene)
    np.save(folder / layout.POSES, poses.world_from_object)
    np.save(folder / layout.BOXES, poses.box_m)
    if outputs:
        record = {**record, "labels": {"outputs": sorted(outputs), **asdict(write_labels(folder, scene, outputs))}}
    _write_record(folder, tracks.points, record)


def _write_tracks(folder: Path, tracks: SequenceTracks, meshes: SceneMeshes) -> None:
    points = tracks.points
    np.save(folder / layout.TRACKS, points.position_m.astype(np.float32))
    np.save(folder / layout.QUERIES, tracks.queries_xytv)
    bound = bind(meshes, SurfacePoints(points.object_index, points.face, points.barycentric))
    frames, count, _ = points.position_m.shape
    with FrameFile(folder / layout.SURFACE, (frames, count, 3, 3), np.float32) as file:
        for frame in range(frames):
            file.append(bound.corner_m(frame))


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
    with (
        FrameFile(folder / layout.DEPTH, view.depth_m.shape, np.float32) as depth,
        FrameFile(folder / layout.FOREGROUND, view.depth_m.shape, np.bool_) as foreground,
    ):
        for depth_m, object_index in zip(view.depth_m, view.object_index, strict=True):
            depth.append(np.asarray(depth_m))
            foreground.append(np.isin(object_index, actor_indices))


def _write_record(folder: Path, points: PointTracks, record: dict[str, Any]) -> None:
    objects = {obj["object_index"]: obj for obj in record.get("objects", [])}
    owners = [objects.get(index, {}) for index in points.object_index.tolist()]
    merged = {
        **record,
        "tracks": {
            "object_index": points.object_index.tolist(),
            "category": [owner.get("category") for owner in owners],
            "actor": [owner.get("actor") for owner in owners],
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
