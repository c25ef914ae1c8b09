"""The reference trajectory: where a route has a body be, at fine times."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.ndimage import gaussian_filter1d

from perpetua.motion.clock import Clock
from perpetua.motion.path import RoutePath
from perpetua.motion.recorded.retargeted import TURN_RADIUS_M, RetargetedClip


@dataclass(frozen=True)
class ReferenceTrajectory:
    """Where a body has to be at each time of a clock.

    ``velocity_mps`` is along the heading and to its left; ``speed_mps`` counts turns on the spot.
    """

    place_m: Float64[np.ndarray, "N 3"]
    heading_rad: Float64[np.ndarray, " N"]
    velocity_mps: Float64[np.ndarray, "N 2"]
    speed_mps: Float64[np.ndarray, " N"]


def reference_along(path: RoutePath, clock: Clock) -> ReferenceTrajectory:
    """A route at the times of a clock; its speed counts turns on the spot."""
    return _reference(path, clock, path.heading_rad(clock.time_s))


def reference_facing(
    path: RoutePath, clock: Clock, clip: RetargetedClip, row: Float64[np.ndarray, " N"]
) -> ReferenceTrajectory:
    """A route at the times of a clock, facing as the clip does at the row of each."""
    row = np.clip(row, 0.0, len(clip) - 1.0)
    return _reference(path, clock, np.interp(row, np.arange(len(clip)), clip.heading_rad))


def _reference(path: RoutePath, clock: Clock, heading_rad: Float64[np.ndarray, " N"]) -> ReferenceTrajectory:
    place_m = path.position_m(clock.time_s)
    soft_m = gaussian_filter1d(place_m[:, :2], 0.08 / clock.step_s, axis=0, mode="nearest")
    world_mps = np.gradient(soft_m, clock.step_s, axis=0)
    ahead, aside = np.cos(heading_rad), np.sin(heading_rad)
    velocity_mps = np.stack(
        [ahead * world_mps[:, 0] + aside * world_mps[:, 1], ahead * world_mps[:, 1] - aside * world_mps[:, 0]], axis=1
    )
    turn_rps = path.turn_rps(clock.time_s)
    speed_mps = np.hypot(np.linalg.norm(velocity_mps, axis=1), TURN_RADIUS_M * turn_rps)
    return ReferenceTrajectory(place_m, heading_rad, velocity_mps, speed_mps)
