"""Random walks on the navigation grid: where a person might wander, pause and look in a room.

A walk is a chain of geodesic legs between targets. Targets are drawn on floor that has been visited little, without
sharp turns on the way; now and then a person stops for a moment beside furniture and looks at it.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64, Int64
from scipy import ndimage, sparse
from scipy.sparse import csgraph
from scipy.spatial import KDTree

from perpetua.navigation.types import NavGrid

CANDIDATES = 16
NOVELTY_M = 1.5
MIN_LEG_M = 1.2
SHARP_TURN_RAD = 1.9
ACCELERATION_MPS2 = 1.2
# Curves are taken so slowly that a person turns no faster than this.
TURN_RATE_RADPS = 1.8
PATH_STEP_M = 0.04
PATH_SMOOTHING_M = 0.22
HEADING_SMOOTHING_S = 0.15
# Turns start and end gently.
SETTLING_S = 0.3


@dataclass(frozen=True)
class Pace:
    """How a person wanders: typical speed, and how often a target is a place to stop at."""

    speed_mps: float
    stop_share: float


@dataclass(frozen=True)
class Walk:
    """A walk at equal time steps: place and heading (about +Z, 0 faces +X, unwrapped)."""

    position_m: Float64[np.ndarray, "T 2"]
    heading_rad: Float64[np.ndarray, " T"]


@dataclass(frozen=True)
class _Stop:
    """A pause at a distance along a path: turning to what there is to see, looking at it, turning to go on."""

    at_m: float
    arrival_rad: float
    facing_rad: float
    departure_rad: float
    looking_s: float

    @property
    def turning_s(self) -> tuple[float, float]:
        """Seconds of the turns before and after looking."""
        before_rad = _angle_between(self.arrival_rad, self.facing_rad)
        after_rad = _angle_between(self.facing_rad, self.departure_rad)
        return before_rad / TURN_RATE_RADPS + SETTLING_S, after_rad / TURN_RATE_RADPS + SETTLING_S

    @property
    def seconds(self) -> float:
        """Length of the pause."""
        return self.looking_s + sum(self.turning_s)


class WalkableFloor:
    """The free cells of a grid as a graph, in which a step costs its length, and more close to obstacles."""

    def __init__(self, grid: NavGrid) -> None:
        self.grid = grid
        cells = np.argwhere(grid.free)
        self.points_m: Float64[np.ndarray, "N 2"] = grid.origin_m + grid.cell_m * cells
        self.clearance_m = grid.clearance_m[grid.free].astype(np.float64)
        self._graph = self._make_graph()
        gradient = np.gradient(ndimage.gaussian_filter(grid.clearance_m.astype(np.float64), 2.0))
        self._uphill: Float64[np.ndarray, "N 2"] = np.stack([axis[grid.free] for axis in gradient], axis=1)

    def _make_graph(self) -> sparse.csr_array:
        number = np.full(self.grid.free.shape, -1)
        number[self.grid.free] = np.arange(len(self.points_m))
        starts, ends, costs = [], [], []
        tightest_m = float(self.clearance_m.min())
        for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
            width, depth = number.shape
            here = number[: width - dx, max(0, -dy) : depth - max(0, dy)].ravel()
            there = number[dx:, max(0, dy) : depth + min(0, dy)].ravel()
            both = (here >= 0) & (there >= 0)
            here, there = here[both], there[both]
            room_m = np.minimum(self.clearance_m[here], self.clearance_m[there]) - tightest_m
            starts.append(here)
            ends.append(there)
            costs.append(self.grid.cell_m * np.hypot(dx, dy) * (1.0 + np.exp(-room_m / 0.15)))
        pairs = (np.concatenate(starts), np.concatenate(ends))
        return sparse.csr_array((np.concatenate(costs), pairs), shape=(len(self.points_m),) * 2)

    def nearest(self, point_m: Float64[np.ndarray, "2"]) -> int:
        """The free cell nearest to a point."""
        return int(((self.points_m - point_m) ** 2).sum(1).argmin())

    def paths_from(self, cell: int) -> tuple[Float64[np.ndarray, " N"], Int64[np.ndarray, " N"]]:
        """Geodesic cost from a cell to all others, and each one's predecessor on the way."""
        cost, before = csgraph.dijkstra(self._graph, directed=False, indices=cell, return_predecessors=True)
        return cost, before.astype(np.int64)

    def facing_obstacle_rad(self, cell: int) -> float:
        """The direction of the nearest obstacle."""
        x, y = -self._uphill[cell]
        return float(np.arctan2(y, x))


