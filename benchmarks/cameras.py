"""How good camera paths are and what they cost, over rooms with actors that an earlier run has made.

    perpetua generate --out OUT --rooms 4 --preset standard --set sequence.frames=240 --until actors
    python benchmarks/cameras.py OUT/.work/*

Each argument is a room's work folder, with the stages ``10_room`` and ``50_actors`` in it. ``--ablate`` switches off
one loss after the other, beside starts that are not optimised and drifting cameras drawn at random;
``--convergence`` compares the loss after the configured steps with that after twice as many. Tables are Markdown.
"""

import argparse
import cProfile
import pstats
import resource
import sys
import time
from pathlib import Path

import numpy as np
from camera_figures import clearances, figures, scene_mesh

from perpetua.cameras.config import CamerasConfig
from perpetua.cameras.field import distance_at_m, polygon_distance_m, voxel_centres_m
from perpetua.cameras.optimise import optimise_paths
from perpetua.cameras.plan import CameraScene, Draft, camera_scene, draw_draft, make_paths, plan_cameras, pose_problem
from perpetua.geometry.pinhole import Intrinsics
from perpetua.geometry.transforms import look_at
from perpetua.pipeline import codec
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

SIZE_PX = 512
FPS = 24.0
FIELD_POINTS = 4000
# Columns of the main table: figure, title, digits.
COLUMNS = (
    ("focus", "focus seen", 3),
    ("focus_worst", "worst view", 2),
    ("covered", "seen by 2", 2),
    ("covered_worst", "worst actor", 2),
    ("apart_deg", "apart deg", 0),
    ("crowded", "crowded", 2),
    ("scene_m", "scene m", 3),
    ("actor_m", "actor m", 3),
    ("speed_mps", "m/s", 2),
    ("turn_dps", "deg/s", 0),
    ("roll_deg", "roll deg", 2),
    ("travel_m", "travel m", 1),
    ("field_mm", "field error mm", 0),
)
# The functions whose processor time is told apart.
PARTS = (
    ("field", "signed_distance_field"),
    ("starts", "draw_starts"),
    ("Adam", "optimise_paths"),
    ("audit", "audit_paths"),
)
BASELINES = ("all", "unoptimised", "random")
# The figure that each loss serves, its title, and whether more of it is better.
SERVES = {
    "scene_clearance": ("scene_m", "least distance to scene, m", True),
    "actor_clearance": ("actor_m", "least distance to actors, m", True),
    "framing": ("focus_points", "share of focus points in image", True),
    "size": ("height_spread", "spread of focus's height, log", False),
    "coverage": ("covered", "actors seen by two views, share", True),
    "occlusion": ("behind_scene", "focus points behind scene, share", False),
    "crowding": ("behind_actors", "focus points behind actors, share", False),
    "foreground": ("crowded", "frames with an actor above 1.2 images, share", False),
    "smoothness": ("acceleration_rms", "acceleration, rms m/s^2", False),
    "rotation": ("turn_rms", "turning, rms deg/s", False),
    "limits": ("acceleration_mps2", "greatest acceleration, m/s^2", False),
    "travel": ("travel_m", "way travelled, m", True),
    "revisiting": ("revisited", "frames at a place visited before, share", False),
    "diversity": ("apart_deg", "angle between most different views, deg", True),
    "height": ("height_off_m", "distance from wished height, m", False),
    "pitch": ("pitch_deg", "steepest view, deg", False),
    "offset": ("off_axis_deg", "focus off the optical axis, deg", False),
}


