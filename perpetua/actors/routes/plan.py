"""Room and navigation grid -> routes of all actors."""

import logging
import math

import numpy as np
import trimesh
from jaxtyping import Float64

from perpetua.actors.casting import draw_descriptions
from perpetua.actors.config import ActorsConfig, RoutesConfig
from perpetua.actors.routes.checks import TimedPaths, Violation, find_violations
from perpetua.actors.routes.optimise import optimise_paths
from perpetua.actors.types import Route
from perpetua.errors import RouteError
from perpetua.navigation.types import NavGrid
from perpetua.navigation.walks import Pace, Walk, WalkableFloor, random_walk
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed

logger = logging.getLogger(__name__)

# Paths are planned at this rate or the sequence's, whichever is higher, and for at least this long: the motion of a
# single frame is part of a longer one.
MIN_RATE_HZ = 12.0
MIN_SECONDS = 2.0
# Of this many walks, the one that keeps clear of the other actors best is taken.
WALKS_PER_ACTOR = 6
STARTS = 48


def plan_routes(
    room: Room, grid: NavGrid, config: ActorsConfig, frames: int, fps: float, seed: StageSeed
) -> tuple[Route, ...]:
    """One route per actor, all within the hard limits of ``config.routes``.

    Each actor gets a random walk; Adam then moves all paths at once; what still breaks a limit gets another walk.

    Args:
        room: names what an actor comes too close to.
        grid: where actors can walk, for the body radius that it was made with.
        config: number of actors, limits, weights.
        frames: frames of each route.
        fps: frames per second.
        seed: all randomness comes from ``seed.stream("walk", actor, attempt)`` and ``seed.stream("actions")``.

    Raises:
        RouteError: ``config.routes.max_redraws`` further walks did not help.
    """
    refinement = max(1, math.ceil(MIN_RATE_HZ / fps))
    step_s = 1.0 / (fps * refinement)
    steps = max((frames - 1) * refinement + 1, math.ceil(MIN_SECONDS / step_s))
    paths = _feasible_paths(room, grid, config, steps, step_s, refinement, seed)
    descriptions = draw_descriptions(config.count, config.motion, seed)
    return tuple(
        _route(actor, paths, grid, frames, refinement, description) for actor, description in enumerate(descriptions)
    )


def _feasible_paths(
    room: Room, grid: NavGrid, config: ActorsConfig, steps: int, step_s: float, refinement: int, seed: StageSeed
) -> TimedPaths:
    floor = WalkableFloor(grid)
    attempts = np.zeros(config.count, int)
    walks: list[Walk] = []
    for actor in range(config.count):
        walks.append(_draw_walk(floor, config.routes, walks, steps, step_s, seed, actor, 0))
    while True:
        drawn = TimedPaths(
            np.stack([walk.position_m for walk in walks]), np.stack([walk.heading_rad for walk in walks]), step_s
        )
        paths = optimise_paths(drawn, grid, config.routes)
        violations = find_violations(paths, grid, config.routes)
        if not violations:
            return paths
        reason = _explain(violations[0], room, refinement)
        if attempts.sum() >= config.routes.max_redraws:
            raise RouteError(
                f"{reason}: lower actors.count or choose a larger room ({attempts.sum()} other walks were tried)"
            )
        for actor in sorted({violation.actor for violation in violations}):
            attempts[actor] += 1
            logger.info("%s; actor %d takes another walk", reason, actor)
            others = [walk for index, walk in enumerate(walks) if index != actor]
            walks[actor] = _draw_walk(floor, config.routes, others, steps, step_s, seed, actor, int(attempts[actor]))


def _draw_walk(
    floor: WalkableFloor,
    config: RoutesConfig,
    others: list[Walk],
    steps: int,
    step_s: float,
    seed: StageSeed,
    actor: int,
    attempt: int,
) -> Walk:
    """Of several walks the one that others' walks disturb least."""
    rng = seed.stream("walk", actor, attempt)
    pace = Pace(config.walk_speed_mps, config.stop_share)
    best_cost, best = math.inf, None
    for _ in range(WALKS_PER_ACTOR):
        walk = random_walk(floor, rng, pace, steps, step_s, _start(floor, rng, others))
        cost = _crowding(walk, others, config.separation_m) + _stillness(walk, step_s, config.walk_speed_mps)
        if best is None or cost < best_cost:
            best_cost, best = cost, walk
    assert best is not None
    return best


