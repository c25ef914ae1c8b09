"""Finished frames on disk: which are sound, and their pixels as arrays."""

import hashlib
import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenEXR
from jaxtyping import Float32, UInt16

from perpetua.errors import RenderError
from perpetua.scene.camera import CameraPath
from perpetua.scene.scene import RenderedView

# Depth at and beyond this is no surface (Blender writes 1e10 for the background).
BACKGROUND_DEPTH_M = 1e9


class DamagedFrameError(RenderError):
    """A frame that is as the worker left it, and still no picture of the job."""


@dataclass(frozen=True)
class GroundTruth:
    """One frame of one view; depth is 0 and index is 0 where there is no object."""

    depth_m: Float32[np.ndarray, "H W"]
    object_index: UInt16[np.ndarray, "H W"]


def frame_folder(frames: Path, frame: int) -> Path:
    """Where a finished frame lies."""
    return frames / f"{frame:06d}"


def is_sound(folder: Path, cameras: tuple[CameraPath, ...]) -> bool:
    """Whether a frame's folder holds every view's two files, each with the size and SHA-256 it was written with."""
    try:
        files = json.loads((folder / "frame.json").read_text(encoding="utf-8"))["files"]
        wanted = {name for camera in cameras for name in (_jpeg_name(camera), _exr_name(camera))}
        return set(files) == wanted and all(_matches(folder / name, files[name]) for name in sorted(wanted))
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _matches(path: Path, expected: dict[str, object]) -> bool:
    if path.stat().st_size != expected["bytes"]:
        return False
    return hashlib.sha256(path.read_bytes()).hexdigest() == expected["sha256"]


def drop_damaged(frames: Path, cameras: tuple[CameraPath, ...], count: int) -> list[int]:
    """The frames that are still to be rendered; the folders of damaged ones are removed."""
    pending = []
    for frame in range(count):
        folder = frame_folder(frames, frame)
        if not is_sound(folder, cameras):
            shutil.rmtree(folder, ignore_errors=True)
            pending.append(frame)
    return pending


def read_ground_truth(path: Path) -> GroundTruth:
    """Depth and object index of one image, from the EXR that the render worker wrote.

    Raises:
        DamagedFrameError: the file is no such EXR.
    """
    try:
        with OpenEXR.File(str(path)) as file:
            channels = file.channels()
            raw_depth_m = np.asarray(channels["depth.V"].pixels)
            raw_index = np.asarray(channels["index.V"].pixels)
    except (RuntimeError, OSError, KeyError, ValueError) as error:
        raise DamagedFrameError(f"'{path}' must be an EXR with channels depth.V and index.V: {error}") from None
    seen = (raw_index > 0.5) & (raw_depth_m < BACKGROUND_DEPTH_M)
    return GroundTruth(
        np.where(seen, raw_depth_m, 0.0).astype(np.float32), np.where(seen, np.rint(raw_index), 0).astype(np.uint16)
    )


def assemble_view(frames: Path, camera: CameraPath, count: int, folder: Path) -> RenderedView:
    """One view's frames as arrays that stay on disk, in ``folder``, and are mapped read-only.

    Raises:
        DamagedFrameError: a frame is not what a worker writes; it was removed, so that it is rendered again.
    """
    height, width = camera.intrinsics.height_px, camera.intrinsics.width_px
    shape = (count, height, width)
    depth_path = folder / f"depth_m_{camera.camera:02d}.npy"
    index_path = folder / f"object_index_{camera.camera:02d}.npy"
    depth_m = np.lib.format.open_memmap(depth_path, mode="w+", dtype=np.float32, shape=shape)
    object_index = np.lib.format.open_memmap(index_path, mode="w+", dtype=np.uint16, shape=shape)
    jpeg = []
    for frame in range(count):
        source = frame_folder(frames, frame)
        try:
            truth = _ground_truth_of(source, camera)
        except DamagedFrameError:
            shutil.rmtree(source, ignore_errors=True)
            raise
        depth_m[frame], object_index[frame] = truth.depth_m, truth.object_index
        jpeg.append((source / _jpeg_name(camera)).read_bytes())
    depth_m.flush()
    object_index.flush()
    return RenderedView(
        camera.camera, tuple(jpeg), np.load(depth_path, mmap_mode="r"), np.load(index_path, mmap_mode="r")
    )


def _ground_truth_of(source: Path, camera: CameraPath) -> GroundTruth:
    path = source / _exr_name(camera)
    truth = read_ground_truth(path)
    wanted, found = (camera.intrinsics.height_px, camera.intrinsics.width_px), truth.depth_m.shape
    if found != wanted:
        raise DamagedFrameError(f"'{path}' must be {wanted[1]}x{wanted[0]} px, not {found[1]}x{found[0]}")
    return truth


def _jpeg_name(camera: CameraPath) -> str:
    return f"view_{camera.camera:02d}.jpg"


def _exr_name(camera: CameraPath) -> str:
    return f"view_{camera.camera:02d}.exr"