def main() -> None:
    """Runs what the arguments ask for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rooms", type=Path, nargs="+", help="work folders of rooms")
    parser.add_argument("--seed", type=int, default=0, help="seed of the cameras")
    parser.add_argument("--ablate", action="store_true", help="switch off one loss after the other")
    parser.add_argument("--convergence", action="store_true", help="compare with twice the steps")
    arguments = parser.parse_args()
    config = CamerasConfig()
    if arguments.ablate:
        _print_ablation(arguments.rooms, config, arguments.seed)
    elif arguments.convergence:
        _print_convergence(arguments.rooms, config, arguments.seed)
    else:
        _print_rooms(arguments.rooms, config, arguments.seed)


def _load(folder: Path) -> tuple[Room, tuple[ActorMesh, ...]]:
    return codec.load(folder / "10_room"), codec.load(folder / "50_actors")


def _print_rooms(folders: list[Path], config: CamerasConfig, seed: int) -> None:
    titles = [title for _, title, _ in COLUMNS]
    print("| room | " + " | ".join(titles) + " | CPU s (" + ", ".join(part for part, _ in PARTS) + ", rest) | GiB |")
    print("|---" * (len(titles) + 3) + "|")
    rows = []
    for number, folder in enumerate(folders):
        row, cost = _measure_room(folder, config, StageSeed(seed, number, "cameras"))
        rows.append(row)
        print(f"| {folder.name} | {_cells(row)} | {cost} |", flush=True)
    means = {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}
    print(f"| mean | {_cells(means)} | | |")


def _cells(row: dict[str, float]) -> str:
    return " | ".join(f"{row[name]:.{digits}f}" for name, _, digits in COLUMNS)


def _measure_room(folder: Path, config: CamerasConfig, seed: StageSeed) -> tuple[dict[str, float], str]:
    room, actors = _load(folder)
    profile = cProfile.Profile(time.process_time)
    frames = len(actors[0].vertices_m)
    plan = profile.runcall(plan_cameras, room, actors, config, frames, FPS, SIZE_PX, SIZE_PX, seed)
    memory_gib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    scene = scene_mesh(room)
    row = figures(plan.paths, plan.focus, actors, scene, FPS) | clearances(plan.paths, actors, scene)
    row["field_mm"] = 1e3 * _field_error_m(camera_scene(room, actors, config, FPS, SIZE_PX, SIZE_PX))
    return row, f"{_cost(profile)} | {memory_gib:.2f}"


def _cost(profile: cProfile.Profile) -> str:
    spent_s = {code[2]: entry[3] for code, entry in pstats.Stats(profile).stats.items()}  # type: ignore[attr-defined]
    total_s = spent_s["plan_cameras"]
    parts_s = [spent_s[function] for _, function in PARTS]
    fractions = ", ".join(f"{part_s:.1f}" for part_s in [*parts_s, total_s - sum(parts_s)])
    return f"{total_s:.1f} ({fractions})"


def _field_error_m(scene: CameraScene) -> float:
    """Greatest error of the field at random free points, where the scene is the nearest object: not by open windows."""
    field = scene.field
    free_m = voxel_centres_m(field, field.distance_m > field.voxel_m)
    rng = np.random.default_rng(0)
    points_m = (
        free_m[rng.integers(len(free_m), size=FIELD_POINTS)] + rng.uniform(-0.5, 0.5, (FIELD_POINTS, 3)) * field.voxel_m
    )
    exact_m = scene.caster.closest_distance(points_m)
    side_m = polygon_distance_m(scene.room.floor_polygon_m, points_m[:, :2])
    to_border_m = np.minimum(side_m, np.minimum(points_m[:, 2], scene.room.height_m - points_m[:, 2]))
    inner = to_border_m > exact_m + field.voxel_m
    return float(np.abs(distance_at_m(field, points_m) - exact_m)[inner].max())


def _print_convergence(folders: list[Path], config: CamerasConfig, seed: int) -> None:
    print(f"| room | loss after {config.steps} steps | after {2 * config.steps} | better by |\n|---|---|---|---|")
    longer = config.model_copy(update={"steps": 2 * config.steps})
    for number, folder in enumerate(folders):
        scene = camera_scene(*_load(folder), config, FPS, SIZE_PX, SIZE_PX)
        drafts = _drafts(scene, config, StageSeed(seed, number, "cameras"))
        problem = pose_problem(scene, drafts, config)
        once, twice = (optimise_paths(problem, each).loss.min() for each in (config, longer))
        print(f"| {folder.name} | {once:.4f} | {twice:.4f} | {100.0 * (1.0 - twice / once):.1f}% |", flush=True)


def _print_ablation(folders: list[Path], config: CamerasConfig, seed: int) -> None:
    """Figures of one candidate each, whether or not it would pass the audit."""
    variants = {"all": config, "unoptimised": config.model_copy(update={"steps": 0}), "random": config}
    for name in SERVES:
        variants[name] = config.model_copy(update={"weights": config.weights.model_copy(update={name: 0.0})})
    found: dict[str, list[dict[str, float]]] = {name: [] for name in variants}
    for number, folder in enumerate(folders):
        room, actors = _load(folder)
        scene, mesh = camera_scene(room, actors, config, FPS, SIZE_PX, SIZE_PX), scene_mesh(room)
        one = config.model_copy(update={"candidates": 1})
        (draft,) = drafts = _drafts(scene, one, StageSeed(seed, number, "cameras"))
        problem = pose_problem(scene, drafts, one)
        for name, variant in variants.items():
            if name == "random":
                paths = _random_paths(scene, draft, StageSeed(seed, number, "cameras"))
            else:
                paths = make_paths(scene, draft, optimise_paths(problem, variant), 0)
            row = figures(paths, draft.focus(scene), actors, mesh, FPS) | {"height_off_m": _height_off_m(paths, draft)}
            # Exact distances take longer than all the rest together.
            measured = name in (*BASELINES, "scene_clearance", "actor_clearance")
            found[name].append(row | (clearances(paths, actors, mesh) if measured else {}))
            print(f"{folder.name}: {name} measured", file=sys.stderr, flush=True)
    _print_ablation_table(found)


def _print_ablation_table(found: dict[str, list[dict[str, float]]]) -> None:
    print("| loss off | figure it serves | all losses | without | worse | unoptimised | random |")
    print("|---|---|---|---|---|---|---|")
    for name, (figure, title, more) in SERVES.items():
        mean = {variant: float(np.mean([row[figure] for row in found[variant]])) for variant in (*BASELINES, name)}
        worse = mean[name] < mean["all"] if more else mean[name] > mean["all"]
        cells = " | ".join(f"{mean[variant]:.3f}" for variant in ("unoptimised", "random"))
        print(f"| {name} | {title} | {mean['all']:.3f} | {mean[name]:.3f} | {'yes' if worse else 'no'} | {cells} |")


def _drafts(scene: CameraScene, config: CamerasConfig, seed: StageSeed) -> list[Draft]:
    return [draw_draft(scene, config, seed, 0, candidate) for candidate in range(config.candidates)]


def _height_off_m(paths: tuple[CameraPath, ...], draft: Draft) -> float:
    off_m = []
    for path, wish in zip(paths, draft.wishes, strict=True):
        height_m = path.world_from_camera[:, 2, 3]
        off_m.append(np.maximum(np.maximum(wish.height_m[0] - height_m, height_m - wish.height_m[1]), 0.0).mean())
    return float(np.mean(off_m))


def _random_paths(scene: CameraScene, draft: Draft, seed: StageSeed) -> tuple[CameraPath, ...]:
    """Cameras with the same lenses that drift from one free place to another and look from one point to another."""
    rng = seed.stream("random baseline")
    free_m = voxel_centres_m(scene.field, scene.field.distance_m > 0.25)
    fraction = np.linspace(0.0, 1.0, len(scene.times_s))[:, None]
    paths = []
    for wish in draft.wishes:
        ends_m = free_m[rng.integers(len(free_m), size=4)]
        position_m = (1.0 - fraction) * ends_m[0] + fraction * ends_m[1]
        target_m = (1.0 - fraction) * ends_m[2] + fraction * ends_m[3]
        lens = Intrinsics.centred(SIZE_PX, SIZE_PX, wish.fov_rad)
        paths.append(CameraPath(wish.camera, look_at(position_m, target_m), lens))
    return tuple(paths)


if __name__ == "__main__":
    main()
