"""How far points move."""

import numpy as np
from jaxtyping import Bool, Float64

MOVING_M = 0.05
# What moves farther than this within so many frames is fast.
FAST_M, FAST_FRAMES = 2.0, 24


def travel_m(position_m: Float64[np.ndarray, "T N 3"], block: int = 256) -> Float64[np.ndarray, " N"]:
    """The largest distance between a point's positions at any two frames, exact above and below ``MOVING_M``.

    The distance from the first frame bounds it within a factor of two, so only points between the bounds are compared
    frame by frame.
    """
    reach_m = np.linalg.norm(position_m - position_m[:1], axis=2).max(axis=0)
    unclear = np.flatnonzero((reach_m <= MOVING_M) & (2.0 * reach_m > MOVING_M))
    for start in range(0, len(unclear), block):
        chosen = unclear[start : start + block]
        track_m = position_m[:, chosen]
        for frame in range(1, len(position_m)):
            apart_m = np.linalg.norm(track_m[frame:] - track_m[frame - 1], axis=2).max(axis=0)
            reach_m[chosen] = np.maximum(reach_m[chosen], apart_m)
    return np.asarray(reach_m)


def is_fast(position_m: Float64[np.ndarray, "T N 3"], reach_m: Float64[np.ndarray, " N"]) -> Bool[np.ndarray, " N"]:
    """Whether points move more than ``FAST_M`` between two frames at most ``FAST_FRAMES`` apart.

    ``reach_m``, what ``travel_m`` gives, rules most of them out.
    """
    fast = np.zeros(position_m.shape[1], bool)
    far = np.flatnonzero(2.0 * reach_m > FAST_M)
    far_m = position_m[:, far]
    for gap in range(1, min(FAST_FRAMES, len(position_m) - 1) + 1):
        fast[far] |= np.linalg.norm(far_m[gap:] - far_m[:-gap], axis=2).max(axis=0) > FAST_M
    return fast
