"""Two trackers that learn nothing, to compare with: they use the images, depth and cameras of a sequence, never its
tracks.

Both begin at the surface that depth shows at the query's pixel. A point is called visible in a view where it projects
onto the image and depth there is its own within 5%; so a lost point that stays at its place is found again.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64, UInt8

from perpetua.errors import InputError
from perpetua.evaluation.predictions import Predictions
from perpetua.evaluation.protocol import Truth
from perpetua.formats.reader import Sequence, SequenceView
from perpetua.geometry.transforms import invert_rigid, transform_points

SAME_DEPTH_FRACTION = 0.05
# Lucas-Kanade: side of the window, number of pyramid levels, largest distance between a point and its return.
WINDOW_PX, HALVINGS, RETURN_PX = 21, 3, 1.0
# A point that moves further from one frame to the next has slid onto another surface.
LEAP_M = 0.5


def still(sequence: Sequence) -> Predictions:
    """Each point stays where it was at its query.

    Raises:
        InputError: the sequence has no depth.
    """
    start_m = _query_points_m(Truth(sequence))
    return _predictions(sequence, np.repeat(start_m[None], len(sequence.tracks_m), axis=0))


def flow(sequence: Sequence) -> Predictions:
    """Optical flow (pyramidal Lucas-Kanade) from the query through its view's images, forward and backward in time,
    lifted with depth; a point that is lost stays at its last position.

    Raises:
        InputError: the sequence has no depth.
    """
    truth = Truth(sequence)
    start_m = _query_points_m(truth)
    place_m = np.repeat(start_m[None], truth.size.frames, axis=0)
    for number, view in enumerate(sequence.views):
        queried = np.flatnonzero(truth.query_view == number)
        if len(queried) == 0:
            continue
        grey = [_grey(view.image(frame)) for frame in range(truth.size.frames)]
        for step in (1, -1):
            way = _Way(view, grey, queried, truth.query_frame[queried], sequence.queries_xytv[queried, :2].copy())
            way.follow(place_m, step)
    return _predictions(sequence, place_m)


BASELINES: dict[str, Callable[[Sequence], Predictions]] = {"still": still, "flow": flow}
"""Trackers that learn nothing, by name: each makes predictions from a sequence's images, depth and cameras."""


@dataclass
class _Way:
    """Tracks of one view, followed through its images; ``pixel_px`` is the pixel of each at the current frame."""

    view: SequenceView
    grey: list[UInt8[np.ndarray, "H W"]]
    tracks: Int64[np.ndarray, " N"]
    query_frame: Int64[np.ndarray, " N"]
    pixel_px: Float32[np.ndarray, "N 2"]

    def follow(self, place_m: Float64[np.ndarray, "F P 3"], step: int) -> None:
        """Fills ``place_m`` frame by frame, forward (1) or backward (-1)."""
        alive = np.isfinite(place_m[self.query_frame, self.tracks]).all(axis=1)
        frames = list(range(len(self.grey)))[::step]
        for before, after in pairwise(frames):
            begun = (before - self.query_frame) * step >= 0
            place_m[after, self.tracks[begun]] = place_m[before, self.tracks[begun]]
            moving = np.flatnonzero(begun & alive)
            if len(moving) == 0:
                continue
            self.pixel_px[moving], found = _lucas_kanade(self.grey[before], self.grey[after], self.pixel_px[moving])
            lifted_m = _lift_m(self.view, after, self.pixel_px[moving].astype(np.float64))
            leap_m = np.linalg.norm(lifted_m - place_m[before, self.tracks[moving]], axis=1)
            found &= np.isfinite(leap_m) & (leap_m <= LEAP_M)
            alive[moving] = found
            place_m[after, self.tracks[moving[found]]] = lifted_m[found]


def _lucas_kanade(
    before: UInt8[np.ndarray, "H W"], after: UInt8[np.ndarray, "H W"], pixel_px: Float32[np.ndarray, "N 2"]
) -> tuple[Float32[np.ndarray, "N 2"], Bool[np.ndarray, " N"]]:
    """The pixels in the next image, and whether flow back from there returns to the start."""
    import cv2

    def move(image: np.ndarray, other: np.ndarray, points_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        window = (WINDOW_PX, WINDOW_PX)
        moved_px, found, _ = cv2.calcOpticalFlowPyrLK(
            image, other, points_px, np.zeros_like(points_px), winSize=window, maxLevel=HALVINGS
        )
        return np.asarray(moved_px), np.asarray(found)

    moved_px, there = move(before, after, pixel_px[:, None])
    back_px, here = move(after, before, moved_px)
    returned = np.linalg.norm(back_px[:, 0] - pixel_px, axis=1) <= RETURN_PX
    return moved_px[:, 0], (there[:, 0] == 1) & (here[:, 0] == 1) & returned


def _grey(rgb: UInt8[np.ndarray, "H W 3"]) -> UInt8[np.ndarray, "H W"]:
    import cv2

    return np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), np.uint8)


