"""Scores of known predictions of the synthetic sequence: the truth, copies of it, and parts of it."""

from dataclasses import replace

import numpy as np
import pytest

from perpetua.errors import InputError, SequenceFormatError
from perpetua.evaluation.baselines import flow, still
from perpetua.evaluation.metrics import Similarity
from perpetua.evaluation.predictions import Geometry, Predictions
from perpetua.evaluation.protocol import (
    OTHER_VIEWS,
    QUERY_VIEW,
    REGIMES,
    WORLD_MEDIAN,
    WORLD_SIMILARITY,
    Evaluation,
    Truth,
    evaluate_sequence,
)
from perpetua.formats.reader import Sequence, read_sequence
from perpetua.testing.synthetic_sequence import write_scene

TURN = Similarity(1.0, np.array([[0.0, -1.0, 0.0], [0.6, 0.0, -0.8], [0.8, 0.0, 0.6]]), np.array([3.0, -2.0, 0.5]))


@pytest.fixture(scope="module")
def sequence(tmp_path_factory: pytest.TempPathFactory) -> Sequence:
    folder = tmp_path_factory.mktemp("evaluation") / "sequence"
    write_scene(folder)
    return read_sequence(folder)


@pytest.fixture(scope="module")
def perfect(sequence: Sequence) -> Predictions:
    """The truth as a prediction, with the truly visible surface at some pixels as geometry."""
    truth = Truth(sequence)
    camera = np.stack([truth.in_camera(view) for view in range(truth.size.views)])
    visible = np.stack([view.visible for view in sequence.views])
    return Predictions(camera, truth.in_first_camera(), visible, visible.any(axis=0), _true_geometry(sequence))


def _true_geometry(sequence: Sequence) -> Geometry:
    """Surfaces at every 8th pixel of the first and last frame of each view, by another way than the product's."""
    first_from_world = sequence.views[0].camera_from_world[0].astype(np.float64)
    pixels, points = [], []
    for number, view in enumerate(sequence.views):
        assert view.depth_m is not None
        matrix = np.eye(3)
        matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2] = view.intrinsics_px
        for frame in (0, len(sequence.tracks_m) - 1):
            for y, x in np.argwhere(view.depth_m[frame] > 0)[::64]:
                at_m = np.linalg.inv(matrix) @ [x, y, 1.0] * view.depth_m[frame][y, x]
                world_from_camera = np.linalg.inv(view.camera_from_world[frame].astype(np.float64))
                points.append((first_from_world @ world_from_camera @ [*at_m, 1.0])[:3])
                pixels.append([x, y, frame, number])
    return Geometry(np.array(pixels, np.int64), np.array(points))


def _averages(evaluation: Evaluation, regime: str) -> tuple[float, float, float]:
    scores = evaluation.scores[regime]
    return scores.average_jaccard, scores.average_position_accuracy, scores.occlusion_accuracy


@pytest.mark.parametrize("score_queries", [False, True])
def test_the_truth_scores_one_in_every_regime(sequence: Sequence, perfect: Predictions, score_queries: bool) -> None:
    found = evaluate_sequence(sequence, perfect, score_queries)
    assert list(found.scores) == list(REGIMES)
    for regime in REGIMES:
        assert _averages(found, regime) == (1.0, 1.0, 1.0)
        assert set(found.scores[regime].jaccard) == {1.0}
    assert found.view_scales == pytest.approx((1.0, 1.0, 1.0))
    assert (found.world_scale, found.similarity_scale) == pytest.approx((1.0, 1.0))


