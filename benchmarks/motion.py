"""How bodies keep to the floor, to their routes, and out of everything: 40 routes over ten rooms, and what it costs.

    python benchmarks/motion.py --bank FOLDER_OF_STORED_ROOMS --cache FOLDER

Soles are measured here on the vertices of the shoes against the triangles of the floor, by code of its own; depths come
from the check that guards the stage (``perpetua.actors.penetration``), on every other frame with more vertices.
Half of the rooms are procedural, half are read from a folder with ``*/10_room`` stages. Routes are planned once and
kept in the cache.
"""

import argparse
import pickle
import resource
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from perpetua.actors.assembly import assemble_actors, draw_bodies, measured_skeletons
from perpetua.actors.bodies.source import Body
from perpetua.actors.config import ValidationConfig
from perpetua.actors.motion.kinematics import joint_positions
from perpetua.actors.motion.plan import make_motions
from perpetua.actors.penetration import make_floor, make_obstacles, make_probe, scene_depth
from perpetua.actors.routes import plan_routes
from perpetua.actors.types import ActorMesh, BodyMotion, Route, Skeleton
from perpetua.actors.validation import check_limits, validate_actors
from perpetua.config import Config
from perpetua.errors import ActorError
from perpetua.geometry.raycast import Caster
from perpetua.navigation.grid import build_nav_grid
from perpetua.pipeline.codec import load
from perpetua.rooms.build import build_room
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed

FRAMES = 240
SEED = 11
# The underside of a sole is this thick.
SOLE_M = 0.012


@dataclass(frozen=True)
class Figures:
    """One actor's figures; sole figures over contact frames."""

    slide_mps: np.ndarray
    sunk_m: np.ndarray
    floating_m: np.ndarray
    scene: str
    scene_m: float
    path_m: float