def _query_points_m(truth: Truth) -> Float64[np.ndarray, "P 3"]:
    """World positions of the surfaces that depth shows at the queries; NaN where it shows none."""
    start_m = np.full((truth.size.tracks, 3), np.nan)
    for number, view in enumerate(truth.sequence.views):
        for frame in np.unique(truth.query_frame[truth.query_view == number]).tolist():
            chosen = np.flatnonzero((truth.query_view == number) & (truth.query_frame == frame))
            start_m[chosen] = _lift_m(view, frame, truth.sequence.queries_xytv[chosen, :2].astype(np.float64))
    return start_m


def _lift_m(view: SequenceView, frame: int, pixel_px: Float64[np.ndarray, "N 2"]) -> Float64[np.ndarray, "N 3"]:
    """Points in the world at the depth of the nearest pixel centres; NaN off the image and where there is no depth."""
    depth_m = _depth_at(view, frame, pixel_px)
    fx, fy, cx, cy = view.intrinsics_px.astype(np.float64)
    ray = np.stack([(pixel_px[:, 0] - cx) / fx, (pixel_px[:, 1] - cy) / fy, np.ones(len(pixel_px))], axis=1)
    world_from_camera = invert_rigid(view.camera_from_world[frame].astype(np.float64))
    return transform_points(world_from_camera, ray * depth_m[:, None])


def _depth_at(view: SequenceView, frame: int, pixel_px: Float64[np.ndarray, "N 2"]) -> Float64[np.ndarray, " N"]:
    """Depth at the nearest pixel centres; NaN off the image and where there is none."""
    if view.depth_m is None:
        raise InputError("the baselines lift pixels with depth, and a view of this sequence has no depth.npy")
    height, width = view.depth_m.shape[1:]
    with np.errstate(invalid="ignore"):
        nearest = np.round(np.nan_to_num(pixel_px, nan=-9.0, posinf=-9.0, neginf=-9.0).clip(-9.0, 1e9)).astype(np.int64)
    column, row = nearest.T
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    found_m = view.depth_m[frame][row.clip(0, height - 1), column.clip(0, width - 1)].astype(np.float64)
    return np.where(inside & (found_m > 0.0), found_m, np.nan)


def _predictions(sequence: Sequence, place_m: Float64[np.ndarray, "F P 3"]) -> Predictions:
    """Turns world positions into predictions for every view; a point is visible where depth agrees.

    Raises:
        InputError: the sequence has no depth.
    """
    camera = np.empty((len(sequence.views), *place_m.shape), np.float32)
    visible = np.zeros(camera.shape[:3], bool)
    for number, view in enumerate(sequence.views):
        in_camera_m = transform_points(view.camera_from_world.astype(np.float64), place_m)
        camera[number] = in_camera_m
        for frame in range(len(place_m)):
            visible[number, frame] = _depth_agrees(view, frame, in_camera_m[frame])
    first_from_world = sequence.views[0].camera_from_world[0].astype(np.float64)
    world = transform_points(first_from_world, place_m.reshape(-1, 3)).reshape(place_m.shape)
    return Predictions(camera, world.astype(np.float32), visible, visible.any(axis=0), None)


def _depth_agrees(view: SequenceView, frame: int, point_m: Float64[np.ndarray, "P 3"]) -> Bool[np.ndarray, " P"]:
    fx, fy, cx, cy = view.intrinsics_px.astype(np.float64)
    depth_m = np.where(point_m[:, 2] > 0.0, point_m[:, 2], np.nan)
    pixel_px = np.stack([fx * point_m[:, 0] / depth_m + cx, fy * point_m[:, 1] / depth_m + cy], axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(_depth_at(view, frame, pixel_px) - depth_m) <= SAME_DEPTH_FRACTION * depth_m)
