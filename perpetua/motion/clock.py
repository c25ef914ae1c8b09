"""Fine, evenly spaced times that motion is planned at; the frames are among them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

FINE_HZ = 120.0
# Filters over time see this much of what comes before the first and after the last frame.
MARGIN_S = 0.8


@dataclass(frozen=True)
class Clock:
    """Evenly spaced times around the frames: ``step_s`` apart; ``at_frames`` picks the frames among them."""

    fps: float
    time_s: Float64[np.ndarray, " N"]
    step_s: float
    at_frames: slice


def make_clock(frames: int, fps: float, before_s: float = MARGIN_S, after_s: float = MARGIN_S) -> Clock:
    """A fine clock that ticks at every frame, from ``before_s`` before the first to ``after_s`` after the last."""
    fine = max(1, int(np.ceil(FINE_HZ / fps)))
    before, after = (int(np.ceil(margin_s * fps - 1e-6)) * fine for margin_s in (before_s, after_s))
    count = (frames - 1) * fine + 1
    time_s = (np.arange(before + count + after) - before) / (fps * fine)
    return Clock(fps, time_s, 1.0 / (fps * fine), slice(before, before + count, fine))
