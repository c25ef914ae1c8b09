"""How bodies keep to the floor, to their routes, and out of everything, and what it costs: for the rooms of a run.

    perpetua generate --preset benchmark --seed 7 --rooms 10 --until actors --out plans
    python benchmarks/motion.py plans

Soles are measured here on the vertices of the shoes against the triangles of the floor, by code of its own. Depth in
the scene, overlap and path error are the stage's own figures, of every frame.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from perpetua.actors.checks.penetration import make_floor
from perpetua.geometry.raycast import Caster
from perpetua.io.files import read_json
from perpetua.pipeline.codec import load
from perpetua.pipeline.layout import read_run
from perpetua.scene.actor import ActorMesh, BodyMotion

# The underside of a sole is this thick.
SOLE_M = 0.012


@dataclass(frozen=True)
class Soles:
    """One actor's soles over its contact frames."""

    slide_mps: np.ndarray
    sunk_m: np.ndarray
    floating_m: np.ndarray


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


def measure_soles(mesh: ActorMesh, motion: BodyMotion, floor: Caster, fps: float) -> Soles:
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
    return Soles(np.concatenate(slides), np.maximum(-height_m, 0.0), np.maximum(height_m, 0.0))


def height_over(floor: Caster, point_m: np.ndarray) -> np.ndarray:
    """Height of points over the highest walkable triangle under or just over them."""
    origin_m = point_m + np.array([0.0, 0.0, 0.12])
    hits = floor.first_hit(origin_m, np.tile([0.0, 0.0, -1.0], (len(origin_m), 1)))
    return np.where(hits.hit, hits.distance_m - 0.12, 0.0)


def measure_room(folder: Path, fps: float) -> list[Soles]:
    """Prints a line per actor of a room."""
    floor = make_floor(load(folder / "10_room"))
    routes, motions, actors = (load(folder / name) for name in ("30_routes", "40_motion", "50_actors"))
    stage = read_json(folder / "50_actors" / "validation.json")
    soles = []
    for route, motion, actor, figures in zip(routes, motions, actors, stage["actors"], strict=True):
        found = measure_soles(actor, motion, floor, fps)
        soles.append(found)
        middle, high = (np.percentile(found.slide_mps, percent) * 100 for percent in (50, 95))
        sunk_mm, floating_mm = (np.percentile(height_m, 99) * 1000 for height_m in (found.sunk_m, found.floating_m))
        print(
            f"| {folder.name} {actor.actor} | {route.description} | {middle:.2f} | {high:.2f} | {sunk_mm:.1f} | "
            f"{floating_mm:.1f} | {figures['scene_depth']['value_m'] * 100:.1f} | "
            f"{figures['path_error']['value_m'] * 100:.1f} |",
            flush=True,
        )
    return soles


def print_summary(rooms: list[Path], soles: list[Soles]) -> None:
    """What all have in common."""
    stages = [read_json(room / "50_actors" / "validation.json") for room in rooms]
    slide_mps = np.concatenate([found.slide_mps for found in soles])
    sunk = np.mean(np.concatenate([found.sunk_m for found in soles]) < 0.01)
    floating = np.mean(np.concatenate([found.floating_m for found in soles]) < 0.015)
    middle, high = (np.percentile(slide_mps, percent) * 100 for percent in (50, 95))
    people = [actor for stage in stages for actor in stage["actors"]]
    nearest_m = min(pair["least_distance_m"] for stage in stages for pair in stage["pairs"])
    print(f"\n{len(people)} actors; slide in contact: median {middle:.2f}, 95th percentile {high:.2f} cm/s")
    print(f"fraction of contact frames sunk under 1 cm {sunk:.4f}, floating under 1.5 cm {floating:.4f}")
    print(f"deepest in the scene {max(actor['scene_depth']['value_m'] for actor in people) * 100:.1f} cm")
    print(f"nearest two actors come {nearest_m * 100:.1f} cm (below 0: they intersect)")
    print(f"largest path error {max(actor['path_error']['value_m'] for actor in people) * 100:.1f} cm")
    for name in ("40_motion", "50_actors"):
        manifests = [read_json(room / name / "manifest.json") for room in rooms]
        seconds, peak_mb = ([manifest[key] for manifest in manifests] for key in ("seconds", "peak_memory_mb"))
        print(f"{name}: median {np.median(seconds):.1f} s, most {max(seconds):.1f} s, {max(peak_mb):.0f} MB")


def main() -> None:
    """Prints a line per actor and the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, help="output folders of perpetua generate")
    print(
        "| actor | does | slide: median cm/s | 95th | sunk: 99th mm | floating: 99th mm | in the scene cm | path cm |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    rooms, soles = [], []
    for out in parser.parse_args().folders:
        fps = read_run(out).config.sequence.fps
        for folder in sorted((out / ".work").iterdir()):
            if (folder / "50_actors" / "manifest.json").exists():
                rooms.append(folder)
                soles += measure_room(folder, fps)
    print_summary(rooms, soles)


if __name__ == "__main__":
    main()
