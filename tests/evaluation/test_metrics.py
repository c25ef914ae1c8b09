"""Scores worked out by hand."""

import numpy as np
import pytest

from perpetua.evaluation.metrics import (
    THRESHOLDS_PX,
    Scores,
    Similarity,
    Tally,
    fit_similarity,
    median_scale,
    tally_entries,
)

NAN = [np.nan, np.nan, np.nan]


def _tally(off: list[float], truly: list[bool], predicted: list[bool], pixel_m: float = 0.01) -> Tally:
    """Entries of a point at 5 m whose predictions are so many metres off; NaN for a missing prediction."""
    true_m = np.tile([0.0, 0.0, 5.0], (len(off), 1))
    predicted_m = true_m + np.array(off)[:, None] * [0.6, 0.0, 0.8]
    width_m = np.full(len(off), pixel_m)
    return tally_entries(true_m, np.array(truly), predicted_m, np.array(predicted), width_m, np.ones(len(off), bool))


def _scores(tally: Tally) -> Scores:
    scores = tally.scores()
    assert scores is not None
    return scores


def test_thresholds_are_those_of_the_benchmark() -> None:
    assert THRESHOLDS_PX == (1, 2, 4, 8, 16)


def test_four_entries_worked_by_hand() -> None:
    # One pixel is 10 mm. Off by 15 mm and seen; by 30 mm, seen but called hidden; by 0, hidden but called seen; by 0,
    # hidden and called so.
    scores = _scores(_tally([0.015, 0.030, 0.0, 0.0], [True, True, False, False], [True, False, True, False]))
    assert scores.occlusion_accuracy == 0.5
    # Right within 1, 2, 4, 8, 16 pixels, of two visible entries: none, the first, both, both, both.
    assert scores.position_accuracy == (0.0, 0.5, 1.0, 1.0, 1.0)
    assert scores.average_position_accuracy == pytest.approx(3.5 / 5)
    # At 1 pixel no true positive; from 2 pixels on the first entry is one, the third a false positive: 1 / (2 + 1).
    assert scores.jaccard == pytest.approx((0.0, 1 / 3, 1 / 3, 1 / 3, 1 / 3))
    assert scores.average_jaccard == pytest.approx(4 / 15)


def test_a_wrong_position_called_visible_is_a_miss_and_a_false_positive() -> None:
    scores = _scores(_tally([0.0, 9.0], [True, True], [True, True]))
    assert scores.position_accuracy == (0.5,) * 5
    assert scores.jaccard == pytest.approx((1 / 3,) * 5)
    assert scores.occlusion_accuracy == 1.0


def test_the_threshold_itself_is_outside() -> None:
    true_m, visible = np.zeros((2, 3)), np.ones(2, bool)
    predicted_m = np.array([[0.25, 0.0, 0.0], [0.2499999, 0.0, 0.0]])
    tally = tally_entries(true_m, visible, predicted_m, visible, np.full(2, 0.25), visible)
    assert tally.position_right.tolist() == [1, 2, 2, 2, 2]


def test_a_missing_prediction_fails_in_all_three_and_claims_nothing() -> None:
    for claim in (True, False):
        for truly in (True, False):
            tally = _tally([0.0, np.nan], [True, truly], [True, claim])
            assert tally.occlusion_right == 1
            assert tally.position_right.tolist() == [1] * 5
            assert tally.false_positives.tolist() == [0] * 5
    scores = _scores(_tally([0.0, np.nan], [True, True], [True, True]))
    assert (scores.average_jaccard, scores.average_position_accuracy, scores.occlusion_accuracy) == (0.5, 0.5, 0.5)


def test_infinite_and_huge_positions_are_failures_not_errors() -> None:
    true_m, visible = np.zeros((3, 3)), np.ones(3, bool)
    predicted_m = np.array([[np.inf, 0.0, 0.0], [1e300, -np.inf, 0.0], [1e90, -1e90, 0.0]])
    tally = tally_entries(true_m, visible, predicted_m, visible, np.full(3, 0.01), visible)
    assert tally.position_right.tolist() == [0] * 5
    assert tally.occlusion_right == 1, "the last one is a position, if a bold one"


