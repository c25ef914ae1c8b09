"""The benchmark's protocol: which entries are scored, in which coordinate frame, and after which alignment.

Four regimes, each scored by ``perpetua.evaluation.metrics``:

- query view: in each view, the tracks whose query lies in it, in camera coordinates.
- other views: in each view, the tracks whose query lies in another one, in camera coordinates.
- world, median scale: all tracks, in the axes of the first view's camera at the first frame. A point counts as visible
  where any view sees it. One pixel is equally wide everywhere: the median over tracks of Z / f at their queries.
- world, Sim(3): the same after the similarity transform that brings the predicted geometry onto the true surfaces;
  only where a prediction has geometry.

In camera coordinates, predictions of a view are multiplied by one factor: the median true distance of the points
queried in it, at their queries, over the predicted one. (Where nothing is queried in a view, all tracks at their
queries are used.) World tracks are multiplied by one factor, found in the same way from all queries.

A tracker is given its query, so that entry (the query's frame, in the query's view and in the world) is not scored,
as in TAP-Vid; TAPVid-3D does score it, and ``score_queries`` does as TAPVid-3D. Entries of all views of a sequence
are pooled, and sequences count alike in a mean.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64

from perpetua.errors import InputError, SequenceFormatError
from perpetua.evaluation.metrics import Scores, Similarity, Tally, fit_similarity, median_scale, tally_entries
from perpetua.evaluation.predictions import Geometry, Predictions, SequenceSize
from perpetua.formats.reader import Sequence
from perpetua.geometry.transforms import invert_rigid, transform_points

QUERY_VIEW, OTHER_VIEWS = "query view", "other views"
WORLD_MEDIAN, WORLD_SIMILARITY = "world, median scale", "world, Sim(3)"
REGIMES = (QUERY_VIEW, OTHER_VIEWS, WORLD_MEDIAN, WORLD_SIMILARITY)


@dataclass(frozen=True)
class Evaluation:
    """Scores of one sequence by regime, as far as it was predicted; and the factors that predictions were scaled by."""

    scores: dict[str, Scores]
    view_scales: tuple[float, ...]
    world_scale: float | None
    similarity_scale: float | None


@dataclass(frozen=True)
class Truth:
    """The true values that the protocol needs, computed from a sequence."""

    sequence: Sequence

    def __post_init__(self) -> None:
        size = self.size
        inside = (self.query_frame >= 0) & (self.query_frame < size.frames)
        inside &= (self.query_view >= 0) & (self.query_view < size.views)
        if not inside.all():
            first = int(np.flatnonzero(~inside)[0])
            raise SequenceFormatError(
                f"query {first} of '{self.sequence.folder}' must lie in one of {size.frames} frames and {size.views} "
                f"views, not in frame {self.query_frame[first]} of view {self.query_view[first]}"
            )

    @property
    def size(self) -> SequenceSize:
        """Views, frames and tracks."""
        return SequenceSize(len(self.sequence.views), *self.sequence.tracks_m.shape[:2])

    @cached_property
    def query_frame(self) -> Int64[np.ndarray, " P"]:
        """Frame of each query."""
        return _whole(self.sequence.queries_xytv[:, 2])

    @cached_property
    def query_view(self) -> Int64[np.ndarray, " P"]:
        """View of each query."""
        return _whole(self.sequence.queries_xytv[:, 3])

    @cached_property
    def at_query(self) -> Bool[np.ndarray, "F P"]:
        """True at the frame of each track's query."""
        return np.asarray(np.arange(self.size.frames)[:, None] == self.query_frame)

    def focal_px(self, view: int) -> float:
        """Geometric mean of fx and fy."""
        fx_px, fy_px = self.sequence.views[view].intrinsics_px[:2].astype(np.float64).tolist()
        return float(np.sqrt(fx_px * fy_px))

    def in_camera(self, view: int) -> Float64[np.ndarray, "F P 3"]:
        """Tracks in the axes of a view's camera at each frame, metres."""
        camera_from_world = self.sequence.views[view].camera_from_world.astype(np.float64)
        return transform_points(camera_from_world, self.sequence.tracks_m.astype(np.float64))

    def in_first_camera(self) -> Float64[np.ndarray, "F P 3"]:
        """Tracks in the axes of the first view's camera at the first frame, metres."""
        first_from_world = self.sequence.views[0].camera_from_world[:1].astype(np.float64)
        flat_m = self.sequence.tracks_m.astype(np.float64).reshape(1, -1, 3)
        return transform_points(first_from_world, flat_m).reshape(self.sequence.tracks_m.shape)

    def world_pixel_m(self) -> float:
        """How wide one pixel is at the median query: the median of Z / f, metres."""
        query_m = self.sequence.tracks_m[self.query_frame, np.arange(self.size.tracks)].astype(np.float64)
        width_m = np.empty(self.size.tracks)
        for number, view in enumerate(self.sequence.views):
            chosen = np.flatnonzero(self.query_view == number)
            camera_from_world = view.camera_from_world[self.query_frame[chosen]].astype(np.float64)
            depth_m = transform_points(camera_from_world, query_m[chosen, None])[:, 0, 2]
            width_m[chosen] = depth_m / self.focal_px(number)
        return float(np.median(width_m))


def _whole(values: Float32[np.ndarray, " P"]) -> Int64[np.ndarray, " P"]:
    """Values as integers; -1 where a value is not finite or too large."""
    sound = np.isfinite(values) & (np.abs(values) < 2**31)
    return np.where(sound, values, -1.0).astype(np.int64)


