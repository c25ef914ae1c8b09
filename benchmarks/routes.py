"""Routes of many rooms: hard limits by code that plans nothing, speeds, time; what each loss is for; convergence.

    python benchmarks/routes.py [--procedural 5] [--bank OUT/.work] [--frames 240] [--part check ablation convergence]

``--bank`` is the work folder of a finished run: its rooms are used besides procedural ones.
"""

import argparse
import logging
import resource
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from route_figures import Motion, Surroundings

from perpetua.actors.config import ActorsConfig
from perpetua.navigation.config import NavigationConfig
from perpetua.navigation.grid import build_nav_grid
from perpetua.navigation.time_parametrisation import Walk
from perpetua.navigation.types import NavGrid
from perpetua.pipeline.codec import load
from perpetua.rooms.acceptance.build import build_room
from perpetua.rooms.config import RoomsConfig
from perpetua.routes.casting import cast_actors
from perpetua.routes.checks import TimedPaths
from perpetua.routes.config import RoutesConfig, RouteWeights
from perpetua.routes.draw import draw_walk, highest_speed_mps
from perpetua.routes.optimise import PlannedPaths, optimise_paths
from perpetua.routes.plan import plan_routes, set_stage
from perpetua.scene.actor import Route
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

FPS = 24.0
FAST_FRAMES, FAST_M = 24, 2.0
BODY = NavigationConfig()
# Numerical slack of limits that are kept exactly at the planner's own instants.
SLACK = 1.01
# Speeds that end each pace: standing, strolling, walking, walking briskly; what is faster is jogging.
PACE_ENDS_MPS = (0.1, 0.95, 1.4, 2.0)


@dataclass(frozen=True)
class Scene:
    """A room and its grid."""

    name: str
    room: Room
    grid: NavGrid
    seed: StageSeed


@dataclass(frozen=True)
class Draw:
    """Walks as drawn at first, and what Adam makes of them."""

    scene: Scene
    walks: list[Walk]
    plan: PlannedPaths
    around: Surroundings


class RedrawCounter(logging.Handler):
    """Counts the walks that were drawn again."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.count = 0

    def emit(self, record: logging.LogRecord) -> None:
        """Counts a message about another walk."""
        self.count += "takes another walk" in record.getMessage()


def main() -> None:
    """Makes the tables that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--procedural", type=int, default=5, help="procedural rooms")
    parser.add_argument("--bank", type=Path, help="work folder of a finished run whose rooms are used too")
    parser.add_argument("--rooms", type=int, default=10, help="rooms used of the bank")
    parser.add_argument("--frames", type=int, default=240, help="frames of each route")
    parser.add_argument("--seed", type=int, default=7, help="seed of rooms and routes")
    parts = {"check": check_table, "ablation": ablation_table, "convergence": convergence_table}
    parser.add_argument("--part", nargs="+", choices=list(parts), default=list(parts), help="tables to make")
    wanted = parser.parse_args()
    scenes = procedural_scenes(wanted.procedural, wanted.seed)
    if wanted.bank is not None:
        scenes += banked_scenes(wanted.bank, wanted.rooms, wanted.seed)
    for part in wanted.part:
        parts[part](scenes, wanted.frames)


def procedural_scenes(count: int, seed: int) -> list[Scene]:
    """Procedural rooms of a seed."""
    config = RoomsConfig(source="procedural")
    with tempfile.TemporaryDirectory() as scratch:
        rooms = [build_room(config, BODY, StageSeed(seed, index, "room"), Path(scratch)) for index in range(count)]
    return [
        Scene(f"procedural {index} {room.kind}", room, build_nav_grid(room, BODY), StageSeed(seed, index, "routes"))
        for index, room in enumerate(rooms)
    ]


def banked_scenes(folder: Path, count: int, seed: int) -> list[Scene]:
    """Rooms that an earlier run made."""
    scenes = []
    for index, path in enumerate(sorted(folder.glob("*/10_room"))[:count]):
        room = load(path)
        scenes.append(
            Scene(f"bank {index} {room.kind}", room, build_nav_grid(room, BODY), StageSeed(seed, index, "routes"))
        )
    return scenes


