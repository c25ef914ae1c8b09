"""Hard limits of routes, checked at four times their time resolution by code that the optimiser does not use."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.interpolate import CubicSpline
from scipy.ndimage import map_coordinates

from perpetua.navigation.types import NavGrid
from perpetua.routes.config import RoutesConfig

TIME_RESOLUTION = 4
# Slower than this an actor may shift its weight in any direction.
STEPPING_MPS = 0.35
MAX_SIDESTEP_RAD = 0.7


@dataclass(frozen=True)
class TimedPaths:
    """Paths of all actors at equal time steps."""

    position_m: Float64[np.ndarray, "A T 2"]
    heading_rad: Float64[np.ndarray, "A T"]
    step_s: float

    def finer(self) -> "TimedPaths":
        """The same motion at ``TIME_RESOLUTION`` times the rate, by cubic splines."""
        steps = self.position_m.shape[1]
        times = np.arange(steps)
        fine_times = np.arange((steps - 1) * TIME_RESOLUTION + 1) / TIME_RESOLUTION
        position_m = CubicSpline(times, self.position_m, axis=1)(fine_times)
        heading_rad = CubicSpline(times, self.heading_rad, axis=1)(fine_times)
        return TimedPaths(position_m, heading_rad, self.step_s / TIME_RESOLUTION)


@dataclass(frozen=True)
class Violation:
    """The worst breach of one rule by one actor; ``step`` counts steps of the checked paths, before refinement."""

    rule: str
    actor: int
    step: float
    value: float
    limit: float
    place_m: tuple[float, float]
    other: int | None = None


def find_violations(paths: TimedPaths, grid: NavGrid, config: RoutesConfig) -> list[Violation]:
    """Every rule that an actor's path breaks; empty if the routes may be used."""
    fine = paths.finer()
    speed_mps = np.linalg.norm(np.diff(fine.position_m, axis=1), axis=2) / fine.step_s
    acceleration_mps2 = np.linalg.norm(np.diff(fine.position_m, n=2, axis=1), axis=2) / fine.step_s**2
    turn_rate_radps = np.abs(np.diff(fine.heading_rad, axis=1)) / fine.step_s
    violations: list[Violation] = []
    for actor in range(len(fine.position_m)):
        place_m = fine.position_m[actor]
        clearance_m = clearance_at(grid, place_m)
        violations += _worst("clearance", actor, place_m, -clearance_m, -required_clearance_m(grid))
        violations += _worst("speed", actor, place_m, speed_mps[actor], config.max_speed_mps)
        violations += _worst("acceleration", actor, place_m, acceleration_mps2[actor], config.max_acceleration_mps2)
        violations += _worst("turn rate", actor, place_m, turn_rate_radps[actor], config.max_turn_rate_radps)
        violations += _worst("sidestep", actor, place_m, _sidestep_rad(fine, actor), MAX_SIDESTEP_RAD)
        for other in range(actor):
            distance_m = np.linalg.norm(place_m - fine.position_m[other], axis=1)
            violations += _worst("separation", actor, place_m, -distance_m, -config.separation_m, other=other)
    return violations


def _worst(
    rule: str,
    actor: int,
    place_m: Float64[np.ndarray, "T 2"],
    values: Float64[np.ndarray, " S"],
    limit: float,
    other: int | None = None,
) -> list[Violation]:
    worst = int(values.argmax())
    if values[worst] <= limit:
        return []
    x, y = place_m[worst]
    place = (float(x), float(y))
    return [Violation(rule, actor, worst / TIME_RESOLUTION, abs(float(values[worst])), abs(limit), place, other)]


def _sidestep_rad(paths: TimedPaths, actor: int) -> Float64[np.ndarray, " S"]:
    """The angle between heading and motion wherever an actor walks."""
    velocity = np.diff(paths.position_m[actor], axis=0) / paths.step_s
    heading_rad = 0.5 * (paths.heading_rad[actor, 1:] + paths.heading_rad[actor, :-1])
    angle = np.angle(np.exp(1j * (np.arctan2(velocity[:, 1], velocity[:, 0]) - heading_rad)))
    return np.where(np.linalg.norm(velocity, axis=1) > STEPPING_MPS, np.abs(angle), 0.0)


def clearance_at(grid: NavGrid, place_m: Float64[np.ndarray, "T 2"]) -> Float64[np.ndarray, " T"]:
    """Distance to the nearest obstacle, between the cells' centres; 0 outside the grid."""
    place = ((place_m - grid.origin_m) / grid.cell_m).T
    return map_coordinates(grid.clearance_m.astype(np.float64), place, order=1, mode="constant", cval=0.0)


def required_clearance_m(grid: NavGrid) -> float:
    """The least clearance of any free cell: the body radius that the grid was made for, rounded up to its cells."""
    return float(grid.clearance_m[grid.free].min())