def _start(floor: WalkableFloor, rng: np.random.Generator, others: list[Walk]) -> Float64[np.ndarray, "2"]:
    """A random place, far from where others start."""
    places_m = floor.points_m[rng.integers(len(floor.points_m), size=STARTS)]
    if not others:
        return places_m[0]
    taken_m = np.stack([walk.position_m[0] for walk in others])
    nearest_m = np.linalg.norm(places_m[:, None] - taken_m, axis=2).min(1)
    return places_m[int((nearest_m * rng.uniform(0.6, 1.0, size=STARTS)).argmax())]


def _crowding(walk: Walk, others: list[Walk], separation_m: float) -> float:
    """How deep and how long a walk cuts into the space around others' walks; 1 for a full overlap all the time."""
    wanted_m = 1.5 * separation_m
    overlaps = [
        np.square(np.maximum(1.0 - np.linalg.norm(walk.position_m - other.position_m, axis=1) / wanted_m, 0.0)).mean()
        for other in others
    ]
    return 20.0 * float(sum(overlaps))


def _stillness(walk: Walk, step_s: float, walk_speed_mps: float) -> float:
    """How much shorter the walk is than at a steady walking speed, as a share."""
    travelled_m = np.linalg.norm(np.diff(walk.position_m, axis=0), axis=1).sum()
    return max(0.0, 1.0 - float(travelled_m) / (walk_speed_mps * step_s * len(walk.position_m)))


def _route(actor: int, paths: TimedPaths, grid: NavGrid, frames: int, refinement: int, description: str) -> Route:
    position_m = paths.position_m[actor, ::refinement][:frames]
    cells = np.round((position_m - grid.origin_m) / grid.cell_m).astype(int)
    floor_z_m = grid.floor_z_m[cells[:, 0], cells[:, 1]].astype(np.float64)
    heading_rad = paths.heading_rad[actor, ::refinement][:frames].copy()
    return Route(actor, np.column_stack([position_m, floor_z_m]), heading_rad, description)


def _explain(violation: Violation, room: Room, refinement: int) -> str:
    """The rule that a route breaks, in words a user understands."""
    frame, who = round(violation.step / refinement), f"route of actor {violation.actor}"
    value, limit = violation.value, violation.limit
    if violation.rule == "clearance":
        name = _nearest_object(room, violation.place_m)
        return f"{who} comes within {value:.2f} m of '{name}' at frame {frame}; at least {limit:.2f} m is required"
    if violation.rule == "separation":
        return (
            f"{who} comes within {value:.2f} m of actor {violation.other} at frame {frame}; "
            f"at least {limit:.2f} m is required"
        )
    if violation.rule == "sidestep":
        return f"{who} walks {value:.2f} rad off its heading at frame {frame}; at most {limit:.2f} rad is allowed"
    unit = {"speed": "m/s", "acceleration": "m/s^2", "turn rate": "rad/s"}[violation.rule]
    return f"{who} has a {violation.rule} of {value:.2f} {unit} at frame {frame}; at most {limit:.2f} {unit} is allowed"


def _nearest_object(room: Room, place_m: tuple[float, float]) -> str:
    """The name of what is nearest to a body's middle at this place."""
    waist_m = np.array([[*place_m, 1.0]])
    nearest_m, name = math.inf, "the edge of the floor"
    for thing in room.objects:
        if thing.walkable or not len(thing.mesh.faces):
            continue
        triangles = thing.mesh.vertices_m[thing.mesh.faces]
        closest = trimesh.triangles.closest_point(triangles, np.repeat(waist_m, len(triangles), axis=0))
        # Across the floor, since a body stands from floor to head.
        distance_m = float(np.linalg.norm(closest[:, :2] - waist_m[:, :2], axis=1).min())
        if distance_m < nearest_m and closest[:, 2].min() < 2.0:
            nearest_m, name = distance_m, thing.name
    return name
