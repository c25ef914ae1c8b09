"""Kills runs at random moments of every stage and compares what comes out with an undisturbed run.

``python benchmarks/kills.py --rooms 10 --out DIR``

Each room's run is killed with SIGKILL once in every stage, and once while its sequence is published, each time after a
random share of what the stage took undisturbed; then the same command is run again. ``DIR/kills.md`` and
``DIR/kills.json`` hold the table. Runs are forked from this process, which has imported everything: so a kill costs
no start of the interpreter. A run that was interrupted goes on with the rooms that are not in the table yet.
"""

import argparse
import json
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from perpetua.config import load_config
from perpetua.formats.layout import LOG_FILE
from perpetua.io.files import file_sha256, read_json, write_json
from perpetua.pipeline.layout import WORK_FOLDER, RunLayout
from perpetua.pipeline.room_work import GenerateRequest
from perpetua.pipeline.stages import STAGE_NAMES
from perpetua.pipeline.status import clean_work_area
from perpetua.pipeline.store import output_hashes
from perpetua.runs.generate import run_generate

CONFIG = Path(__file__).parent / "minimal.yaml"
PUBLISH = "publish"
MOMENTS = (*STAGE_NAMES, PUBLISH)
# A kill may come a little later than the stage took undisturbed: while it is hashed and put in place.
LATEST_FRACTION = 1.1
POLL_S = 0.002


@dataclass(frozen=True)
class Kill:
    """One kill: the stage it was meant for, where the run was by its log, and after how many seconds of that stage."""

    room: int
    moment: str
    seconds: float
    hit: str


def main() -> None:
    """The undisturbed run, then the kills of each room, then the comparison."""
    options = _options()
    calm, killed = options.out / "calm", options.out / "killed"
    seconds = _undisturbed(options, calm)
    done = read_json(options.out / "kills.json").get("rooms", {})
    for room in range(options.rooms):
        if str(room) not in done:
            rng = np.random.default_rng([options.seed, room])
            kills = list(_kill_often(options, killed, room, seconds, rng))
            code = _wait(_start(options, killed, range(room + 1)))
            done[str(room)] = {"exit_code": code, "kills": [asdict(kill) for kill in kills]}
            done[str(room)]["differences"] = _differences(options, calm, killed, room)
            write_json(options.out / "kills.json", {"rooms": done})
            print(_line(room, done[str(room)]), flush=True)
    freed = clean_work_area(killed, unfinished=False)
    table = _table(done, _leftovers(killed), freed)
    (options.out / "kills.md").write_text(table, encoding="utf-8")
    print(table)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rooms", type=int, default=10, help=f"each is killed {len(MOMENTS)} times")
    parser.add_argument("--seed", type=int, default=0, help="of the rooms and of the kills")
    parser.add_argument("--config", type=Path, default=CONFIG, help="settings")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    return parser.parse_args()


def _start(options: argparse.Namespace, out: Path, rooms: range) -> int:
    """A run in a process of its own; returns its number."""
    process = os.fork()
    if process:
        return process
    code = 3
    try:
        os.setsid()
        with (options.out / f"{out.name}.log").open("a", encoding="utf-8") as log:
            os.dup2(log.fileno(), 1)
            os.dup2(log.fileno(), 2)
            config = load_config("tiny", options.config)
            request = GenerateRequest(config, options.seed, rooms, None, out, 1, "cpu", False)
            code = run_generate(request, Console(file=log), dry_run=False)
    finally:
        os._exit(code)


def _wait(process: int) -> int:
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def _undisturbed(options: argparse.Namespace, out: Path) -> dict[str, float]:
    """Makes all rooms in peace; returns the mean seconds of each stage."""
    options.out.mkdir(parents=True, exist_ok=True)
    if _wait(_start(options, out, range(options.rooms))) != 0:
        sys.exit(f"the undisturbed run failed: see {options.out / 'calm.log'}")
    events = [json.loads(line) for line in (out / LOG_FILE).read_text(encoding="utf-8").splitlines()]
    finished = [event for event in events if event["kind"] == "stage_finished"]
    spent = {name: [event["seconds"] for event in finished if event["stage"] == name] for name in STAGE_NAMES}
    return {name: float(np.mean(times)) for name, times in spent.items()} | {PUBLISH: 1.0}


