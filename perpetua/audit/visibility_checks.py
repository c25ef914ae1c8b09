"""Checks of visibility against depth and foreground, at the pixel centres around each projection."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.audit.config import AuditConfig
from perpetua.audit.files import SequenceFiles
from perpetua.audit.geometry import NEIGHBOUR_PIXELS, camera_centre_m, depth_of_planes, project_to_pixels
from perpetua.audit.report import Check
from perpetua.audit.tally import Tally, check_of

# A hidden point counts as unexplained only where depth shows its surface beyond doubt.
SHARP = 0.1
# A pixel covers more of a surface that it sees at an angle, up to this cosine.
STEEPEST = 0.17


@dataclass(frozen=True)
class _Evidence:
    """What one image shows of all tracks: each inside or not; expected and rendered depth and foreground at the four
    pixel centres around it, as far as they lie on the image; own depth, and what a pixel's diagonal covers of
    the surface."""

    inside: Bool[np.ndarray, " P"]
    expected_m: Float64[np.ndarray, "P 4"]
    rendered_m: Float64[np.ndarray, "P 4"]
    foreground: Bool[np.ndarray, "P 4"]
    on_image: Bool[np.ndarray, "P 4"]
    facing: Bool[np.ndarray, " P"]
    depth_m: Float64[np.ndarray, " P"]
    width_m: Float64[np.ndarray, "P 1"]


def check_visibility(files: SequenceFiles, on_actor: Bool[np.ndarray, " P"] | None, bounds: AuditConfig) -> list[Check]:
    """Visible entries lie on the image, at their own surface's rendered depth, on foreground just when on an actor;
    hidden ones are not plainly in view. Without ``surface_xyz.npy`` a point's own depth stands for its surface's."""
    has_surface = "surface_xyz.npy" in files.arrays
    least = bounds.depth_agreement if has_surface else bounds.point_depth_agreement
    outside = Tally("is visible, and projects outside the image", 1.0)
    depth = Tally("is visible, and depth.npy shows another surface in all pixels around", least)
    foreground = Tally(
        "is visible, and foreground_mask.npy disagrees with its object's kind in all pixels around",
        bounds.foreground_agreement,
    )
    hidden = Tally("is hidden, and depth shows its surface", 1.0 - bounds.unexplained_hidden)
    for view in files.views:
        visibility = files.arrays[f"{view}/visibility.npy"]
        for frame in range(len(visibility)):
            shown, name = _evidence(files, view, frame), f"{view}/visibility.npy[{frame}"
            visible = np.asarray(visibility[frame])
            outside.add(name, ~shown.inside, visible)
            agrees = (_agrees(shown, bounds, 1.0) | _near_by(shown)).any(axis=1)
            depth.add(name, ~agrees, visible, partial(_depth_figures, shown))
            if on_actor is not None:
                right = (shown.foreground == on_actor[:, None]) & shown.on_image
                foreground.add(name, ~right.any(axis=1), visible)
                plain = (_agrees(shown, bounds, SHARP) & right).all(axis=1) & shown.facing
                hidden.add(name, plain, ~visible & shown.inside)
    checks = [
        check_of("visible on image", [outside]),
        check_of("depth agreement" if has_surface else "depth agreement of points", [depth]),
    ]
    if on_actor is not None:
        checks.append(check_of("foreground agreement", [foreground]))
    if on_actor is not None and has_surface:
        checks.append(check_of("hidden for a reason", [hidden]))
    return checks


def _evidence(files: SequenceFiles, view: str, frame: int) -> _Evidence:
    intrinsics = files.arrays[f"{view}/intrinsics.npy"]
    pose = files.arrays[f"{view}/extrinsics_w2c.npy"][frame]
    depth_m = files.arrays[f"{view}/depth.npy"][frame]
    height, width = depth_m.shape
    seen = project_to_pixels(intrinsics, pose, files.arrays["tracks_xyz.npy"][frame])
    with np.errstate(invalid="ignore"):
        inside = (
            (seen[:, 2] > 0)
            & (np.abs(seen[:, 0] - (width - 1) / 2) < width / 2)
            & (np.abs(seen[:, 1] - (height - 1) / 2) < height / 2)
        )
    corner = np.floor(np.where(inside[:, None], seen[:, :2], 0.0)).astype(np.int64)[:, None] + NEIGHBOUR_PIXELS
    on_image = ((corner >= 0) & (corner < [width, height])).all(axis=2)
    column, row = np.clip(corner[..., 0], 0, width - 1), np.clip(corner[..., 1], 0, height - 1)
    width_m = np.sqrt(2.0) * np.abs(seen[:, 2:3]) / float(intrinsics[0])
    expected_m, facing = np.repeat(seen[:, 2:3], 4, axis=1), np.ones(len(seen), bool)
    if "surface_xyz.npy" in files.arrays:
        triangle_m = np.asarray(files.arrays["surface_xyz.npy"][frame], np.float64)
        expected_m = np.stack(
            [depth_of_planes(intrinsics, pose, triangle_m, column[:, k], row[:, k]) for k in range(4)], axis=1
        )
        normal = np.cross(triangle_m[:, 1] - triangle_m[:, 0], triangle_m[:, 2] - triangle_m[:, 0])
        towards = camera_centre_m(pose) - triangle_m[:, 0]
        along = (towards * normal).sum(axis=1)
        facing = along > 0
        size = np.linalg.norm(normal, axis=1) * np.linalg.norm(towards, axis=1)
        width_m = width_m / np.maximum(np.abs(along) / np.maximum(size, 1e-30), STEEPEST)[:, None]
    mask = files.arrays[f"{view}/foreground_mask.npy"][frame]
    rendered_m = np.asarray(depth_m[row, column], np.float64)
    return _Evidence(inside, expected_m, rendered_m, mask[row, column], on_image, facing, seen[:, 2], width_m)


def _agrees(shown: _Evidence, bounds: AuditConfig, factor: float) -> Bool[np.ndarray, "P 4"]:
    with np.errstate(invalid="ignore"):
        allowed_m = factor * (bounds.depth_tolerance_m + bounds.depth_tolerance_share * np.abs(shown.expected_m))
        close = np.abs(shown.rendered_m - shown.expected_m) <= allowed_m
    return np.asarray(shown.inside[:, None] & shown.on_image & (shown.rendered_m > 0) & close)


def _near_by(shown: _Evidence) -> Bool[np.ndarray, "P 4"]:
    """A small or curved object bends away from the triangle's plane, and still is as near as its pixels are wide."""
    return np.asarray(
        shown.inside[:, None] & shown.on_image & (np.abs(shown.rendered_m - shown.depth_m[:, None]) <= shown.width_m)
    )


def _depth_figures(shown: _Evidence, track: int) -> str:
    expected, rendered = (
        ", ".join(f"{depth:.4f}" for depth in depths[track]) for depths in (shown.expected_m, shown.rendered_m)
    )
    return f"its surface is at {expected} m on the rays of the pixels around, and depth.npy has {rendered} m"