def evaluate_sequence(sequence: Sequence, predictions: Predictions, score_queries: bool = False) -> Evaluation:
    """Scores predictions of a sequence in every regime that they were made for.

    Args:
        sequence: the truth.
        predictions: of the sequence's size.
        score_queries: also score each track at its own query, as TAPVid-3D does.

    Raises:
        SequenceFormatError: a query lies in no frame or view of the sequence.
        InputError: geometry does not lie on the sequence's images, or does not settle a similarity transform.
    """
    truth = Truth(sequence)
    scored = np.ones_like(truth.at_query) if score_queries else ~truth.at_query
    tallies: dict[str, Tally] = {}
    view_scales = _tally_views(truth, predictions, scored, tallies)
    world_scale, similarity = _tally_world(truth, predictions, scored, tallies)
    found = {regime: tallies[regime].scores() for regime in REGIMES if regime in tallies}
    return Evaluation(
        scores={regime: scores for regime, scores in found.items() if scores is not None},
        view_scales=view_scales,
        world_scale=world_scale,
        similarity_scale=None if similarity is None else similarity.scale,
    )


def _tally_views(
    truth: Truth, predictions: Predictions, scored: Bool[np.ndarray, "F P"], tallies: dict[str, Tally]
) -> tuple[float, ...]:
    """View by view, so that memory holds one view's tracks at a time; returns the factor of each view."""
    if predictions.camera is None or predictions.visible is None:
        return ()
    scales = []
    for view in range(truth.size.views):
        true_m, predicted = truth.in_camera(view), predictions.camera[view]
        queried = truth.query_view == view
        chosen = np.flatnonzero(queried) if queried.any() else np.arange(len(queried))
        frame = truth.query_frame[chosen]
        scales.append(median_scale(true_m[frame, chosen], predicted[frame, chosen]))
        pixel_m = np.abs(true_m[..., 2]) / truth.focal_px(view)
        entries = {QUERY_VIEW: scored & queried, OTHER_VIEWS: np.broadcast_to(~queried, scored.shape)}
        visible = np.asarray(truth.sequence.views[view].visible)
        scaled_m = scales[-1] * predicted.astype(np.float64)
        for regime, counted in entries.items():
            tally = tally_entries(true_m, visible, scaled_m, predictions.visible[view], pixel_m, counted)
            tallies[regime] = tallies[regime] + tally if regime in tallies else tally
    return tuple(scales)


def _tally_world(
    truth: Truth, predictions: Predictions, scored: Bool[np.ndarray, "F P"], tallies: dict[str, Tally]
) -> tuple[float | None, Similarity | None]:
    """Returns the factor of the world tracks and the transform fitted to geometry, as far as there are any."""
    if predictions.world is None:
        return None, None
    true_m, predicted = truth.in_first_camera(), predictions.world.astype(np.float64)
    visible = np.any([view.visible for view in truth.sequence.views], axis=0)
    pixel_m = np.broadcast_to(truth.world_pixel_m(), scored.shape)
    track = np.arange(truth.size.tracks)
    scale = median_scale(true_m[truth.query_frame, track], predicted[truth.query_frame, track])
    aligned = {WORLD_MEDIAN: scale * predicted}
    similarity = None if predictions.geometry is None else _similarity(truth, predictions.geometry)
    if similarity is not None:
        aligned[WORLD_SIMILARITY] = similarity.apply(predicted)
    for regime, aligned_m in aligned.items():
        tallies[regime] = tally_entries(true_m, visible, aligned_m, predictions.visible_anywhere, pixel_m, scored)
    return scale, similarity


def _similarity(truth: Truth, geometry: Geometry) -> Similarity:
    similarity = fit_similarity(_surface_m(truth, geometry.pixels_xytv), geometry.point)
    if similarity is None:
        raise InputError(
            "predicted geometry must have at least three points, not all on one line, where depth.npy shows a surface: "
            "add points, or leave geometry out"
        )
    return similarity


def _surface_m(truth: Truth, pixels_xytv: Int64[np.ndarray, "G 4"]) -> Float64[np.ndarray, "G 3"]:
    """True surfaces at pixels, in the axes of the first view's camera at the first frame; NaN where there is none."""
    x, y, frame, number = pixels_xytv.T
    size = truth.size
    inside = (frame >= 0) & (frame < size.frames) & (number >= 0) & (number < size.views)
    surface_m = np.full((len(pixels_xytv), 3), np.nan)
    first_from_world = truth.sequence.views[0].camera_from_world[0].astype(np.float64)
    for index, view in enumerate(truth.sequence.views):
        if view.depth_m is None:
            raise InputError(f"geometry needs depth.npy in every view of '{truth.sequence.folder}'")
        height, width = view.depth_m.shape[1:]
        here = inside & (number == index)
        inside &= ~here | ((x >= 0) & (x < width) & (y >= 0) & (y < height))
        fx, fy, cx, cy = view.intrinsics_px.astype(np.float64)
        for time in np.unique(frame[here & inside]).tolist():
            chosen = np.flatnonzero(here & inside & (frame == time))
            depth_m = view.depth_m[time][y[chosen], x[chosen]].astype(np.float64)
            depth_m = np.where(depth_m > 0.0, depth_m, np.nan)
            ray = np.stack([(x[chosen] - cx) / fx, (y[chosen] - cy) / fy, np.ones(len(chosen))], axis=1)
            world_from_camera = invert_rigid(view.camera_from_world[time].astype(np.float64))
            surface_m[chosen] = transform_points(first_from_world @ world_from_camera, ray * depth_m[:, None])
    if not inside.all():
        first = int(np.flatnonzero(~inside)[0])
        raise InputError(f"geometry pixel {first} (x, y, t, v) lies on no image: {pixels_xytv[first].tolist()}")
    return surface_m
