"""``perpetua status`` and ``perpetua clean``: what an output folder holds."""

import shutil
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import mean
from typing import Any

from rich.table import Table

from perpetua.files import read_json
from perpetua.pipeline.layout import WORK_FOLDER, OutputLayout, RunRecord, read_run
from perpetua.pipeline.runner import published_redraw, rejected_draws, stage_keys
from perpetua.pipeline.stages import STAGES
from perpetua.pipeline.store import StageFolder


@dataclass(frozen=True)
class RoomStatus:
    """How far one room is. ``seconds`` holds the time of each finished stage."""

    room: int
    finished: bool
    seconds: dict[str, float]
    failed_stage: str | None
    reason: str | None

    @property
    def state(self) -> str:
        """One word for the room."""
        if self.finished:
            return "finished"
        if self.failed_stage is not None:
            return "failed"
        return "started" if self.seconds else "waiting"


@dataclass(frozen=True)
class StatusReport:
    """How far all rooms asked for are."""

    rooms: tuple[RoomStatus, ...]

    @property
    def seconds_left(self) -> float | None:
        """Work left on one worker, from the mean time of each stage so far; None before a stage is known."""
        known = {
            stage.name: mean(times)
            for stage in STAGES
            if (times := [room.seconds[stage.name] for room in self.rooms if stage.name in room.seconds])
        }
        open_rooms = [room for room in self.rooms if not room.finished]
        missing = [stage.name for room in open_rooms for stage in STAGES if stage.name not in room.seconds]
        if any(name not in known for name in missing):
            return None
        return sum(known[name] for name in missing)

    def notes(self) -> list[str]:
        """The reasons of failures and the time left, as lines."""
        lines = [f"room {room.room} failed in {room.failed_stage}: {room.reason}" for room in self.rooms if room.reason]
        done = sum(room.finished for room in self.rooms)
        left = self.seconds_left
        time_left = "not known yet" if left is None else f"about {left / 60:.1f} min on one worker"
        return [*lines, f"{done} of {len(self.rooms)} rooms finished; time left: {time_left}"]

    def to_json(self) -> dict[str, Any]:
        """Plain values for machines."""
        return {
            "rooms": [{**asdict(room), "state": room.state} for room in self.rooms],
            "seconds_left": self.seconds_left,
        }


def read_status(out: Path) -> StatusReport:
    """Looks at every room that was asked for in ``out``.

    Raises:
        InputError: ``out`` holds no run.
    """
    run = read_run(out)
    return StatusReport(tuple(_room_status(out, run, room) for room in run.rooms))


def _room_status(out: Path, run: RunRecord, room: int) -> RoomStatus:
    layout = OutputLayout(out, run.config.export, run.seed, room)
    published = published_redraw(layout, run.config)
    rejected = rejected_draws(layout, run.config) if published is None else published
    keys = stage_keys(run.config, run.seed, room, rejected)
    seconds: dict[str, float] = {}
    for stage in STAGES:
        manifest = StageFolder(layout.work_folder, stage.number, stage.name).manifest()
        if manifest is not None and manifest.key == keys[stage.name]:
            seconds[stage.name] = manifest.seconds
    failure = read_json(layout.failure_file)
    return RoomStatus(
        room=room,
        finished=published is not None,
        seconds=seconds,
        failed_stage=failure.get("stage"),
        reason=failure.get("reason"),
    )


def status_table(report: StatusReport) -> Table:
    """Rooms by stages."""
    table = Table("room", "state", *(stage.name for stage in STAGES))
    for room in report.rooms:
        cells = []
        for stage in STAGES:
            if stage.name in room.seconds:
                cells.append(f"{room.seconds[stage.name]:.1f} s")
            elif stage.name == room.failed_stage:
                cells.append("failed")
            else:
                cells.append("done" if room.finished else "-")
        table.add_row(str(room.room), room.state, *cells)
    return table


def clean_work_area(out: Path, unfinished: bool) -> float:
    """Removes the work area of finished rooms, of all with ``unfinished``; returns the bytes freed.

    Raises:
        InputError: ``out`` holds no run.
    """
    run = read_run(out)
    report = read_status(out)
    freed = 0.0
    for room in report.rooms:
        if room.finished or unfinished:
            layout = OutputLayout(out, run.config.export, run.seed, room.room)
            freed += _remove(layout.work_folder)
            for left in layout.sequence_folder.parent.glob(f".{layout.sequence_folder.name}.*"):
                freed += _remove(left)
    work_area = out / WORK_FOLDER
    if work_area.exists() and not any(work_area.iterdir()):
        work_area.rmdir()
    return freed


def _remove(folder: Path) -> float:
    """Bytes count only where no finished sequence shares the file."""
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and path.stat().st_nlink == 1)
    shutil.rmtree(folder, ignore_errors=True)
    return float(size)