def test_a_scaled_copy_scores_one_under_median_scale(sequence: Sequence, perfect: Predictions) -> None:
    assert perfect.camera is not None and perfect.world is not None and perfect.geometry is not None
    factors = np.array([0.2, 3.0, 40.0])
    copy = replace(
        perfect,
        camera=perfect.camera * factors[:, None, None, None],
        world=perfect.world * 7.0,
        geometry=replace(perfect.geometry, point=perfect.geometry.point * 7.0),
    )
    found = evaluate_sequence(sequence, copy)
    for regime in REGIMES:
        assert _averages(found, regime) == (1.0, 1.0, 1.0)
    assert found.view_scales == pytest.approx(tuple(1.0 / factors))
    assert (found.world_scale, found.similarity_scale) == pytest.approx((1 / 7, 1 / 7))


def test_a_turned_and_shifted_copy_scores_one_under_sim3_alone(sequence: Sequence, perfect: Predictions) -> None:
    assert perfect.camera is not None and perfect.world is not None and perfect.geometry is not None
    moved = replace(TURN, scale=0.4)
    copy = replace(
        perfect,
        camera=moved.apply(perfect.camera),
        world=moved.apply(perfect.world),
        geometry=replace(perfect.geometry, point=moved.apply(perfect.geometry.point)),
    )
    found = evaluate_sequence(sequence, copy)
    assert _averages(found, WORLD_SIMILARITY) == (1.0, 1.0, 1.0)
    assert found.similarity_scale == pytest.approx(2.5)
    for regime in (QUERY_VIEW, OTHER_VIEWS, WORLD_MEDIAN):
        jaccard, position, occlusion = _averages(found, regime)
        assert jaccard < 0.1 and position < 0.1, regime
        assert occlusion == 1.0, "visibility does not depend on the frame"


def test_one_view_does_not_scale_another(sequence: Sequence, perfect: Predictions) -> None:
    assert perfect.camera is not None
    mirrored = perfect.camera.copy()
    mirrored[1] *= -1.0
    found = evaluate_sequence(sequence, replace(perfect, camera=mirrored))
    truth = Truth(sequence)
    scored = [view.visible & ~truth.at_query & (truth.query_view == k) for k, view in enumerate(sequence.views)]
    of_query = [int(entries.sum()) for entries in scored]
    expected = (of_query[0] + of_query[2]) / sum(of_query)
    assert found.scores[QUERY_VIEW].position_accuracy == pytest.approx((expected,) * 5)


def test_thresholds_follow_depth_over_focal_length_of_each_point(sequence: Sequence, perfect: Predictions) -> None:
    # Each point of a view moved sideways by 3 pixels at its own depth: right from 4 pixels on, wherever it is. The
    # query entries stay, so that the scale does.
    assert perfect.camera is not None
    truth = Truth(sequence)
    moved = perfect.camera.copy()
    for view in range(3):
        sideways_m = 3.0 * np.abs(moved[view, ..., 2]) / sequence.views[view].intrinsics_px[0]
        moved[view, ..., 0] += np.where(truth.at_query, 0.0, sideways_m)
    found = evaluate_sequence(sequence, replace(perfect, camera=moved))
    assert found.scores[QUERY_VIEW].position_accuracy == (0.0, 0.0, 1.0, 1.0, 1.0)
    assert found.scores[QUERY_VIEW].jaccard == (0.0, 0.0, 1.0, 1.0, 1.0)


def test_the_world_has_one_threshold_for_the_sequence(sequence: Sequence, perfect: Predictions) -> None:
    assert perfect.world is not None
    truth = Truth(sequence)
    widths_m = []
    for (_, _, frame, view), track in zip(sequence.queries_xytv.astype(int), range(200), strict=True):
        pose = sequence.views[view].camera_from_world[frame].astype(np.float64)
        fx, fy = sequence.views[view].intrinsics_px[:2].tolist()
        widths_m.append((pose @ [*sequence.tracks_m[frame, track], 1.0])[2] / np.sqrt(fx * fy))
    sideways_m = 3.0 * float(np.median(widths_m)) * ~truth.at_query
    moved = perfect.world + sideways_m[..., None] * [0.0, 1.0, 0.0]
    found = evaluate_sequence(sequence, replace(perfect, world=moved))
    assert found.scores[WORLD_MEDIAN].position_accuracy == (0.0, 0.0, 1.0, 1.0, 1.0)


