"""Makes many cheap rooms in one run: does memory stay flat, and does a room cost the same at the end as at the start?

``python benchmarks/many_rooms.py --rooms 200 --workers 1 2 --out DIR``

The memory of the run's own process and of its workers (without the Blender processes that they start) is sampled
while rooms are made. ``DIR/many_rooms.md`` holds the table: one line for each tenth of the rooms, with the mean
seconds of a room in it. Rooms differ, so a line fitted to all of them says whether they become slower.
"""

import argparse
import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import mean

import numpy as np
import psutil

from perpetua.formats.layout import LOG_FILE

CONFIG = Path(__file__).parent / "minimal.yaml"
SAMPLE_EVERY_S = 2.0
PARTS = 10


@dataclass(frozen=True)
class Sample:
    """Memory at one moment; ``time_s`` as the log counts it."""

    time_s: float
    parent_mb: float
    largest_worker_mb: float


def main() -> None:
    """One run for each number of workers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rooms", type=int, default=200, help="in each run")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2], help="one run for each number")
    parser.add_argument("--seed", type=int, default=0, help="of the rooms")
    parser.add_argument("--out", type=Path, required=True, help="folder of the results")
    options = parser.parse_args()
    tables = []
    for workers in options.workers:
        out = options.out / f"workers_{workers}"
        samples = _run(options, workers, out)
        tables.append(f"## {workers} worker(s)\n\n" + _table(out, samples))
    page = "\n".join(tables)
    (options.out / "many_rooms.md").write_text(page, encoding="utf-8")
    print(page)


def _run(options: argparse.Namespace, workers: int, out: Path) -> list[Sample]:
    command = [sys.executable, "-c", "from perpetua.cli.app import main; main()", "generate", "--preset", "tiny"]
    command += ["--config", str(CONFIG), "--seed", str(options.seed), "--rooms", str(options.rooms)]
    command += ["--workers", str(workers), "--set", "work.keep=none", "--out", str(out)]
    options.out.mkdir(parents=True, exist_ok=True)
    samples = []
    with (options.out / f"workers_{workers}.log").open("w", encoding="utf-8") as log:
        run = subprocess.Popen(command, stdout=log, stderr=log)
        while run.poll() is None:
            samples.append(_sample(run.pid))
            time.sleep(SAMPLE_EVERY_S)
    if run.returncode not in (0, 1):
        sys.exit(f"the run ended with exit code {run.returncode}: see {options.out / f'workers_{workers}.log'}")
    return samples


def _sample(pid: int) -> Sample:
    parent_mb, workers_mb = 0.0, [0.0]
    try:
        parent = psutil.Process(pid)
        parent_mb = parent.memory_info().rss / 1e6
        for child in parent.children():
            if "render_frames.py" not in " ".join(child.cmdline()):
                workers_mb.append(child.memory_info().rss / 1e6)
    except psutil.Error:
        # It ended in the meantime.
        pass
    return Sample(time.time(), parent_mb, max(workers_mb))


def _table(out: Path, samples: list[Sample]) -> str:
    events = [json.loads(line) for line in (out / LOG_FILE).read_text(encoding="utf-8").splitlines()]
    started = {event["room"]: event["time"] for event in events if event["kind"] == "room_started"}
    finished = [(event["time"], event["room"]) for event in events if event["kind"] == "room_finished"]
    lines = [
        "| rooms | s per room | s per room, by the clock | parent MB | largest worker MB |",
        "|---|---|---|---|---|",
    ]
    size = max(1, len(finished) // PARTS)
    begin = min(started.values())
    failed = len(started) - len(finished)
    for first in range(0, len(finished), size):
        part = finished[first : first + size]
        end = part[-1][0]
        seen = [sample for sample in samples if begin <= sample.time_s <= end]
        seconds = mean(when - started[room] for when, room in part)
        parent_mb = max((sample.parent_mb for sample in seen), default=0.0)
        worker_mb = max((sample.largest_worker_mb for sample in seen), default=0.0)
        clock_s = (end - begin) / len(part)
        rooms = f"{first} to {first + len(part) - 1}"
        lines.append(f"| {rooms} | {seconds:.2f} | {clock_s:.2f} | {parent_mb:.0f} | {worker_mb:.0f} |")
        begin = end
    slope_s, first_s = np.polyfit(range(len(finished)), [when - started[room] for when, room in finished], 1)
    last_s = first_s + slope_s * (len(finished) - 1)
    change = f"{100 * (last_s / first_s - 1):+.1f}%"
    lines += ["", f"Fitted line: {first_s:.2f} s for the first room, {last_s:.2f} s for the last ({change})."]
    lines += [f"Failed: {failed} of {len(started)}."]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
