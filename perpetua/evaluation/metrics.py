"""Scores of predicted tracks: counts of entries, the scores that follow from them, and alignments.

An entry is a point of one track at one frame (and, where there are several, in one view). The definitions are those of
TAPVid-3D (Koppula et al. 2024, ``tapnet/tapvid3d/evaluation/metrics.py``), stated here because they decide every
figure:

- A position is right at a threshold where its distance to the truth is less than the threshold, strictly. Thresholds
  are 1, 2, 4, 8 and 16 pixels wide at the point: that many times Z / f, Z being the true depth and f the geometric mean
  of fx and fy.
- Position accuracy: of the entries that are truly visible, the fraction with a right position, whether or not they were
  predicted visible; averaged over the thresholds (APD).
- Occlusion accuracy: of all entries, the fraction whose visibility was predicted right.
- Jaccard: true positives (truly visible, predicted visible, position right) over truly visible entries plus false
  positives (predicted visible, and hidden or not right); averaged over the thresholds (AJ).

Not settled there, and settled here: where no finite position is given (or one beyond 1e100), the prediction is
missing. Its position is never right, its visibility counts as wrong whatever it is, and in Jaccard it is a miss but no
false positive.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float64, Int64

THRESHOLDS_PX = (1, 2, 4, 8, 16)
# Larger numbers are not taken for positions: their squares overflow.
FARTHEST = 1e100
# Singular values that differ by more than this factor belong to points on a line or in one place.
LEAST_SPREAD = 1e-9


@dataclass(frozen=True)
class Scores:
    """Fractions between 0 and 1: one for each of ``THRESHOLDS_PX`` in ``jaccard`` and ``position_accuracy``, and the
    averages over them."""

    average_jaccard: float
    average_position_accuracy: float
    occlusion_accuracy: float
    jaccard: tuple[float, ...]
    position_accuracy: tuple[float, ...]


@dataclass(frozen=True)
class Tally:
    """Counts of entries; those of several views or tracks add up. One count per threshold where it depends on it."""

    entries: int
    occlusion_right: int
    visible: int
    position_right: Int64[np.ndarray, " D"]
    true_positives: Int64[np.ndarray, " D"]
    false_positives: Int64[np.ndarray, " D"]

    def __add__(self, other: "Tally") -> "Tally":
        return Tally(
            self.entries + other.entries,
            self.occlusion_right + other.occlusion_right,
            self.visible + other.visible,
            self.position_right + other.position_right,
            self.true_positives + other.true_positives,
            self.false_positives + other.false_positives,
        )

    def scores(self) -> Scores | None:
        """The scores of these counts; None where no entry is truly visible."""
        if self.visible == 0:
            return None
        jaccard = self.true_positives / (self.visible + self.false_positives)
        position = self.position_right / self.visible
        return Scores(
            average_jaccard=float(jaccard.mean()),
            average_position_accuracy=float(position.mean()),
            occlusion_accuracy=self.occlusion_right / self.entries,
            jaccard=tuple(jaccard.tolist()),
            position_accuracy=tuple(position.tolist()),
        )


def tally_entries(
    true_m: Float[np.ndarray, "*entries 3"],
    truly_visible: Bool[np.ndarray, "*entries"],
    predicted_m: Float[np.ndarray, "*entries 3"],
    predicted_visible: Bool[np.ndarray, "*entries"],
    pixel_m: Float[np.ndarray, "*#entries"],
    counted: Bool[np.ndarray, "*entries"],
) -> Tally:
    """Counts entries by the rules of this module.

    Args:
        true_m: true positions, metres.
        truly_visible: whether each is visible.
        predicted_m: predicted positions in the same frame and scale; not finite where a prediction is missing.
        predicted_visible: whether each is predicted to be visible.
        pixel_m: how wide one pixel is at each entry, Z / f in metres.
        counted: the entries that take part; what the others hold is ignored.
    """
    given = are_given(predicted_m)
    claimed = predicted_visible & given
    offset_m = np.where(given[..., None], np.asarray(predicted_m, np.float64) - np.asarray(true_m, np.float64), 0.0)
    apart_m = np.linalg.norm(offset_m, axis=-1)
    near = [given & (apart_m < width_px * np.asarray(pixel_m, np.float64)) for width_px in THRESHOLDS_PX]
    return Tally(
        entries=int(counted.sum()),
        occlusion_right=int((counted & given & (predicted_visible == truly_visible)).sum()),
        visible=int((counted & truly_visible).sum()),
        position_right=_counts(counted & truly_visible & right for right in near),
        true_positives=_counts(counted & truly_visible & claimed & right for right in near),
        false_positives=_counts(counted & claimed & ~(truly_visible & right) for right in near),
    )


def _counts(chosen: Iterable[Bool[np.ndarray, "*entries"]]) -> Int64[np.ndarray, " D"]:
    return np.array([int(entries.sum()) for entries in chosen], np.int64)


def are_given(points: Float[np.ndarray, "*batch 3"]) -> Bool[np.ndarray, "*batch"]:
    """Whether points are given: all coordinates finite and below ``FARTHEST``."""
    return np.asarray((np.abs(points.astype(np.float64)) < FARTHEST).all(axis=-1))


def median_scale(true_m: Float[np.ndarray, "N 3"], predicted_m: Float[np.ndarray, "N 3"]) -> float:
    """The factor that makes the median distance of predicted points from the origin that of the true ones.

    Points that are missing on one side are left out on both. Without any, or where all predictions lie on the
    origin, there is nothing to scale by, and the factor is 1.
    """
    given = are_given(predicted_m) & are_given(true_m)
    if not given.any():
        return 1.0
    true_distance_m = np.median(np.linalg.norm(np.asarray(true_m[given], np.float64), axis=1))
    predicted_distance_m = np.median(np.linalg.norm(np.asarray(predicted_m[given], np.float64), axis=1))
    return float(true_distance_m / predicted_distance_m) if predicted_distance_m > 1.0 / FARTHEST else 1.0


@dataclass(frozen=True)
class Similarity:
    """Scale, rotation and shift, in this order: a member of Sim(3)."""

    scale: float
    rotation: Float64[np.ndarray, "3 3"]
    shift_m: Float64[np.ndarray, "3"]

    def apply(self, points_m: Float[np.ndarray, "*batch 3"]) -> Float64[np.ndarray, "*batch 3"]:
        """Points after the transform."""
        return np.asarray(self.scale * (np.asarray(points_m, np.float64) @ self.rotation.T) + self.shift_m)


def fit_similarity(true_m: Float[np.ndarray, "N 3"], predicted_m: Float[np.ndarray, "N 3"]) -> Similarity | None:
    """The transform of predicted points that comes closest to the true ones in least squares, without reflection.

    Source: S. Umeyama, "Least-squares estimation of transformation parameters between two point patterns", PAMI 1991.

    Returns:
        None where fewer than three points are given, or all on one line: then rotation is open.
    """
    given = are_given(predicted_m) & are_given(true_m)
    true, predicted = np.asarray(true_m[given], np.float64), np.asarray(predicted_m[given], np.float64)
    if len(true) < 3:
        return None
    true_middle, predicted_middle = true.mean(axis=0), predicted.mean(axis=0)
    true, predicted = true - true_middle, predicted - predicted_middle
    for cloud in (true, predicted):
        spread = np.linalg.svd(cloud, compute_uv=False)
        if spread[1] <= LEAST_SPREAD * spread[0]:
            return None
    left, stretch, right = np.linalg.svd(true.T @ predicted)
    upright = np.array([1.0, 1.0, np.sign(np.linalg.det(left) * np.linalg.det(right))])
    rotation = (left * upright) @ right
    scale = float((stretch * upright).sum() / (predicted**2).sum())
    return Similarity(scale, rotation, true_middle - scale * rotation @ predicted_middle)
