"""Figures of a sequence, measured on its arrays."""

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float64, Int64

from perpetua.formats.reader import Sequence, SequenceView
from perpetua.formats.source import image_size_px
from perpetua.report import scales
from perpetua.report.scales import Counts, binned, counted
from perpetua.tracks.motion import MOVING_M, is_fast, travel_m

# Distributions are taken from a sample: this many frames, and every fourth pixel along each side.
SAMPLED_FRAMES = 12
PIXEL_STEP = 4


@dataclass(frozen=True)
class Measured:
    """Sizes, fractions and counts.

    ``moving`` and ``fast`` count tracks. ``visible_fraction`` has one entry per view: the fraction of tracks and
    frames that it sees. ``origin_m`` is the range of the cameras' distances from the world's origin, ``depth_m``
    that of sampled depths, NaN where there are none.
    """

    frames: int
    tracks: int
    size_px: tuple[int, int]
    counts: Counts
    moving: int
    fast: int
    visible_fraction: tuple[float, ...]
    origin_m: tuple[float, float]
    depth_m: tuple[float, float]


def measure(sequence: Sequence, fps: float) -> Measured:
    """Measures a sequence of ``fps`` frames per second.

    Raises:
        SequenceFormatError: an image of the sequence cannot be read.
    """
    sizes_px = [image_size_px(view) for view in sequence.views]
    tracks_m = sequence.tracks_m.astype(np.float64)
    reach_m = travel_m(tracks_m)
    distance_m = np.linalg.norm(np.concatenate([_centres_m(view) for view in sequence.views]), axis=1)
    depth_m = _depth_sample_m(sequence)
    return Measured(
        frames=len(tracks_m),
        tracks=tracks_m.shape[1],
        size_px=sizes_px[0],
        counts=_counts(sequence, sizes_px, reach_m, depth_m, fps),
        moving=int((reach_m > MOVING_M).sum()),
        fast=int(is_fast(tracks_m, reach_m).sum()),
        visible_fraction=tuple(float(view.visible.mean()) if view.visible.size else 0.0 for view in sequence.views),
        origin_m=(float(distance_m.min()), float(distance_m.max())),
        depth_m=(float(depth_m.min()), float(depth_m.max())) if len(depth_m) else (math.nan, math.nan),
    )


def _centres_m(view: SequenceView) -> Float64[np.ndarray, "F 3"]:
    pose = view.camera_from_world.astype(np.float64)
    return np.asarray(-np.einsum("fji,fj->fi", pose[:, :3, :3], pose[:, :3, 3]))


def _sampled(frames: int) -> Int64[np.ndarray, " _"]:
    return np.unique(np.linspace(0, frames - 1, SAMPLED_FRAMES).round().astype(np.int64))


def _depth_sample_m(sequence: Sequence) -> Float64[np.ndarray, " _"]:
    """Depths of some pixels of some frames of all views, where there is a surface."""
    frames = _sampled(len(sequence.tracks_m)).tolist()
    some = [
        np.asarray(view.depth_m[frame, ::PIXEL_STEP, ::PIXEL_STEP], np.float64).ravel()
        for view in sequence.views
        if view.depth_m is not None
        for frame in frames
    ]
    joined = np.concatenate(some) if some else np.zeros(0)
    return joined[joined > 0.0]


def _counts(
    sequence: Sequence,
    sizes_px: list[tuple[int, int]],
    reach_m: Float64[np.ndarray, " P"],
    depth_m: Float64[np.ndarray, " _"],
    fps: float,
) -> Counts:
    moving_m = sequence.tracks_m[:, reach_m > MOVING_M].astype(np.float64)
    visible = np.stack([view.visible for view in sequence.views])
    widths = [(width_px, view.intrinsics_px[0]) for (width_px, _), view in zip(sizes_px, sequence.views, strict=True)]
    fields_deg = [math.degrees(2.0 * math.atan2(0.5 * width_px, float(fx_px))) for width_px, fx_px in widths]
    return Counts(
        travel=binned(reach_m, scales.TRAVEL_M),
        speed=binned(fps * np.linalg.norm(np.diff(moving_m, axis=0), axis=2), scales.SPEED_MPS),
        seeing_views=counted(visible.sum(axis=0), scales.MOST_VIEWS),
        seen_fraction=binned(visible.any(axis=0).mean(axis=0), scales.SEEN_FRACTION),
        occlusions=_occlusions(sequence, visible, sizes_px),
        depth=binned(depth_m, scales.DEPTH_M),
        field_of_view=binned(np.array(fields_deg), scales.FIELD_OF_VIEW_DEG),
        apart=binned(_apart_deg(sequence), scales.APART_DEG),
    )


def _occlusions(
    sequence: Sequence, visible: Bool[np.ndarray, "C F P"], sizes_px: list[tuple[int, int]]
) -> Int64[np.ndarray, " _"]:
    """Tracks in each view that sees them, counted by how often they become hidden while on the image."""
    total = np.zeros(scales.MOST_OCCLUSIONS + 1, np.int64)
    for seen, view, size_px in zip(visible, sequence.views, sizes_px, strict=True):
        hides = seen[:-1] & ~seen[1:] & _on_image(sequence, view, size_px)[1:]
        total += counted(hides.sum(axis=0)[seen.any(axis=0)], scales.MOST_OCCLUSIONS)
    return total


def _on_image(sequence: Sequence, view: SequenceView, size_px: tuple[int, int]) -> Bool[np.ndarray, "F P"]:
    pose = view.camera_from_world.astype(np.float64)
    camera_m = np.einsum("fij,fpj->fpi", pose[:, :3, :3], sequence.tracks_m) + pose[:, None, :3, 3]
    fx_px, fy_px, cx_px, cy_px = view.intrinsics_px.tolist()
    with np.errstate(divide="ignore", invalid="ignore"):
        x_px = fx_px * camera_m[..., 0] / camera_m[..., 2] + cx_px
        y_px = fy_px * camera_m[..., 1] / camera_m[..., 2] + cy_px
    inside = (x_px >= -0.5) & (x_px < size_px[0] - 0.5) & (y_px >= -0.5) & (y_px < size_px[1] - 0.5)
    return np.asarray(inside & (camera_m[..., 2] > 0.0))


def _apart_deg(sequence: Sequence) -> Float64[np.ndarray, " _"]:
    """Angles between the optical axes of each pair of views at some frames, degrees."""
    frames = _sampled(len(sequence.tracks_m))
    axes = [view.camera_from_world[frames, 2, :3].astype(np.float64) for view in sequence.views]
    cosines = [(one * other).sum(axis=1) for one, other in combinations(axes, 2)]
    return np.degrees(np.arccos(np.clip(np.concatenate(cosines), -1.0, 1.0))) if cosines else np.zeros(0)