def test_a_query_is_scored_only_where_that_is_asked_for(sequence: Sequence, perfect: Predictions) -> None:
    assert perfect.camera is not None
    truth = Truth(sequence)
    spoilt = perfect.camera.copy()
    track = np.arange(truth.size.tracks)
    spoilt[truth.query_view, truth.query_frame, track] = np.nan
    spoilt_predictions = replace(perfect, camera=spoilt)
    assert _averages(evaluate_sequence(sequence, spoilt_predictions), QUERY_VIEW) == (1.0, 1.0, 1.0)
    assert _averages(evaluate_sequence(sequence, spoilt_predictions, True), QUERY_VIEW)[1] < 1.0


def test_missing_tracks_count_as_failures(sequence: Sequence, perfect: Predictions) -> None:
    assert perfect.camera is not None and perfect.world is not None
    camera, world = perfect.camera.copy(), perfect.world.copy()
    camera[:, :, ::2], world[:, ::2] = np.nan, np.nan
    found = evaluate_sequence(sequence, replace(perfect, camera=camera, world=world, geometry=None))
    assert WORLD_SIMILARITY not in found.scores
    visible = perfect.visible_anywhere & ~Truth(sequence).at_query
    fraction = visible[:, 1::2].sum() / visible.sum()
    assert found.scores[WORLD_MEDIAN].position_accuracy == pytest.approx((fraction,) * 5)
    assert found.scores[WORLD_MEDIAN].jaccard == pytest.approx((fraction,) * 5)
    assert found.scores[WORLD_MEDIAN].occlusion_accuracy == pytest.approx(0.5)
    for regime in (QUERY_VIEW, OTHER_VIEWS):
        assert 0.3 < found.scores[regime].average_position_accuracy < 0.7


def test_regimes_without_prediction_are_left_out(sequence: Sequence, perfect: Predictions) -> None:
    world_alone = replace(perfect, camera=None, visible=None, geometry=None)
    assert list(evaluate_sequence(sequence, world_alone).scores) == [WORLD_MEDIAN]
    cameras_alone = replace(perfect, world=None, geometry=None)
    assert list(evaluate_sequence(sequence, cameras_alone).scores) == [QUERY_VIEW, OTHER_VIEWS]


@pytest.mark.parametrize(
    ("pixels", "message"),
    [([[0, 0, 99, 0]], "lies on no image"), ([[96, 0, 0, 0]], "lies on no image"), ([[0, 0, 0, -1]], "on no image")],
)
def test_geometry_off_the_images_is_an_error(
    sequence: Sequence, perfect: Predictions, pixels: list[list[int]], message: str
) -> None:
    geometry = Geometry(np.array(pixels, np.int64), np.ones((1, 3)))
    with pytest.raises(InputError, match=message):
        evaluate_sequence(sequence, replace(perfect, geometry=geometry))


def test_geometry_of_one_pixel_is_too_little(sequence: Sequence, perfect: Predictions) -> None:
    geometry = Geometry(np.array([[5, 5, 0, 0]], np.int64), np.ones((1, 3)))
    with pytest.raises(InputError, match="at least three points"):
        evaluate_sequence(sequence, replace(perfect, geometry=geometry))


@pytest.mark.parametrize("value", [3.0, -1.0, np.nan, np.inf])
def test_a_query_in_no_view_is_an_error(sequence: Sequence, value: float) -> None:
    queries = sequence.queries_xytv.copy()
    queries[7, 3] = value
    with pytest.raises(SequenceFormatError, match="query 7"):
        Truth(replace(sequence, queries_xytv=queries))