def random_walk(
    floor: WalkableFloor,
    rng: np.random.Generator,
    pace: Pace,
    steps: int,
    step_s: float,
    start_m: Float64[np.ndarray, "2"],
) -> Walk:
    """A walk from a place on the floor.

    Args:
        floor: where the walk stays.
        rng: all randomness.
        pace: typical speed and share of stops.
        steps: places of the walk.
        step_s: seconds between two of them.
        start_m: where it starts; the nearest free cell is taken.
    """
    seconds = steps * step_s
    legs, stops, speeds = _wander(floor, rng, pace, seconds, floor.nearest(start_m))
    path_m, distance_m = _smooth_path(np.concatenate(legs))
    leg_ends_m = np.cumsum([_length_m(leg) for leg in legs])
    # Smoothing shortens a path a little, so places along it move in proportion.
    shrink = distance_m[-1] / max(leg_ends_m[-1], 1e-9)
    stops = [replace(stop, at_m=stop.at_m * shrink) for stop in stops]
    travelled_m, standing = _drive(distance_m, path_m, leg_ends_m * shrink, speeds, stops, steps, step_s, rng)
    position_m = np.stack([np.interp(travelled_m, distance_m, path_m[:, axis]) for axis in range(2)], axis=1)
    heading_rad = _headings(path_m, distance_m, travelled_m, standing, stops, step_s)
    return Walk(position_m, heading_rad)


def _wander(
    floor: WalkableFloor, rng: np.random.Generator, pace: Pace, seconds: float, start: int
) -> tuple[list[Float64[np.ndarray, "_ 2"]], list[_Stop], list[float]]:
    """Legs, the stops between them and the speed of each leg, long enough for the time."""
    legs: list[Float64[np.ndarray, "_ 2"]] = []
    stops: list[_Stop] = []
    speeds: list[float] = []
    here, elapsed_s, distance_m = start, 0.0, 0.0
    arrival_rad, stop_here = None, False
    # More than enough time, since smoothing shortens paths.
    while elapsed_s < 1.5 * seconds + 2.0:
        stop_next = float(rng.uniform()) < pace.stop_share
        leg = _next_leg(floor, rng, here, None if stop_here else arrival_rad, legs, stop_next)
        departure_rad = _direction(leg[:6])
        if arrival_rad is not None and stop_here:
            facing_rad = floor.facing_obstacle_rad(here)
            stops.append(_Stop(distance_m, arrival_rad, facing_rad, departure_rad, float(rng.uniform(0.5, 2.0))))
        elif arrival_rad is not None and _angle_between(arrival_rad, departure_rad) > SHARP_TURN_RAD:
            stops.append(_Stop(distance_m, arrival_rad, arrival_rad, departure_rad, 0.0))
        speeds.append(float(np.clip(rng.normal(1.0, 0.14), 0.7, 1.35)) * pace.speed_mps)
        distance_m += _length_m(leg)
        elapsed_s = distance_m / pace.speed_mps + sum(stop.seconds for stop in stops)
        legs.append(leg)
        here, arrival_rad, stop_here = floor.nearest(leg[-1]), _direction(leg[-6:]), stop_next
    return legs, stops, speeds