def test_entries_that_do_not_count_change_nothing() -> None:
    true_m = np.zeros((3, 3))
    visible, counted = np.array([True, True, False]), np.array([True, False, False])
    wild_m = np.array([[0.0, 0.0, 0.0], NAN, [7.0, 7.0, 7.0]])
    tally = tally_entries(true_m, visible, wild_m, np.array([True, True, True]), np.full(3, 0.01), counted)
    assert (tally.entries, tally.visible, tally.occlusion_right) == (1, 1, 1)
    assert _scores(tally).average_jaccard == 1.0


def test_tallies_of_parts_add_up_to_that_of_the_whole() -> None:
    rng = np.random.default_rng(3)
    off = rng.uniform(0.0, 0.2, 60).tolist()
    truly, predicted = (rng.random(60) < 0.6).tolist(), (rng.random(60) < 0.6).tolist()
    whole = _tally(off, truly, predicted)
    parts = _tally(off[:23], truly[:23], predicted[:23]) + _tally(off[23:], truly[23:], predicted[23:])
    assert _scores(parts) == _scores(whole)
    assert 0.0 < _scores(whole).average_jaccard < _scores(whole).average_position_accuracy < 1.0


def test_nothing_visible_gives_no_scores() -> None:
    assert _tally([0.0], [False], [False]).scores() is None


def test_median_scale_by_hand() -> None:
    # True distances 2, 4, 5 (median 4), predicted 1, 10, 8 (median 8); the missing one counts on neither side.
    true_m = np.array([[2.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 3.0, 4.0], [99.0, 0.0, 0.0]])
    predicted_m = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 10.0], [0.0, 8.0, 0.0], NAN])
    assert median_scale(true_m, predicted_m) == 0.5


def test_without_a_scale_to_find_the_factor_is_one() -> None:
    true_m = np.ones((2, 3))
    assert median_scale(true_m, np.full((2, 3), np.nan)) == 1.0
    assert median_scale(true_m, np.zeros((2, 3))) == 1.0
    assert median_scale(true_m, np.full((2, 3), 5e-324)) == 1.0


def _turn(angle_rad: float) -> np.ndarray:
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def test_similarity_of_a_turned_square_by_hand() -> None:
    # A unit square, made from one of side 2 by a quarter turn (x to y), half the size, and a shift by (3, 0, 1).
    predicted_m = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]])
    true_m = np.array([[3.0, 0.0, 1.0], [3.0, 1.0, 1.0], [2.0, 1.0, 1.0], [2.0, 0.0, 1.0]])
    found = fit_similarity(true_m, predicted_m)
    assert found is not None
    assert found.scale == pytest.approx(0.5)
    assert np.allclose(found.rotation, [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    assert np.allclose(found.shift_m, [3.0, 0.0, 1.0])
    assert np.allclose(found.apply(predicted_m), true_m)


def test_similarity_undoes_any_similarity_and_passes_over_missing_points() -> None:
    rng = np.random.default_rng(4)
    true_m = rng.normal(size=(40, 3))
    planted = Similarity(2.5, _turn(0.7) @ _turn(1.1)[[2, 0, 1]], np.array([4.0, -2.0, 9.0]))
    predicted_m = planted.apply(true_m)
    predicted_m[3] = np.nan
    found = fit_similarity(true_m, predicted_m)
    assert found is not None
    assert found.scale == pytest.approx(1 / 2.5)
    back_m = np.delete(found.apply(predicted_m), 3, axis=0)
    assert np.allclose(back_m, np.delete(true_m, 3, axis=0), atol=1e-12)


def test_similarity_never_mirrors() -> None:
    true_m = np.random.default_rng(5).normal(size=(30, 3))
    found = fit_similarity(true_m, true_m * [1.0, 1.0, -1.0])
    assert found is not None
    assert np.linalg.det(found.rotation) == pytest.approx(1.0)
    assert not np.allclose(found.apply(true_m * [1.0, 1.0, -1.0]), true_m, atol=0.1)


@pytest.mark.parametrize(
    "points_m",
    [
        np.eye(3)[:2],
        np.linspace(0.0, 1.0, 9)[:, None] * [1.0, 2.0, 3.0],
        np.ones((9, 3)),
        np.full((9, 3), np.nan),
        np.eye(3) * 1e300,
    ],
    ids=["two points", "a line", "one place", "missing", "overflowing"],
)
def test_geometry_that_leaves_rotation_open_gives_none(points_m: np.ndarray) -> None:
    true_m = np.random.default_rng(6).normal(size=(len(points_m), 3))
    assert fit_similarity(true_m, points_m) is None
