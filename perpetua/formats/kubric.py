"""Exporter of the multi-view Kubric layout, as MVTracker's loader of it reads one scene.

::

    <number>/                             the loader sorts scenes by number: see ``scene_number``
        tracks_3d.npz                     tracks_3d (F,P,3) float64   world positions, metres
        tracks_segmentation_ids.npz       tracks_segmentation_ids (P,) int64
        tracked_objects.json              {"names": [...], "ids": [...]} of the objects with tracks
        cameras.npz                       camera_positions, lookat_positions (V,3) float64, at the first frame
        view_<i>/
            rgba_00000.png                (H,W,4) uint8, opaque
            depth_00000.tiff              (H,W) float32    distance to the camera centre, metres; 0 = none
            segmentation_00000.png        (H,W) uint16     as tracks_segmentation_ids
            tracks_2d.npz                 tracks_2d (F,P,2) float64 pixels, also off the image and behind the camera;
                                          occlusion (F,P) bool, the inverse of visibility
            metadata.json                 camera: K (3,3), positions (F,3), quaternions (F,4), focal_length,
                                          sensor_width, field_of_view; metadata: resolution (width, height), ...
            object_id_to_segmentation_id.json

Conventions, from the loader and the generator of that data set: cameras have OpenGL axes (X right, Y up, Z backward);
``positions`` and ``quaternions`` (w, x, y, z) take camera to world; K is normalised, so that
``diag(W, H, 1) @ K @ diag(1, -1, -1)`` is the OpenCV matrix. Pixel (0, 0) is the corner of the top-left pixel, half a
pixel more than ours. The loader turns distance into Z with the principal point at the image centre and square
pixels, so other cameras are refused.

Segmentation ids are our object indices where the rendered object index is still in the work area. A published sequence
alone has a mask of the people: then 1 stands for people and 0 for all else, in the images and the ids of tracks alike.
"""

import math
import re
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float64, Int64, UInt16
from PIL import Image
from scipy.spatial.transform import Rotation

from perpetua.errors import InputError, SequenceFormatError
from perpetua.formats.source import HALF_PIXEL_PX, ExportSource, image_size_px
from perpetua.geometry.transforms import invert_rigid
from perpetua.io.files import write_json

SENSOR_WIDTH_MM = 36.0
OPENCV_FROM_OPENGL = np.diag([1.0, -1.0, -1.0])
# Largest deviation from the loader's camera: a tenth of that which changes a distance by 0.01%.
_CENTRE_PX = 1e-3
_SQUARE = 1e-5


class Kubric:
    """One scene folder; equal sequences give equal bytes."""

    def write(self, source: ExportSource, folder: Path) -> None:
        """Writes the scene ``<number>`` into ``folder``.

        Raises:
            InputError: the sequence's name holds no number.
            SequenceFormatError: there is no depth, or a camera does not fit the loader's assumptions.
        """
        scene = folder / scene_number(source.name)
        scene.mkdir(parents=True)
        names, ids = _segmentation_table(source)
        track_id = _track_ids(source)
        used = sorted(set(track_id.tolist()))
        tracked = {"names": [names.get(index, "background") for index in used], "ids": used}
        np.savez(scene / "tracks_3d.npz", tracks_3d=source.sequence.tracks_m.astype(np.float64))
        np.savez(scene / "tracks_segmentation_ids.npz", tracks_segmentation_ids=track_id)
        write_json(scene / "tracked_objects.json", tracked)
        poses = [_world_from_camera(source, view)[0] for view in range(len(source.sequence.views))]
        position_m = np.array([pose[:3, 3] for pose in poses])
        look_m = np.array([pose[:3, 3] + pose[:3, 2] for pose in poses])
        np.savez(scene / "cameras.npz", camera_positions=position_m, lookat_positions=look_m)
        for view in range(len(source.sequence.views)):
            _write_view(source, view, scene / f"view_{view}", ids)


def scene_number(name: str) -> str:
    """The digits of a sequence's name: the loader takes scenes whose names are whole numbers.

    Raises:
        InputError: there is no digit in the name.
    """
    digits = "".join(re.findall(r"[0-9]+", name))
    if not digits:
        raise InputError(
            f"the sequence '{name}' cannot be a Kubric scene: scenes are numbered, and a name needs digits, for "
            "example 'seed7-room0003': rename its folder"
        )
    return digits


def _segmentation_table(source: ExportSource) -> tuple[dict[int, str], dict[str, int]]:
    """Name of each segmentation id, and segmentation id of each object's name."""
    if source.object_index is None:
        ids = {name: int(index in source.people) for index, name in source.object_name.items()}
        return {1: "people"}, ids
    return source.object_name, {name: index for index, name in source.object_name.items()}


def _track_ids(source: ExportSource) -> Int64[np.ndarray, " P"]:
    if source.object_index is None:
        return np.isin(source.track_object, sorted(source.people)).astype(np.int64)
    return source.track_object