def check_table(scenes: list[Scene], frames: int) -> None:
    """A row of figures per room, and those of all rooms."""
    print("| room | violations | fast actors | mean m/s | top m/s | top m/s2 | redraws | CPU s |")
    print("|---|---|---|---|---|---|---|---|")
    counter = RedrawCounter()
    planning = logging.getLogger("perpetua.routes")
    planning.setLevel(logging.INFO)
    planning.addHandler(counter)
    plan_routes(scenes[0].room, scenes[0].grid, ActorsConfig(count=1), 2, FPS, scenes[0].seed)  # loads libraries
    fast, speeds, total, drift = [], [], 0, [0.0]
    for scene in scenes:
        counter.count, start_s = 0, time.process_time()
        routes = plan_routes(scene.room, scene.grid, ActorsConfig(), frames, FPS, scene.seed)
        spent_s = time.process_time() - start_s
        motion = _motion(routes)
        violations = count_violations(motion, Surroundings(scene.room, BODY), RoutesConfig())
        quick = motion.farthest_in_m(FAST_FRAMES) > FAST_M
        fast += quick.tolist()
        speeds.append(motion.speed_mps.ravel())
        total += sum(violations.values())
        drift += _drifts_mps(routes, motion)
        named = ", ".join(f"{rule} {count}" for rule, count in violations.items() if count) or "0"
        print(
            f"| {scene.name} | {named} | {quick.sum()} | {motion.speed_mps.mean():.2f} | {motion.speed_mps.max():.2f} "
            f"| {motion.acceleration_mps2.max():.1f} | {counter.count} | {spent_s:.1f} |",
            flush=True,
        )
    spread = np.diff(np.searchsorted(np.sort(np.concatenate(speeds)), [-1.0, *PACE_ENDS_MPS, np.inf]))
    fractions = ", ".join(f"{100 * part / spread.sum():.0f}%" for part in spread)
    print(f"\nViolations: {total}.")
    print(f"Actors that get more than {FAST_M:g} m within {FAST_FRAMES} frames: {np.mean(fast):.0%}.")
    print(f"Time standing, strolling, walking, brisk, jogging (by speed): {fractions}.")
    print(f"Highest drift while dwelling: {max(drift):.4f} m/s in {len(drift) - 1} dwells.")
    print(f"Peak memory of this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB.\n")


def count_violations(motion: Motion, around: Surroundings, limits: RoutesConfig) -> dict[str, int]:
    """Instants at which each hard limit is broken."""
    places_m = motion.position_m.reshape(-1, 3)
    return {
        "scene": int(around.hits(places_m, BODY.body_radius_m).sum()),
        "floor": int(around.off_floor(places_m).sum()),
        "separation": int((motion.least_separation_m < limits.separation_m / SLACK).sum()),
        "speed": int((motion.speed_mps > SLACK * limits.max_speed_mps).sum()),
        "acceleration": int((motion.acceleration_mps2 > SLACK * limits.max_acceleration_mps2).sum()),
        "turn rate": int((motion.turn_rate_radps > SLACK * limits.max_turn_rate_radps).sum()),
    }


def _motion(routes: tuple[Route, ...]) -> Motion:
    position_m = np.stack([route.position_m for route in routes])
    return Motion.finely(position_m, np.stack([route.heading_rad for route in routes]), 1.0 / FPS)


def _drifts_mps(routes: tuple[Route, ...], motion: Motion) -> list[float]:
    """The highest speed in each dwell, from its first to its last frame."""
    per_frame = (motion.position_m.shape[1] - 1) // (len(routes[0].heading_rad) - 1)
    return [
        float(motion.speed_mps[actor, per_frame * (dwell.first_frame + 1) : per_frame * (dwell.last_frame - 1)].max())
        for actor, route in enumerate(routes)
        for dwell in route.dwells
        if dwell.last_frame - dwell.first_frame > 2
    ]


def draw(scene: Scene, frames: int) -> Draw:
    """The first walks of a scene's actors, nothing drawn again."""
    config = ActorsConfig()
    stage = set_stage(scene.room, scene.grid, frames, FPS)
    roles = cast_actors(config.count, config.motion, config.routes.paces, len(stage.seats), scene.seed)
    walks: list[Walk] = []
    for actor, role in enumerate(roles):
        walks.append(draw_walk(stage, role, config.routes, walks, scene.seed, actor, 0))
    speeds_mps = np.array([highest_speed_mps(role, config.routes) for role in roles])
    plan = PlannedPaths.of_walks(walks, speeds_mps, stage.step_s)
    return Draw(scene, walks, plan, Surroundings(scene.room, BODY))


def ablation_table(scenes: list[Scene], frames: int) -> None:
    """Every loss switched off, and the figure that it serves: mean over rooms, nothing drawn again."""
    draws = [draw(scene, frames) for scene in scenes]
    off = {name: RouteWeights(**{name: 0.0}) for name in RouteWeights.model_fields}
    rows: dict[str, dict[str, float]] = {"random walk": _mean_figures(draws, None)}
    rows |= {name: _mean_figures(draws, weights) for name, weights in {"all": RouteWeights(), **off}.items()}
    print("| loss off | figure it serves | without it | all losses | random walk |\n|---|---|---|---|---|")
    for name in off:
        without, whole, walk = (rows[row][name] for row in (name, "all", "random walk"))
        print(f"| {name} | {FIGURES[name][0]} | {without:.3f} | {whole:.3f} | {walk:.3f} |")
    print(flush=True)


