"""Checks of what single files hold: finite values, images, cameras, hashes."""

import hashlib
from pathlib import PurePosixPath

import numpy as np
from jaxtyping import Float

from perpetua.audit.config import AuditConfig
from perpetua.audit.files import RECORD_FILE, SequenceFiles
from perpetua.audit.report import Check


def check_finite(files: SequenceFiles, bounds: AuditConfig) -> Check:
    """No NaN, no infinity; depth within an indoor scene, 0 where there is none. Pixels of tracks have a check of their
    own, because a point behind the camera has none."""
    faults: list[str] = []
    for name, array in sorted(files.arrays.items()):
        if array.dtype != np.float32 or name.endswith("tracks_xy.npy"):
            continue
        is_depth = name.endswith("depth.npy")
        for frame, values in enumerate(array if array.ndim > 2 else array[None]):
            bad = ~np.isfinite(values)
            if is_depth:
                bad |= (values < 0.0) | (values > bounds.max_depth_m)
            if bad.any():
                place = [int(index) for index in np.argwhere(bad)[0]]
                index = [frame, *place] if array.ndim > 2 else place
                faults.append(f"{name}{index} is {values[tuple(place)]}")
                break
    bound = f"all finite, depth in [0, {bounds.max_depth_m:g}] m"
    return Check("values", not faults, float(len(faults)), bound, "; ".join(faults[:5]))


def check_images(files: SequenceFiles) -> Check:
    """Every JPEG decodes to RGB of the size of the view's depth and mask."""
    import cv2

    faults: list[str] = []
    for view, jpegs in files.jpegs.items():
        shapes = {
            files.arrays[name].shape[1:]
            for name in (f"{view}/depth.npy", f"{view}/foreground_mask.npy")
            if name in files.arrays
        }
        for frame, jpeg in enumerate(jpegs):
            image = cv2.imdecode(jpeg, cv2.IMREAD_UNCHANGED) if len(jpeg) else None
            if bytes(jpeg[:2]) != b"\xff\xd8" or bytes(jpeg[-2:]) != b"\xff\xd9" or image is None:
                faults.append(f"{view}/images_jpeg_bytes.npy[{frame}] is not a whole JPEG image")
                break
            if image.ndim != 3 or image.shape[2] != 3:
                faults.append(f"{view}/images_jpeg_bytes.npy[{frame}] must be RGB, and has shape {image.shape}")
                break
            shapes.add(image.shape[:2])
            if len(shapes) > 1:
                sizes = " and ".join(f"{height}x{width}" for height, width in sorted(shapes))
                faults.append(f"{view}: image {frame}, depth and foreground must have one size, and have {sizes}")
                break
    return Check("images", not faults, float(len(faults)), "RGB JPEGs of the size of depth", "; ".join(faults[:5]))


def check_cameras(files: SequenceFiles, bounds: AuditConfig) -> Check:
    """Focal lengths are positive, the principal point is on the image, extrinsics are rigid world-to-camera."""
    faults: list[str] = []
    worst = 0.0
    for view in files.views:
        intrinsics = files.arrays.get(f"{view}/intrinsics.npy")
        depth = files.arrays.get(f"{view}/depth.npy")
        if intrinsics is not None and depth is not None:
            fx, fy, cx, cy = intrinsics.tolist()
            height, width = depth.shape[1:]
            if not (fx > 0 and fy > 0 and 0 <= cx <= width - 1 and 0 <= cy <= height - 1):
                faults.append(f"{view}/intrinsics.npy is {intrinsics.tolist()} for an image of {width}x{height}")
        extrinsics = files.arrays.get(f"{view}/extrinsics_w2c.npy")
        if extrinsics is not None:
            error = rigid_error(np.asarray(extrinsics, np.float64))
            frame = int(error.argmax())
            worst = max(worst, float(error[frame]))
            if not error[frame] <= bounds.rotation_error:
                faults.append(f"{view}/extrinsics_w2c.npy[{frame}] is off a rigid transform by {error[frame]:.3g}")
    bound = f"rigid within {bounds.rotation_error:g}"
    return Check("cameras", not faults, worst, bound, "; ".join(faults[:5]))


def rigid_error(pose: Float[np.ndarray, "F 4 4"]) -> Float[np.ndarray, " F"]:
    """Largest deviation from a rotation of determinant 1 over the bottom row 0 0 0 1; infinite for NaN."""
    rotation = pose[:, :3, :3]
    error = np.abs(rotation @ rotation.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    handedness = (np.cross(rotation[:, 0], rotation[:, 1]) * rotation[:, 2]).sum(axis=1)
    error = np.maximum(error, np.abs(handedness - 1.0))
    error = np.maximum(error, np.abs(pose[:, 3] - [0.0, 0.0, 0.0, 1.0]).max(axis=1))
    return np.asarray(np.where(np.isfinite(error), error, np.inf))


def check_hashes(files: SequenceFiles) -> Check:
    """Every file that the record lists lies in the folder and has the recorded sha256; every array is listed."""
    listed = files.record.get("files") if files.record is not None else None
    faults: list[str] = []
    if not isinstance(listed, dict):
        return Check("sha256", False, 1.0, "every file as recorded", f"{RECORD_FILE} must list 'files'")
    for name, digest in sorted(listed.items()):
        parts = PurePosixPath(name)
        path = files.folder / parts
        if parts.is_absolute() or ".." in parts.parts or not path.resolve().is_relative_to(files.folder.resolve()):
            faults.append(f"{RECORD_FILE} names '{name}', which leads out of the folder")
        elif not path.is_file():
            faults.append(f"{name} is recorded, and missing")
        else:
            with path.open("rb") as handle:
                if hashlib.file_digest(handle, "sha256").hexdigest() != digest:
                    faults.append(f"{name} does not have the recorded sha256")
    faults += [f"{name} is not recorded" for name in sorted(files.arrays) if name not in listed]
    return Check("sha256", not faults, float(len(faults)), "every file as recorded", "; ".join(faults[:5]))