def _next_leg(
    floor: WalkableFloor,
    rng: np.random.Generator,
    here: int,
    direction_rad: float | None,
    legs: list[Float64[np.ndarray, "_ 2"]],
    stop_here: bool,
) -> Float64[np.ndarray, "K 2"]:
    """The best of some random targets: unvisited, far enough, ahead, and beside furniture where a stop is planned."""
    cost, before = floor.paths_from(here)
    targets = rng.integers(len(floor.points_m), size=CANDIDATES)
    visited_m = np.concatenate([leg[::4] for leg in legs]) if legs else floor.points_m[[here]]
    novelty = np.minimum(KDTree(visited_m).query(floor.points_m[targets])[0], NOVELTY_M) / NOVELTY_M
    reach = np.minimum(cost[targets], 2 * MIN_LEG_M) / (2 * MIN_LEG_M)
    scores = novelty + reach + 0.4 * rng.uniform(size=CANDIDATES)
    if stop_here:
        scores -= np.minimum(floor.clearance_m[targets] - floor.clearance_m.min(), 0.6)
    best_score, best_leg = -np.inf, None
    for target, score in zip(targets, scores, strict=True):
        leg = _leg(floor, before, here, int(target))
        if direction_rad is not None:
            score -= 0.9 * _angle_between(direction_rad, _direction(leg[:4]))
        if best_leg is None or score > best_score:
            best_score, best_leg = float(score), leg
    assert best_leg is not None
    return best_leg


def _leg(floor: WalkableFloor, before: Int64[np.ndarray, " N"], start: int, target: int) -> Float64[np.ndarray, "K 2"]:
    cells = [target]
    while cells[-1] != start:
        cells.append(int(before[cells[-1]]))
    return floor.points_m[cells[::-1]]


def _length_m(path_m: Float64[np.ndarray, "K 2"]) -> float:
    return float(np.linalg.norm(np.diff(path_m, axis=0), axis=1).sum())


def _direction(path_m: Float64[np.ndarray, "K 2"]) -> float:
    x, y = path_m[-1] - path_m[0]
    return float(np.arctan2(y, x))


def _angle_between(first_rad: float, second_rad: float) -> float:
    return abs(float(np.angle(np.exp(1j * (second_rad - first_rad)))))


def _smooth_path(path_m: Float64[np.ndarray, "K 2"]) -> tuple[Float64[np.ndarray, "L 2"], Float64[np.ndarray, " L"]]:
    """The path at equal distances, without the corners of the grid, and the distance along it."""
    moved = np.append(True, np.linalg.norm(np.diff(path_m, axis=0), axis=1) > 1e-9)
    path_m = path_m[moved]
    distance_m = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path_m, axis=0), axis=1)))
    even_m = np.linspace(0.0, distance_m[-1], max(2, int(distance_m[-1] / PATH_STEP_M)))
    even = np.stack([np.interp(even_m, distance_m, path_m[:, axis]) for axis in range(2)], axis=1)
    smooth = ndimage.gaussian_filter1d(even, PATH_SMOOTHING_M / PATH_STEP_M, axis=0, mode="nearest")
    return smooth, np.append(0.0, np.cumsum(np.linalg.norm(np.diff(smooth, axis=0), axis=1)))


