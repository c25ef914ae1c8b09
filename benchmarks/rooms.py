"""Makes rooms of consecutive seeds and tells what they are and what they cost.

``python benchmarks/rooms.py --seeds 50 --source infinigen --out DIR``

Each seed's room is made by ``build_room``, with all its checks and redraws, in a fresh process; CPU seconds and peak
memory are those of that process and all it starts. ``DIR/rooms.md`` and ``DIR/rooms.json`` hold the table, written
anew after each room. A seed whose room was made with the same code is not made again, so the run can be interrupted.
"""

import argparse
import hashlib
import json
import resource
import statistics
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from perpetua.errors import PerpetuaError
from perpetua.io.files import read_json, write_json
from perpetua.machine.memory import PeakMemory
from perpetua.machine.scripts import scripts_sha256
from perpetua.navigation.config import NavigationConfig
from perpetua.rooms.acceptance.build import REPORT_FILE, build_room
from perpetua.rooms.config import RoomsConfig
from perpetua.rooms.fingerprint import room_sha256
from perpetua.rooms.infinigen import SCRIPT
from perpetua.seeding import StageSeed

PACKAGE = Path(__file__).parents[1] / "perpetua"
RESULT_FILE = "result.json"
COLUMNS = (
    ("seed", "seed"),
    ("kind", "kind"),
    ("light", "light"),
    ("objects", "objects"),
    ("triangles", "triangles"),
    ("free_floor_m2", "free floor m2"),
    ("redrawn", "redraws"),
    ("cpu_s", "CPU s"),
    ("wall_s", "wall s"),
    ("peak_mb", "MB"),
    ("gap_p95_mm", "gap p95 mm"),
    ("gap_far", "gap > 2 cm"),
    ("sha", "sha256"),
)


def main() -> None:
    """Runs all seeds, or the one that a process of this program asks for."""
    options = _options()
    if options.one is not None:
        _measure(options.one, options)
        return
    options.out.mkdir(parents=True, exist_ok=True)
    seeds = range(options.first, options.first + options.seeds)
    with ThreadPoolExecutor(options.jobs) as pool:
        for _ in pool.map(lambda seed: _run(seed, options), seeds):
            _write_table(options, [_result(options.out, seed) for seed in seeds])
    print((options.out / "rooms.md").read_text(encoding="utf-8"))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=50, help="how many")
    parser.add_argument("--first", type=int, default=0, help="the first of them")
    parser.add_argument("--source", default="infinigen", help="rooms.source")
    parser.add_argument("--kind", default=None, help="one kind alone")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    parser.add_argument("--jobs", type=int, default=1, help="rooms made at a time")
    parser.add_argument("--keep", action="store_true", help="keep each room's .blend")
    parser.add_argument("--one", type=int, default=None, help=argparse.SUPPRESS)
    return parser.parse_args()


def _code_sha256(source: str) -> str:
    """Of the code that makes and checks the rooms of a source."""
    digest = hashlib.sha256()
    if source == "infinigen":
        digest.update(scripts_sha256((SCRIPT,)).encode())
    for path in sorted((PACKAGE / "rooms").rglob("*.py")):
        if source == "procedural" or "procedural" not in path.parts:
            digest.update(path.relative_to(PACKAGE).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()


def _result(out: Path, seed: int) -> dict[str, Any]:
    return read_json(out / f"{seed:04d}" / RESULT_FILE)


def _run(seed: int, options: argparse.Namespace) -> None:
    """Makes the room of a seed in a process of its own, unless it is there."""
    if _result(options.out, seed).get("code") == _code_sha256(options.source):
        return
    subprocess.run([sys.executable, __file__, *sys.argv[1:], "--one", str(seed)], check=True)


def _measure(seed: int, options: argparse.Namespace) -> None:
    folder = options.out / f"{seed:04d}"
    folder.mkdir(parents=True, exist_ok=True)
    code = _code_sha256(options.source)
    kinds = {} if options.kind is None else {"kinds": (options.kind,)}
    config = RoomsConfig(source=options.source, **kinds)
    result: dict[str, Any] = {"seed": seed, "code": code}
    begin_s = time.monotonic()
    with PeakMemory() as memory:
        try:
            room = build_room(config, NavigationConfig(), StageSeed(seed, 0, "room"), folder)
            result |= read_json(folder / REPORT_FILE) | {"sha256": room_sha256(room)}
        except PerpetuaError as error:
            result["error"] = str(error)
    result |= {"wall_s": time.monotonic() - begin_s, "cpu_s": _cpu_s(), "peak_mb": memory.peak_mb}
    if not options.keep:
        (folder / "room.blend").unlink(missing_ok=True)
    write_json(folder / RESULT_FILE, result)


def _cpu_s() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _write_table(options: argparse.Namespace, results: list[dict[str, Any]]) -> None:
    results = [result for result in results if result]
    lines = [f"# {len(results)} rooms by {options.source}, seeds from {options.first}", "", _summary(results), ""]
    lines += [_line([title for _, title in COLUMNS]), _line(["---"] * len(COLUMNS))]
    lines += [_line([_row(result)[name] for name, _ in COLUMNS]) for result in results]
    failed = [result for result in results if "error" in result]
    lines += ["", *(f"- seed {result['seed']}: {result['error']}" for result in failed)]
    lines += [
        f"- seed {result['seed']}, redrawn: {redraw['reason']}"
        for result in results
        for redraw in result.get("redraws", [])
    ]
    (options.out / "rooms.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (options.out / "rooms.json").write_text(json.dumps(results, indent=1), encoding="utf-8")


def _summary(results: list[dict[str, Any]]) -> str:
    made = [result for result in results if "error" not in result]
    reasons = Counter(redraw["rule"] for result in made for redraw in result["redraws"])
    kinds = Counter(result["kind"] for result in made)
    medians = {name: statistics.median(result[name] for result in results) for name in ("cpu_s", "wall_s", "peak_mb")}
    return (
        f"{len(made)} of {len(results)} made; medians {medians['cpu_s']:.1f} CPU s, {medians['wall_s']:.1f} wall s, "
        f"{medians['peak_mb']:.0f} MB; largest {max(result['peak_mb'] for result in results):.0f} MB; "
        f"redraws {dict(reasons)}; kinds {dict(kinds)}"
    )


def _row(result: dict[str, Any]) -> dict[str, str]:
    if "error" in result:
        return {name: "" for name, _ in COLUMNS} | {"seed": str(result["seed"]), "kind": "none"}
    wish, gap = result["wish"], result.get("collider_gap")
    rules = Counter(redraw["rule"] for redraw in result["redraws"])
    return {
        "seed": str(result["seed"]),
        "kind": result["kind"],
        "light": f"{wish['daytime']}, lamps {'on' if wish['lamps_on'] else 'off'}",
        "objects": str(result["objects"]),
        "triangles": str(result["triangles"]),
        "free_floor_m2": f"{result['free_floor_m2']:.1f}",
        "redrawn": ", ".join(f"{count} x {rule}" for rule, count in rules.items()) or "0",
        "cpu_s": f"{result['cpu_s']:.1f}",
        "wall_s": f"{result['wall_s']:.1f}",
        "peak_mb": f"{result['peak_mb']:.0f}",
        "gap_p95_mm": "" if gap is None else f"{1000.0 * gap['p95_m']:.1f}",
        "gap_far": "" if gap is None else f"{100.0 * gap['share_beyond_2_cm']:.1f} %",
        "sha": result["sha256"][:12],
    }


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