def rooms_of(bank: Path | None, count: int, cache: Path) -> list[Room]:
    """Stored rooms first, procedural ones after."""
    config = Config()
    folders = sorted(bank.glob("*/10_room"))[: count // 2] if bank is not None else []
    rooms: list[Room] = [load(folder) for folder in folders]
    procedural = config.rooms.model_copy(update={"source": "procedural"})
    for index in range(count - len(rooms)):
        rooms.append(build_room(procedural, config.navigation, StageSeed(SEED, index, "room"), cache))
    return rooms


def routes_in(room: Room, index: int, cache: Path) -> tuple[Route, ...]:
    """Routes of four actors, planned once."""
    path = cache / f"routes_{index}_{room.name}.pickle"
    if not path.exists():
        config = Config()
        grid = build_nav_grid(room, config.navigation)
        seed = StageSeed(SEED, index, "routes")
        path.write_bytes(pickle.dumps(plan_routes(room, grid, config.actors, FRAMES, config.sequence.fps, seed)))
    routes: tuple[Route, ...] = pickle.loads(path.read_bytes())
    return routes


def bodies_for(cache: Path) -> tuple[Body, ...]:
    """The same four people in every room, made once."""
    path = cache / "bodies.pickle"
    if not path.exists():
        path.write_bytes(pickle.dumps(draw_bodies(Config().actors, StageSeed(SEED, 0, "bodies"))))
    bodies: tuple[Body, ...] = pickle.loads(path.read_bytes())
    return bodies


def sole_ends(mesh: ActorMesh, motion: BodyMotion) -> list[np.ndarray]:
    """Vertices under the left heel, left toe, right heel and right toe: the ends of the soles, undersides alone."""
    ends = []
    for side, ankle, contacts in (("left", 7, [0, 1]), ("right", 8, [2, 3])):
        frame = int(motion.contacts[:, contacts].all(axis=1).argmax())
        faces = np.concatenate([part.faces for part in mesh.parts if part.name == f"{side} sole"])
        used = np.unique(faces)
        place_m = mesh.vertices_m[frame, used].astype(np.float64)
        under = place_m[:, 2] < place_m[:, 2].min() + SOLE_M
        used, along_m = used[under], place_m[under] @ motion.world_from_joint[frame, ankle, :, 0]
        heel_m, toe_m = np.quantile(along_m, (0.25, 0.75))
        ends += [used[along_m <= heel_m], used[along_m >= toe_m]]
    return ends


def sole_figures(
    mesh: ActorMesh, motion: BodyMotion, floor: Caster, fps: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slide, depth in the floor and height above it of each foot's heel and toe while it is in contact."""
    slides, heights = [], []
    for contact, end in enumerate(sole_ends(mesh, motion)):
        stands = motion.contacts[:, contact]
        zone_m = mesh.vertices_m[:, end].astype(np.float64)
        both = stands[1:] & stands[:-1]
        slides.append(np.linalg.norm(np.diff(zone_m[:, :, :2].mean(axis=1), axis=0), axis=1)[both] * fps)
        height_m = np.stack([height_over(floor, zone_m[:, vertex]) for vertex in range(zone_m.shape[1])], axis=1)
        heights.append(height_m.min(axis=1)[stands])
    height_m = np.concatenate(heights)
    return np.concatenate(slides), np.maximum(-height_m, 0.0), np.maximum(height_m, 0.0)


def height_over(floor: Caster, point_m: np.ndarray) -> np.ndarray:
    """Height of points over the highest walkable triangle under or just over them."""
    origin_m = point_m + np.array([0.0, 0.0, 0.12])
    hits = floor.first_hit(origin_m, np.tile([0.0, 0.0, -1.0], (len(origin_m), 1)))
    return np.where(hits.hit, hits.distance_m - 0.12, 0.0)


def figures_of(
    mesh: ActorMesh, motion: BodyMotion, skeleton: Skeleton, route: Route, room: Room, floor: Caster, fps: float
) -> Figures:
    """All figures of one actor."""
    slide_mps, sunk_m, floating_m = sole_figures(mesh, motion, floor, fps)
    frames = np.arange(0, len(route.heading_rad), 2)
    joint_m = joint_positions(motion, skeleton)
    obstacles = make_obstacles(room, float(route.position_m[:, 2].min()) + 0.1)
    worst = scene_depth(mesh, joint_m, make_probe(mesh, joint_m, frames, 4000), obstacles, frames)
    away_m = np.linalg.norm(motion.pelvis_m[:, :2] - route.position_m[:, :2], axis=1)
    for dwell in route.dwells:
        if dwell.purpose == "sit":
            away_m[dwell.first_frame : dwell.last_frame + 1] = 0.0
    return Figures(slide_mps, sunk_m, floating_m, f"{worst.place} at {worst.frame}", worst.value_m, float(away_m.max()))


def wide_limits() -> ValidationConfig:
    """Limits that nothing breaks, to have every figure."""
    names = [name for name in ValidationConfig.model_fields if name.startswith("max_")]
    return ValidationConfig(**{name: 0.2 if "sole" in name or "floating" in name else 1.0 for name in names})


def print_actor(room: Room, place: int, route: Route, figures: Figures) -> None:
    """One line."""
    middle, high = (np.percentile(figures.slide_mps, share) * 100 for share in (50, 95))
    sunk_mm, floating_mm = (np.percentile(height_m, 99) * 1000 for height_m in (figures.sunk_m, figures.floating_m))
    print(
        f"{room.name:20.20} {place} {route.description:36.36} slide {middle:4.2f} {high:4.2f} cm/s sunk {sunk_mm:5.1f} "
        f"floating {floating_mm:5.1f} mm  scene {figures.scene_m * 100:5.1f} cm {figures.scene:34.34} "
        f"path {figures.path_m * 100:5.1f} cm",
        flush=True,
    )


def print_summary(everything: list[Figures], overlaps: list[tuple[float, str, tuple[int, int]]]) -> None:
    """What the forty have in common."""
    slide_mps = np.concatenate([figures.slide_mps for figures in everything])
    sunk = np.mean(np.concatenate([figures.sunk_m for figures in everything]) < 0.01)
    floating = np.mean(np.concatenate([figures.floating_m for figures in everything]) < 0.015)
    middle, high = (np.percentile(slide_mps, share) * 100 for share in (50, 95))
    deep = sum(figures.scene_m > 0.02 for figures in everything)
    print(f"\n{len(everything)} actors; slide: median {middle:.2f}, 95th percentile {high:.2f} cm/s")
    print(f"share of contact frames sunk under 1 cm {sunk:.4f}, floating under 1.5 cm {floating:.4f}")
    print(
        f"deepest in the scene {max(figures.scene_m for figures in everything) * 100:.1f} cm; deeper than 2 cm: {deep}"
    )
    print(f"path error {max(figures.path_m for figures in everything) * 100:.1f} cm")
    print(f"pairs that intersect: {sum(gap_m < 0.0 for gap_m, _, _ in overlaps)}; nearest {min(overlaps)}")


def main() -> None:
    """Prints a line per actor and the summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bank", type=Path)
    parser.add_argument("--cache", type=Path, required=True)
    parser.add_argument("--rooms", type=int, nargs="*", help="only these of the ten")
    arguments = parser.parse_args()
    arguments.cache.mkdir(parents=True, exist_ok=True)
    config = Config()
    fps, limits = config.sequence.fps, config.actors.validation
    bodies = bodies_for(arguments.cache)
    everything: list[Figures] = []
    costs, refused, overlaps = [], [], []
    for index, room in enumerate(rooms_of(arguments.bank, 10, arguments.cache)):
        if arguments.rooms is not None and index not in arguments.rooms:
            continue
        routes = routes_in(room, index, arguments.cache)
        times_s = [time.process_time()]
        skeletons = measured_skeletons(bodies)
        motions = make_motions(routes, skeletons, room, fps, config.actors.motion, StageSeed(SEED, index, "motion"))
        times_s.append(time.process_time())
        meshes = assemble_actors(bodies, motions, room.next_object_index)
        times_s.append(time.process_time())
        report = validate_actors(meshes, motions, skeletons, routes, room, fps, wide_limits())
        times_s.append(time.process_time())
        costs.append(np.diff(times_s))
        overlaps += [(float(pair.distance_m.min()), room.name, pair.actors) for pair in report.pairs]
        floor = make_floor(room)
        for place, route in enumerate(routes):
            figures = figures_of(meshes[place], motions[place], skeletons[place], route, room, floor, fps)
            everything.append(figures)
            print_actor(room, place, route, figures)
        try:
            check_limits(report, limits)
        except ActorError as error:
            refused.append(f"{room.name}: {error}")
        hands_cm = [f"{figures.hands_in_trunk.value_m * 100:.1f}" for figures in report.actors]
        joints = [f"{figures.joint_excess_rad:.2f} {figures.joint_excess_at}" for figures in report.actors]
        print("   CPU s: motion {:.1f}, posing {:.1f}, checks {:.1f}".format(*costs[-1]), hands_cm, joints, flush=True)
    print_summary(everything, overlaps)
    print("CPU s for four actors: motion {:.1f}, posing {:.1f}, checks {:.1f}".format(*np.mean(costs, axis=0)))
    print(f"peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    print(f"rooms refused by the stage's limits: {len(refused)}", *refused, sep="\n  ")


if __name__ == "__main__":
    main()
