"""Room and navigation grid -> routes of all actors."""

import logging
import math

import numpy as np

from perpetua.errors import RouteError
from perpetua.navigation.floor import WalkableFloor
from perpetua.navigation.interaction_points import find_spots
from perpetua.navigation.seats import find_seats
from perpetua.navigation.time_parametrisation import Pause, Walk
from perpetua.navigation.types import NavGrid
from perpetua.routes.casting import Role, cast_actors
from perpetua.routes.checks import TimedPaths, find_violations
from perpetua.routes.config import RouteSettings
from perpetua.routes.draw import Stage, draw_walk, highest_speed_mps, seat_spots
from perpetua.routes.explain import explain
from perpetua.routes.optimise import PlannedPaths, optimise_paths
from perpetua.scene.actor import Dwell, Route
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

logger = logging.getLogger(__name__)

# Paths are planned at this rate or the sequence's, whichever is higher, and for at least this long: the motion of a
# single frame is part of a longer one.
MIN_RATE_HZ = 20.0
MIN_SECONDS = 2.0


def plan_routes(
    room: Room, grid: NavGrid, config: RouteSettings, frames: int, fps: float, seed: StageSeed
) -> tuple[Route, ...]:
    """One route per actor, all within the hard limits of ``config.routes``.

    Each actor gets a role and a random walk that suits it; Adam then moves all paths at once; what still breaks a
    limit gets another walk.

    Args:
        room: what there is to see, to stand at and to sit on.
        grid: where actors can walk, for the body radius that it was made with.
        config: number of actors, roles, limits, weights.
        frames: frames of each route.
        fps: frames per second.
        seed: all randomness comes from ``seed.stream("walk", actor, attempt)`` and what ``cast_actors`` draws.

    Raises:
        RouteError: ``config.routes.max_redraws`` further walks did not help.
        ConfigError: there is no list of descriptions to draw from.
    """
    refinement = max(1, math.ceil(MIN_RATE_HZ / fps))
    stage = set_stage(room, grid, (frames - 1) * refinement + 1, fps * refinement)
    roles = cast_actors(config.count, config.motion, config.routes.paces, len(stage.seats), seed)
    walks, paths = _feasible_walks(room, stage, roles, config, refinement, seed)
    return tuple(
        _route(actor, role, walk, paths, grid, frames, refinement)
        for actor, (role, walk) in enumerate(zip(roles, walks, strict=True))
    )


def set_stage(room: Room, grid: NavGrid, steps: int, rate_hz: float) -> Stage:
    """A room as walks see it, for at least so many steps at a rate."""
    floor = WalkableFloor(grid)
    seats = seat_spots(find_seats(room), floor)
    return Stage(floor, find_spots(room, floor), seats, max(steps, math.ceil(MIN_SECONDS * rate_hz)), 1.0 / rate_hz)


def _feasible_walks(
    room: Room, stage: Stage, roles: tuple[Role, ...], config: RouteSettings, refinement: int, seed: StageSeed
) -> tuple[list[Walk], TimedPaths]:
    """Walks, and the paths that Adam made of them, which keep all limits."""
    grid = stage.floor.grid
    attempts = np.zeros(len(roles), int)
    walks: list[Walk] = []
    for actor, role in enumerate(roles):
        walks.append(draw_walk(stage, role, config.routes, walks, seed, actor, 0))
    speeds_mps = np.array([highest_speed_mps(role, config.routes) for role in roles])
    while True:
        plan = PlannedPaths.of_walks(walks, speeds_mps, stage.step_s)
        paths = optimise_paths(plan, grid, config.routes).paths
        violations = find_violations(paths, grid, config.routes)
        if not violations:
            return walks, paths
        reason = explain(violations[0], room, refinement)
        if attempts.sum() >= config.routes.max_redraws:
            raise RouteError(
                f"{reason}: lower actors.count or choose a larger room ({attempts.sum()} other walks were tried)"
            )
        for actor in sorted({violation.actor for violation in violations}):
            attempts[actor] += 1
            logger.info("%s; actor %d takes another walk", reason, actor)
            others = [walk for index, walk in enumerate(walks) if index != actor]
            walks[actor] = draw_walk(stage, roles[actor], config.routes, others, seed, actor, int(attempts[actor]))


def _route(actor: int, role: Role, walk: Walk, paths: TimedPaths, grid: NavGrid, frames: int, refinement: int) -> Route:
    position_m = paths.position_m[actor, ::refinement][:frames]
    cells = np.round((position_m - grid.origin_m) / grid.cell_m).astype(int)
    floor_z_m = grid.floor_z_m[cells[:, 0], cells[:, 1]].astype(np.float64)
    heading_rad = paths.heading_rad[actor, ::refinement][:frames].copy()
    dwells = tuple(dwell for pause in walk.pauses for dwell in _dwell(pause, frames, refinement))
    return Route(actor, np.column_stack([position_m, floor_z_m]), heading_rad, role.description, dwells)


def _dwell(pause: Pause, frames: int, refinement: int) -> list[Dwell]:
    """A pause in frames; none if no two frames fall into it."""
    first, last = math.ceil(pause.first_step / refinement), min(pause.last_step // refinement, frames - 1)
    spot = pause.spot
    return [Dwell(first, last, spot.purpose, spot.object_index, spot.target_m, spot.seat)] if last > first else []