def _write_view(source: ExportSource, index: int, folder: Path, ids: dict[str, int]) -> None:
    folder.mkdir()
    view = source.sequence.views[index]
    size_px = image_size_px(view)
    camera = view.intrinsics_px.astype(np.float64)
    _require_loader_camera(source, index, camera, size_px)
    stretch = _ray_length_per_depth(camera, size_px)
    for frame in range(len(view.jpeg)):
        _write_rgba(folder / f"rgba_{frame:05d}.png", view.image(frame))
        distance_m = (source.depth_m(index, frame) * stretch).astype(np.float32)
        Image.fromarray(distance_m).save(folder / f"depth_{frame:05d}.tiff")
        segmentation = _segmentation(source, index, frame)
        if segmentation is not None:
            cv2.imwrite(str(folder / f"segmentation_{frame:05d}.png"), segmentation)
    world_from_camera = _world_from_camera(source, index)
    np.savez(
        folder / "tracks_2d.npz",
        tracks_2d=_pixels(source, world_from_camera, camera),
        occlusion=~view.visible,
    )
    write_json(folder / "metadata.json", _metadata(source, camera, size_px, world_from_camera))
    write_json(folder / "object_id_to_segmentation_id.json", ids)


def _require_loader_camera(
    source: ExportSource, view: int, camera: Float64[np.ndarray, "4"], size_px: tuple[int, int]
) -> None:
    fx_px, fy_px, cx_px, cy_px = camera
    off_px = max(abs(cx_px - 0.5 * (size_px[0] - 1)), abs(cy_px - 0.5 * (size_px[1] - 1)))
    if off_px > _CENTRE_PX or abs(fx_px / fy_px - 1.0) > _SQUARE:
        raise SequenceFormatError(
            f"view {view} of '{source.sequence.folder}' has its principal point {off_px:.3f} px off the image's centre "
            f"and fx / fy = {fx_px / fy_px:.6f}; the Kubric loader needs 0 and 1 to read depth right: choose another "
            "--format"
        )


def _ray_length_per_depth(camera: Float64[np.ndarray, "4"], size_px: tuple[int, int]) -> Float64[np.ndarray, "H W"]:
    """Distance to the camera centre over depth along Z, at pixel centres."""
    fx_px, fy_px, cx_px, cy_px = camera
    x = (np.arange(size_px[0]) - cx_px) / fx_px
    y = (np.arange(size_px[1]) - cy_px) / fy_px
    return np.sqrt(1.0 + x[None, :] ** 2 + y[:, None] ** 2)


def _write_rgba(path: Path, rgb: np.ndarray) -> None:
    opaque = np.full((*rgb.shape[:2], 1), 255, np.uint8)
    cv2.imwrite(str(path), np.concatenate([rgb[:, :, ::-1], opaque], axis=2))


def _segmentation(source: ExportSource, view: int, frame: int) -> UInt16[np.ndarray, "H W"] | None:
    """None where the sequence has neither object index nor mask; the loader does not require it."""
    if source.object_index is not None:
        return np.asarray(source.object_index[view][frame])
    foreground = source.sequence.views[view].foreground
    return None if foreground is None else foreground[frame].astype(np.uint16)


def _world_from_camera(source: ExportSource, view: int) -> Float64[np.ndarray, "F 4 4"]:
    """Poses with OpenCV axes, made orthonormal to double precision, so that quaternions represent them exactly."""
    poses = source.sequence.views[view].camera_from_world.astype(np.float64)
    poses[:, :3, :3] = Rotation.from_matrix(poses[:, :3, :3]).as_matrix()
    return invert_rigid(poses)


def _pixels(
    source: ExportSource, world_from_camera: Float64[np.ndarray, "F 4 4"], camera: Float64[np.ndarray, "4"]
) -> Float64[np.ndarray, "F P 2"]:
    """The loader projects a point wherever it is, so points behind the camera have their mirrored pixels here."""
    camera_from_world = invert_rigid(world_from_camera)
    point_m = source.sequence.tracks_m.astype(np.float64)
    camera_m = np.einsum("fij,fpj->fpi", camera_from_world[:, :3, :3], point_m) + camera_from_world[:, None, :3, 3]
    return camera_m[..., :2] / camera_m[..., 2:] * camera[:2] + camera[2:] + HALF_PIXEL_PX


def _metadata(
    source: ExportSource,
    camera: Float64[np.ndarray, "4"],
    size_px: tuple[int, int],
    world_from_camera: Float64[np.ndarray, "F 4 4"],
) -> dict[str, Any]:
    width_px, height_px = size_px
    fx_px, fy_px, cx_px, cy_px = camera
    focal_mm = fx_px / width_px * SENSOR_WIDTH_MM
    matrix = np.array(
        [
            [fx_px / width_px, 0.0, -(cx_px + HALF_PIXEL_PX) / width_px],
            [0.0, -fy_px / height_px, -(cy_px + HALF_PIXEL_PX) / height_px],
            [0.0, 0.0, -1.0],
        ]
    )
    rotation = Rotation.from_matrix(world_from_camera[:, :3, :3] @ OPENCV_FROM_OPENGL)
    x, y, z, w = rotation.as_quat().T
    return {
        "camera": {
            "K": matrix.tolist(),
            "positions": world_from_camera[:, :3, 3].tolist(),
            "quaternions": np.stack([w, x, y, z], axis=1).tolist(),
            "focal_length": float(focal_mm),
            "sensor_width": SENSOR_WIDTH_MM,
            "field_of_view": 2.0 * math.atan(0.5 * SENSOR_WIDTH_MM / focal_mm),
        },
        "metadata": {
            "resolution": [width_px, height_px],
            "num_frames": len(world_from_camera),
            "frame_rate": source.fps,
            "sequence": source.name,
            "segmentation": "people" if source.object_index is None else "objects",
        },
    }