def _drive(
    distance_m: Float64[np.ndarray, " L"],
    path_m: Float64[np.ndarray, "L 2"],
    leg_ends_m: Float64[np.ndarray, " G"],
    speeds: list[float],
    stops: list[_Stop],
    steps: int,
    step_s: float,
    rng: np.random.Generator,
) -> tuple[Float64[np.ndarray, " T"], Int64[np.ndarray, " T"]]:
    """Distance travelled at each step, and the number of the stop stood at, or -1."""
    limit_mps = _curve_speeds(path_m, distance_m)
    travelled_m, standing = np.zeros(steps), np.full(steps, -1)
    at_m, speed_mps, waiting_s, stop = 0.0, speeds[0], 0.0, 0
    phase = float(rng.uniform(0.0, 2 * np.pi))
    for step in range(steps):
        travelled_m[step] = at_m
        if waiting_s > 0.0:
            standing[step] = stop - 1
            waiting_s -= step_s
            continue
        leg = min(int(np.searchsorted(leg_ends_m, at_m)), len(speeds) - 1)
        wish_mps = speeds[leg] * (1.0 + 0.08 * np.sin(phase + 1.3 * step * step_s))
        ahead = (distance_m >= at_m) & (distance_m <= at_m + 1.2)
        braking = np.sqrt(limit_mps[ahead] ** 2 + 2 * ACCELERATION_MPS2 * (distance_m[ahead] - at_m))
        wish_mps = min(wish_mps, float(braking.min(initial=np.inf)))
        left_m = stops[stop].at_m - at_m if stop < len(stops) else np.inf
        wish_mps = min(wish_mps, float(np.sqrt(2 * ACCELERATION_MPS2 * max(left_m, 0.0))))
        change = np.clip(wish_mps - speed_mps, -2 * ACCELERATION_MPS2 * step_s, ACCELERATION_MPS2 * step_s)
        speed_mps = max(0.0, speed_mps + float(change))
        if left_m <= max(speed_mps * step_s, 0.02):
            at_m, speed_mps, waiting_s, stop = stops[stop].at_m, 0.0, stops[stop].seconds, stop + 1
        else:
            at_m += speed_mps * step_s
    return np.minimum(travelled_m, distance_m[-1]), standing


def _curve_speeds(
    path_m: Float64[np.ndarray, "L 2"], distance_m: Float64[np.ndarray, " L"]
) -> Float64[np.ndarray, " L"]:
    """The speed at which each place of a path can be passed without turning too fast."""
    direction = np.unwrap(np.arctan2(*np.gradient(path_m, axis=0).T[::-1]))
    curvature = np.abs(np.gradient(direction)) / np.maximum(np.gradient(distance_m), 1e-6)
    curvature = ndimage.gaussian_filter1d(curvature, 0.1 / PATH_STEP_M)
    return np.maximum(TURN_RATE_RADPS / np.maximum(curvature, 1e-6), 0.15)


def _headings(
    path_m: Float64[np.ndarray, "L 2"],
    distance_m: Float64[np.ndarray, " L"],
    travelled_m: Float64[np.ndarray, " T"],
    standing: Int64[np.ndarray, " T"],
    stops: list[_Stop],
    step_s: float,
) -> Float64[np.ndarray, " T"]:
    """Along the path while walking; at a stop from arrival by way of what there is to see to departure."""
    along_rad = np.unwrap(np.arctan2(*np.gradient(path_m, axis=0).T[::-1]))
    heading_rad = np.interp(travelled_m, distance_m, along_rad)
    # Close to a stop the path's own direction is about to flip.
    known = standing < 0
    for number, stop in enumerate(stops):
        known &= np.abs(travelled_m - stop.at_m) > PATH_SMOOTHING_M
        steps = np.flatnonzero(standing == number)
        if not len(steps):
            continue
        turning_s = stop.turning_s[0]
        first = steps[0] + np.array([0, round(turning_s / step_s), round((turning_s + stop.looking_s) / step_s)])
        for start, end, direction_rad in (
            (first[0] - 1, first[0], stop.arrival_rad),
            (first[1], first[2], stop.facing_rad),
            (steps[0] + round(stop.seconds / step_s), None, stop.departure_rad),
        ):
            place = slice(max(start, 0), (start + 1) if end is None else max(end, start + 1))
            heading_rad[place] = direction_rad
            known[place] = True
    if not known.any():
        return np.full(len(heading_rad), heading_rad[0])
    steps = np.arange(len(heading_rad))
    filled_rad = np.interp(steps, steps[known], np.unwrap(heading_rad[known]))
    return ndimage.gaussian_filter1d(filled_rad, HEADING_SMOOTHING_S / step_s, mode="nearest")
