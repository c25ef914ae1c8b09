"""What is counted of a sequence, and in which bins. Counts of sequences add up to those of a data set."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Int64

INFINITE = float("inf")
# Edges of the bins; a value on an edge belongs to the bin above it. The last bin is open where it ends in infinity.
TRAVEL_M = (0.0, 0.05, 0.2, 0.5, 1.0, 2.0, INFINITE)
SPEED_MPS = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0, INFINITE)
SEEN_FRACTION = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
DEPTH_M = (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, INFINITE)
FIELD_OF_VIEW_DEG = (20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0, 110.0, 120.0)
APART_DEG = (0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 120.0, 140.0, 160.0, 180.0)
HEIGHT_CM = (140.0, 150.0, 155.0, 160.0, 165.0, 170.0, 175.0, 180.0, 185.0, 190.0, 200.0)
# Counted one by one up to this many, and together from there on.
MOST_OCCLUSIONS = 8
MOST_VIEWS = 8


@dataclass(frozen=True)
class Counts:
    """How often each bin occurs.

    ``travel``: tracks by how far they get from where they were first. ``speed``: moving tracks at each frame.
    ``seeing_views``: tracks at each frame by how many views see them. ``seen_fraction``: tracks by the fraction of
    frames in which a view sees them. ``occlusions``: tracks in each view that sees them, by how often they are
    hidden there.
    ``depth``: pixels with a surface, a sample. ``field_of_view``: views, across the image. ``apart``: pairs of views
    at a sample of frames, by the angle between their optical axes.
    """

    travel: Int64[np.ndarray, " _"]
    speed: Int64[np.ndarray, " _"]
    seeing_views: Int64[np.ndarray, " _"]
    seen_fraction: Int64[np.ndarray, " _"]
    occlusions: Int64[np.ndarray, " _"]
    depth: Int64[np.ndarray, " _"]
    field_of_view: Int64[np.ndarray, " _"]
    apart: Int64[np.ndarray, " _"]

    def __add__(self, other: "Counts") -> "Counts":
        return Counts(*(getattr(self, field.name) + getattr(other, field.name) for field in fields(self)))


def binned(values: np.ndarray, edges: tuple[float, ...]) -> Int64[np.ndarray, " _"]:
    """How many values fall into each bin; values outside count in the first or last bin, NaN in none."""
    known = np.asarray(values, np.float64).ravel()
    known = known[~np.isnan(known)]
    places = np.searchsorted(np.array(edges[1:-1]), known, side="right")
    return np.bincount(places, minlength=len(edges) - 1).astype(np.int64)


def counted(values: np.ndarray, most: int) -> Int64[np.ndarray, " _"]:
    """How often 0, 1, ... ``most`` occur; larger values count as ``most``."""
    return np.bincount(np.minimum(np.asarray(values, np.int64).ravel(), most), minlength=most + 1).astype(np.int64)