def _mean_figures(draws: list[Draw], weights: RouteWeights | None) -> dict[str, float]:
    """Every figure of the optimised paths, or of the walks where there are no weights."""
    collected: dict[str, list[float]] = {name: [] for name in FIGURES}
    for each in draws:
        paths = each.plan.walks
        if weights is not None:
            paths = optimise_paths(each.plan, each.scene.grid, RoutesConfig(weights=weights)).paths
        motion = _of_paths(paths, each.scene.grid)
        for name, (_, figure) in FIGURES.items():
            collected[name].append(figure(each, motion))
    return {name: float(np.mean(values)) for name, values in collected.items()}


def _of_paths(paths: TimedPaths, grid: NavGrid) -> Motion:
    cell = np.round((paths.position_m - grid.origin_m) / grid.cell_m).astype(int)
    cell = np.clip(cell, 0, np.array(grid.free.shape) - 1)
    z_m = grid.floor_z_m[cell[..., 0], cell[..., 1]].astype(np.float64)
    return Motion.finely(np.concatenate([paths.position_m, z_m[..., None]], axis=2), paths.heading_rad, paths.step_s)


def _from_walk_m(draw: Draw, motion: Motion) -> Float64[np.ndarray, "A T"]:
    whole_m = motion.position_m[:, :: round(draw.plan.walks.step_s / motion.step_s), :2]
    return np.asarray(np.linalg.norm(whole_m - draw.plan.walks.position_m, axis=2))


def _pause_error(draw: Draw, motion: Motion) -> float:
    """Metres beside the spot plus radians beside its target, mean over pauses."""
    stride = round(draw.plan.walks.step_s / motion.step_s)
    turned_rad = np.angle(np.exp(1j * (motion.heading_rad[:, ::stride] - draw.plan.walks.heading_rad)))
    error = _from_walk_m(draw, motion) + np.abs(turned_rad)
    return float(error[draw.plan.pausing].mean()) if draw.plan.pausing.any() else 0.0


def _scene_fraction(draw: Draw, motion: Motion) -> float:
    return 100.0 * float(draw.around.hits(motion.position_m[:, ::2].reshape(-1, 3), BODY.body_radius_m).mean())


# For each loss the figure it serves: lower is better.
FIGURES: dict[str, tuple[str, Callable[[Draw, Motion], float]]] = {
    "clearance": ("% of time in furniture", _scene_fraction),
    "separation": (
        "% of time two are too near",
        lambda _, motion: 100.0 * float((motion.least_separation_m < RoutesConfig().separation_m).mean()),
    ),
    "speed": (
        "excess over the pace's top speed, cm/s rms",
        lambda draw, motion: (
            100.0 * float(np.sqrt(np.square(np.maximum(motion.speed_mps - draw.plan.highest_mps[:, None], 0.0)).mean()))
        ),
    ),
    "acceleration": ("highest acceleration, m/s2", lambda _, motion: float(motion.acceleration_mps2.max())),
    "jerk": ("jerk, m/s3 rms", lambda _, motion: float(np.sqrt(np.square(motion.jerk_mps3).mean()))),
    "heading": ("walking off the heading, degrees", lambda _, m: float(np.degrees(m.off_heading_rad.mean()))),
    "turning": ("highest turn rate, rad/s", lambda _, motion: float(motion.turn_rate_radps.max())),
    "turn_change": (
        "change of turn rate, rad/s2 rms",
        lambda _, motion: float(np.sqrt(np.square(motion.turn_change_radps2).mean())),
    ),
    "variation": ("metres walked per new floor square", lambda _, motion: 1.0 / motion.cells_per_metre()),
    "walk": ("distance from the walk, m", lambda draw, motion: float(_from_walk_m(draw, motion).mean())),
    "pause": ("beside the spot and its target, m + rad", _pause_error),
}


def convergence_table(scenes: list[Scene], frames: int) -> None:
    """The final loss after the configured steps and after twice as many, for walks that can be made feasible."""
    print("| room | loss | loss after 2x steps | better by |\n|---|---|---|---|")
    gains = []
    for scene in scenes:
        first = draw(scene, frames)
        config = RoutesConfig()
        once, twice = (
            sum(optimise_paths(first.plan, scene.grid, config.model_copy(update={"steps": steps})).losses.values())
            for steps in (config.steps, 2 * config.steps)
        )
        gains.append(1.0 - twice / once)
        print(f"| {scene.name} | {once:.4f} | {twice:.4f} | {100.0 * gains[-1]:.2f}% |", flush=True)
    middle, highest = 100.0 * float(np.median(gains)), 100.0 * max(gains)
    print(f"\nMedian gain of twice the steps: {middle:.2f}%, highest {highest:.2f}%.\n")


if __name__ == "__main__":
    main()