def _kill_often(
    options: argparse.Namespace, out: Path, room: int, seconds: dict[str, float], rng: np.random.Generator
) -> Iterator[Kill]:
    for moment in MOMENTS:
        after_s = float(rng.uniform(0.0, LATEST_FRACTION) * seconds[moment])
        log = _Tail(out / LOG_FILE)
        process = _start(options, out, range(room + 1))
        if _reach(process, log, room, moment):
            _sleep(process, after_s)
        os.kill(process, signal.SIGKILL)
        if _wait(process) == -signal.SIGKILL:
            hit = [event["stage"] or event["kind"] for event in log.new_events() if event["room"] == room]
            yield Kill(room, moment, round(after_s, 3), hit[-1] if hit else moment)


class _Tail:
    """New lines of a log."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._place = path.stat().st_size if path.exists() else 0

    def new_events(self) -> list[dict[str, Any]]:
        """What was added since the last call, whole lines alone."""
        if not self._path.exists():
            return []
        with self._path.open("rb") as handle:
            handle.seek(self._place)
            whole, newline, _ = handle.read().rpartition(b"\n")
        self._place += len(whole + newline)
        return [json.loads(line) for line in whole.splitlines() if line.strip(b"\0 ")]


def _reach(process: int, log: _Tail, room: int, moment: str) -> bool:
    """Waits until the run begins what is to be killed, or has gone past it; False if it ended before."""
    while os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
        for event in log.new_events():
            begun = event["kind"] in ("stage_started", "stage_skipped") and event["stage"] == moment
            published = moment == PUBLISH and event["stage"] == STAGE_NAMES[-1] and event["kind"] != "stage_started"
            if event["room"] == room and (begun or published or event["kind"] == "room_finished"):
                return True
        time.sleep(POLL_S)
    return False


def _sleep(process: int, seconds: float) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end and os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
        time.sleep(min(POLL_S, max(0.0, end - time.monotonic())))


def _differences(options: argparse.Namespace, calm: Path, killed: Path, room: int) -> list[str]:
    """Names of files that are not the same bytes in both runs' sequences and previews."""
    config = load_config("tiny", options.config)
    found: list[dict[str, str]] = []
    for out in (calm, killed):
        layout = RunLayout(out, config.export, options.seed).room(room)
        sheet = layout.contact_sheet
        found.append(output_hashes(layout.sequence_folder) | {"preview": file_sha256(sheet)})
    names = sorted(found[0].keys() | found[1].keys())
    return [name for name in names if found[0].get(name) != found[1].get(name)]


def _leftovers(out: Path) -> list[str]:
    """What a finished and cleaned output folder has no use for."""
    hidden = [path for path in out.rglob("*") if path.name.startswith(".") or path.name.endswith((".partial", ".tmp"))]
    return sorted(path.relative_to(out).as_posix() for path in hidden) + ([WORK_FOLDER] * (out / WORK_FOLDER).exists())


def _line(room: int, outcome: dict[str, Any]) -> str:
    different = outcome["differences"]
    same = "the same bytes" if not different else f"DIFFERENT: {', '.join(different)}"
    return f"room {room}: {len(outcome['kills'])} kills, exit code {outcome['exit_code']}, {same}"


def _table(done: dict[str, Any], leftovers: list[str], freed: float) -> str:
    kills = [kill for outcome in done.values() for kill in outcome["kills"]]
    where = Counter(kill["hit"] for kill in kills)
    lines = ["| killed in | kills |", "|---|---|", *(f"| {name} | {count} |" for name, count in where.items())]
    lines += ["", *(_line(int(room), outcome) for room, outcome in done.items())]
    lines += [
        f"{len(kills)} kills in all; clean freed {freed / 1e6:.1f} MB and left over: {leftovers or 'nothing'}",
        "",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
