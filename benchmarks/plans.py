"""Figures of all plans in output folders: hard limits, framing, motion, cost, without rendering anything.

    perpetua generate --preset benchmark --seed 7 --rooms 10 --until cameras --out plans
    python benchmarks/plans.py plans

Limits and framing are those that the camera stage measures from the true meshes with code that plans nothing
(``perpetua.audit.motion_audit``); motion is what the actor stage measured; cost is from the manifests.
"""

import argparse
import statistics
from pathlib import Path
from typing import Any

import numpy as np

from perpetua.io.files import read_json

STAGES = ("10_room", "20_navigation", "30_routes", "40_motion", "50_actors", "60_cameras")
FAST_M, FAST_FRAMES = 2.0, 24


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, help="output folders of perpetua generate")
    rooms = [
        room
        for folder in parser.parse_args().folders
        for room in sorted((folder / ".work").iterdir())
        if (room / "60_cameras" / "motion.json").exists()
    ]
    print(f"{len(rooms)} rooms\n")
    _print_limits(rooms)
    _print_framing(rooms)
    _print_people(rooms)
    _print_cost(rooms)


def _motion(room: Path) -> dict[str, Any]:
    return read_json(room / "60_cameras" / "motion.json")


def _print_limits(rooms: list[Path]) -> None:
    print("| rule | worst of all rooms | bound | rooms that break it |\n| --- | --- | --- | --- |")
    checks = [_motion(room)["checks"] for room in rooms]
    for rule in zip(*checks, strict=True):
        values = [check["value"] for check in rule]
        worst = min(values) if rule[0]["bound"].startswith(">") else max(values)
        broken = sum(not check["passed"] for check in rule)
        print(f"| {rule[0]['name']} | {worst:.3f} | {rule[0]['bound']} | {broken} |")


def _print_framing(rooms: list[Path]) -> None:
    print("\n| room | focus seen, share of (view, frame) | seen by two views: least actor | mean | apart, degrees |")
    print("| --- | --- | --- | --- | --- |")
    rows = []
    for room in rooms:
        found = _motion(room)
        two = found["seen_by_two_share"]
        rows.append((np.mean(found["focus_seen_share"]), min(two), np.mean(two), found["mean_apart_deg"]))
        print(f"| {room.parents[1].name}/{room.name} | " + " | ".join(f"{value:.3g}" for value in rows[-1]) + " |")
    if rows:
        print("| all: mean | " + " | ".join(f"{value:.3g}" for value in np.mean(rows, axis=0)) + " |")
        print("| all: least | " + " | ".join(f"{value:.3g}" for value in np.min(rows, axis=0)) + " |")


def _print_people(rooms: list[Path]) -> None:
    """Fast motion from the speeds between frames: how many actors go 2 m within 24 frames."""
    fast = people = 0
    for room in rooms:
        for speed in _motion(room)["curves"]["actor_speed_mps"]:
            run = np.convolve(speed[:-1], np.ones(min(FAST_FRAMES, len(speed) - 1)), "valid") / 24.0
            fast, people = fast + bool(run.max() > FAST_M), people + 1
    print(f"\nfast actors (more than {FAST_M:g} m of way within {FAST_FRAMES} frames at 24 fps): {fast} of {people}")


def _print_cost(rooms: list[Path]) -> None:
    print("\n| stage | seconds: median | most | MB: median | most |\n| --- | --- | --- | --- | --- |")
    for stage in STAGES:
        manifests = [read_json(room / stage / "manifest.json") for room in rooms]
        seconds = [manifest["seconds"] for manifest in manifests]
        memory = [manifest["peak_memory_mb"] for manifest in manifests]
        figures = (statistics.median(seconds), max(seconds), statistics.median(memory), max(memory))
        print(f"| {stage} | " + " | ".join(f"{value:.1f}" for value in figures) + " |")


if __name__ == "__main__":
    main()