def test_baselines_differ_and_do_what_they_can(sequence: Sequence) -> None:
    """Points of the room stay, so a still prediction finds them; it loses walking people, whom flow follows."""
    moving = np.ptp(sequence.tracks_m, axis=0).max(axis=1) > 0.05
    found = {}
    for name, tracker in (("still", still), ("flow", flow)):
        predictions = tracker(sequence)
        assert predictions.camera is not None and predictions.world is not None
        queried = Truth(sequence)
        start_m = predictions.camera[queried.query_view, queried.query_frame, np.arange(len(moving))]
        true_m = np.stack([queried.in_camera(view) for view in range(3)])
        true_start_m = true_m[queried.query_view, queried.query_frame, np.arange(len(moving))]
        assert np.nanmedian(np.linalg.norm(start_m - true_start_m, axis=1)) < 0.03, "both begin at the query's surface"
        found[name] = evaluate_sequence(sequence, predictions)
        world_error_m = np.linalg.norm(predictions.world - queried.in_first_camera(), axis=2)
        if name == "still":
            assert np.nanmedian(world_error_m[:, ~moving]) < 0.03 < 0.2 < np.nanmedian(world_error_m[:, moving])
    for regime in (QUERY_VIEW, OTHER_VIEWS, WORLD_MEDIAN):
        for evaluation in found.values():
            assert all(0.1 < average < 0.999 for average in _averages(evaluation, regime)), regime
        assert _averages(found["still"], regime) != _averages(found["flow"], regime)


def test_flow_follows_what_moves_on_a_textured_plane(sequence: Sequence) -> None:
    """A camera sliding along a textured wall: flow must find the wall's points again in every frame."""
    import cv2

    rng = np.random.default_rng(8)
    texture = cv2.resize(rng.integers(0, 255, (24, 48), np.uint8), (192, 96), interpolation=cv2.INTER_CUBIC)
    frames, step_px, depth_m, focal_px = 4, 3, 2.0, 80.0
    jpeg, poses = [], np.tile(np.eye(4, dtype=np.float32), (frames, 1, 1))
    for frame in range(frames):
        crop = texture[:, step_px * frame : step_px * frame + 96]
        jpeg.append(cv2.imencode(".jpg", crop, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].reshape(-1))
    # The wall moves past a camera at rest, so that points move in the world.
    start_px = np.stack(np.meshgrid(np.arange(30.0, 70.0, 8), np.arange(30.0, 70.0, 8)), axis=-1).reshape(-1, 2)
    queries = np.concatenate([start_px, np.tile([2.0, 0.0], (len(start_px), 1))], axis=1).astype(np.float32)
    shift_px = -step_px * (np.arange(frames) - 2)
    at_px = start_px + shift_px[:, None, None] * [1.0, 0.0]
    tracks_m = np.concatenate([(at_px - 47.5) / focal_px * depth_m, np.full((*at_px.shape[:2], 1), depth_m)], axis=2)
    view = replace(
        sequence.views[0],
        jpeg=tuple(jpeg),
        intrinsics_px=np.array([focal_px, focal_px, 47.5, 47.5], np.float32),
        camera_from_world=poses,
        visible=np.ones((frames, len(start_px)), bool),
        depth_m=np.full((frames, 96, 96), depth_m, np.float32),
        foreground=None,
    )
    wall = Sequence(sequence.folder, tracks_m.astype(np.float32), queries, (view,))
    followed, stayed = evaluate_sequence(wall, flow(wall)), evaluate_sequence(wall, still(wall))
    assert _averages(followed, QUERY_VIEW)[1] > 0.95
    assert _averages(stayed, QUERY_VIEW)[1] == pytest.approx(0.2 * (0 + 0 + 2 / 3 + 1 + 1))
    assert _averages(followed, QUERY_VIEW)[2] == _averages(stayed, QUERY_VIEW)[2] == 1.0
    assert OTHER_VIEWS not in followed.scores


def test_without_depth_the_baselines_say_so(sequence: Sequence) -> None:
    blind = replace(sequence, views=tuple(replace(view, depth_m=None) for view in sequence.views))
    with pytest.raises(InputError, match=r"no depth\.npy"):
        still(blind)
