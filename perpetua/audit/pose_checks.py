"""Checks of the tracks' stored pixels, and of objects' stored poses and boxes."""

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.audit.array_checks import rigid_error
from perpetua.audit.config import AuditConfig
from perpetua.audit.files import RECORD_FILE, SequenceFiles
from perpetua.audit.geometry import project_to_pixels
from perpetua.audit.report import Check

# Rounding error of a position in a room in single precision, metres: it matters for points close to a camera.
PLACE_M = 2e-6


def check_track_pixels(files: SequenceFiles, bounds: AuditConfig) -> Check:
    """``tracks_xy.npy`` holds the projections of the tracks, and NaN exactly for points behind the camera."""
    tracks = files.arrays["tracks_xyz.npy"]
    worst, detail = 0.0, ""
    for view in files.views:
        intrinsics = files.arrays[f"{view}/intrinsics.npy"]
        for frame, given in enumerate(files.arrays[f"{view}/tracks_xy.npy"]):
            seen = project_to_pixels(intrinsics, files.arrays[f"{view}/extrinsics_w2c.npy"][frame], tracks[frame])
            ahead = seen[:, 2] > 0
            error_px = np.linalg.norm(given.astype(np.float64) - seen[:, :2], axis=1)
            allowed_px = bounds.reprojection_px + _unsure_px(intrinsics.astype(np.float64), seen)
            bad = np.where(ahead, ~(error_px <= allowed_px), ~np.isnan(given).all(axis=1))
            sure = ahead & (allowed_px < 2.0 * bounds.reprojection_px)
            worst = max(worst, float(np.nan_to_num(error_px[sure], nan=np.inf).max(initial=0.0)))
            if bad.any() and not detail:
                track = int(np.flatnonzero(bad)[0])
                detail = (
                    f"{view}/tracks_xy.npy[{frame}, {track}] is {given[track].tolist()}, and its track is at "
                    f"{seen[track, :2].round(4).tolist()}, {seen[track, 2]:.3f} m before the camera"
                )
    return Check("track pixels", not detail, worst, f"<= {bounds.reprojection_px:g} px; NaN behind the camera", detail)


def _unsure_px(intrinsics: Float64[np.ndarray, "4"], seen: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """Distance that a pixel moves when its point moves by ``PLACE_M``."""
    focal_px = float(intrinsics[:2].max())
    off_axis = np.abs(seen[:, :2] - intrinsics[2:]).max(axis=1) / focal_px
    return np.nan_to_num(focal_px * PLACE_M * (1.0 + off_axis) / np.abs(seen[:, 2]), nan=np.inf)


def check_poses(files: SequenceFiles, on_actor: Bool[np.ndarray, " P"], bounds: AuditConfig) -> Check:
    """Poses are rigid, and constant for objects that are not actors; each track lies in the box of its object."""
    assert files.record is not None
    poses, boxes = files.arrays["object_poses.npy"], files.arrays["object_boxes.npy"]
    owner = np.asarray(files.record["tracks"]["object_index"], np.int64)
    listed = np.array([int(obj["object_index"]) for obj in files.record["objects"]], np.int64)
    bound = f"rigid within {bounds.rotation_error:g}, tracks at most {bounds.surface_error_m:g} m out of their boxes"
    if len(listed) != poses.shape[1]:
        detail = f"object_poses.npy has {poses.shape[1]} objects, and {RECORD_FILE} lists {len(listed)}"
        return Check("object poses", False, np.inf, bound, detail)
    faults = _pose_faults(poses, ~np.isin(listed, files.actors), bounds)
    order = np.argsort(listed, kind="stable")
    place = order[np.searchsorted(listed[order], owner).clip(0, len(listed) - 1)]
    if not np.array_equal(listed[place], owner):
        faults.append(f"{RECORD_FILE} has tracks of objects that it does not list")
    worst = 0.0
    for frame, tracks_m in enumerate(files.arrays["tracks_xyz.npy"]):
        pose = poses[frame, place].astype(np.float64)
        own_m = ((tracks_m - pose[:, :3, 3])[:, None] @ pose[:, :3, :3])[:, 0]
        low_m, high_m = np.moveaxis(boxes[frame, place].astype(np.float64), 1, 0)
        out_m = np.maximum(low_m - own_m, own_m - high_m).max(axis=1)
        track = int(np.nan_to_num(out_m, nan=np.inf).argmax())
        worst = max(worst, float(out_m[track]))
        if not out_m[track] <= bounds.surface_error_m and len(faults) < 5:
            faults.append(f"tracks_xyz.npy[{frame}, {track}] is {out_m[track]:.3g} m out of object_boxes.npy")
    return Check("object poses", not faults, worst, bound, "; ".join(faults[:3]))


def _pose_faults(poses: np.ndarray, resting: Bool[np.ndarray, " K"], bounds: AuditConfig) -> list[str]:
    faults = []
    for obj in range(poses.shape[1]):
        error = rigid_error(poses[:, obj].astype(np.float64))
        frame = int(error.argmax())
        if not error[frame] <= bounds.rotation_error:
            faults.append(f"object_poses.npy[{frame}, {obj}] is off a rigid transform by {error[frame]:.3g}")
        elif resting[obj] and (poses[:, obj] != poses[0, obj]).any():
            faults.append(f"object_poses.npy[:, {obj}] moves, and the object is no actor")
    return faults
