"""A route as functions of time."""

import numpy as np
from jaxtyping import Float64
from scipy.interpolate import make_interp_spline
from scipy.ndimage import gaussian_filter1d

from perpetua.motion.rotations import smoothstep
from perpetua.scene.actor import Route

# Feet are planned this long before the first and after the last frame, so that both fall amid a step.
MARGIN_S = 4.0
_GRID_HZ = 100.0
_END_VELOCITY_S = 0.25
# People change from walking to running about here.
_RUN_FROM_MPS, _RUN_FULLY_MPS = 1.85, 2.2


class RoutePath:
    """Position and heading at any time; outside the route's frames the body goes on at its last velocity."""

    def __init__(self, route: Route, fps: float) -> None:
        frames = len(route.heading_rad)
        self.end_s = (frames - 1) / fps
        self._fps = fps
        self._knots = np.column_stack([route.position_m, np.unwrap(route.heading_rad)])
        degree = min(3, frames - 1)
        self._spline = make_interp_spline(np.arange(frames) / fps, self._knots, k=degree) if degree > 0 else None
        back = min(frames - 1, max(1, round(_END_VELOCITY_S * fps)))
        self._end_velocity = np.zeros((2, 4))
        if back > 0:
            self._end_velocity[0] = (self._knots[back] - self._knots[0]) * fps / back
            self._end_velocity[1] = (self._knots[-1] - self._knots[-1 - back]) * fps / back
        # Where the body was heading and how high it stood beyond the ends is anybody's guess: they stay.
        self._end_velocity[:, 2:] = 0.0
        self._tabulate()

    def _tabulate(self) -> None:
        self._grid_s = np.arange(-MARGIN_S, self.end_s + MARGIN_S, 1.0 / _GRID_HZ)
        raw = self._evaluate(self._grid_s)
        rate = np.gradient(raw, self._grid_s, axis=0)
        self._speed_mps = gaussian_filter1d(np.hypot(rate[:, 0], rate[:, 1]), 0.12 * _GRID_HZ)
        self._turn_rps = gaussian_filter1d(np.abs(rate[:, 3]), 0.15 * _GRID_HZ)
        heading_rad = raw[:, 3] + _turn_to_travel_rad(rate[:, :2], self._speed_mps, raw[:, 3])
        # A pelvis turns softly: the route's heading may have corners.
        self._heading_rad = gaussian_filter1d(heading_rad, 0.1 * _GRID_HZ, mode="nearest")
        velocity = np.column_stack([gaussian_filter1d(rate[:, axis], 0.15 * _GRID_HZ) for axis in (0, 1)])
        self._acceleration_mps2 = np.gradient(velocity, self._grid_s, axis=0)

    def _evaluate(self, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, "N 4"]:
        inside_s = np.clip(time_s, 0.0, self.end_s)
        nearest = self._knots[np.rint(inside_s * self._fps).astype(int)]
        values = nearest if self._spline is None else self._spline(inside_s)
        # Floors have steps: a height between two frames is no height of the floor.
        values[:, 2] = nearest[:, 2]
        before_s, after_s = np.minimum(time_s, 0.0), np.maximum(time_s - self.end_s, 0.0)
        return np.asarray(values + before_s[:, None] * self._end_velocity[0] + after_s[:, None] * self._end_velocity[1])

    def position_m(self, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, "N 3"]:
        """The body axis on the floor."""
        return self._evaluate(time_s)[:, :3]

    def heading_rad(self, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
        """Heading of the body about Z, without jumps of a full turn: the route's, or the way when walking at pace."""
        return np.interp(time_s, self._grid_s, self._heading_rad)

    def speed_mps(self, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
        """Speed over the floor, smoothed over about a quarter of a second."""
        return np.interp(time_s, self._grid_s, self._speed_mps)

    def run_weight(self, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
        """From 0 (walking) to 1 (running)."""
        return smoothstep((self.speed_mps(time_s) - _RUN_FROM_MPS) / (_RUN_FULLY_MPS - _RUN_FROM_MPS))

    def stillness(self, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
        """From 0 (going or turning) to 1 (standing) at evenly spaced times."""
        still = 1.0 - np.clip((self.speed_mps(time_s) + 0.3 * self.turn_rps(time_s)) / 0.25, 0.0, 1.0)
        return np.asarray(gaussian_filter1d(still, 0.3 / (time_s[1] - time_s[0])))

    def turn_rps(self, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
        """Rate of turning, rad/s, never negative."""
        return np.interp(time_s, self._grid_s, self._turn_rps)

    def forward_acceleration_mps2(self, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
        """Acceleration along the heading."""
        ahead = self.heading_rad(time_s)
        along_x, along_y = (np.interp(time_s, self._grid_s, self._acceleration_mps2[:, axis]) for axis in (0, 1))
        return np.asarray(along_x * np.cos(ahead) + along_y * np.sin(ahead))


def _turn_to_travel_rad(
    velocity_mps: Float64[np.ndarray, "N 2"],
    speed_mps: Float64[np.ndarray, " N"],
    heading_rad: Float64[np.ndarray, " N"],
) -> Float64[np.ndarray, " N"]:
    """How far a body turns from its heading to where it goes: nobody walks obliquely, except slowly or backwards."""
    away_rad = np.arctan2(velocity_mps[:, 1], velocity_mps[:, 0]) - heading_rad
    away_rad = (away_rad + np.pi) % (2.0 * np.pi) - np.pi
    at_pace = np.clip((speed_mps - 0.35) / 0.4, 0.0, 1.0)
    forwards = np.clip((2.1 - np.abs(away_rad)) / 0.8, 0.0, 1.0)
    return at_pace * forwards * away_rad
