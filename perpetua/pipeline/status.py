"""``perpetua status`` and ``perpetua clean``: what an output folder holds."""

import shutil
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import mean
from typing import Any

from rich.table import Table

from perpetua.io.files import read_json
from perpetua.pipeline.layout import RunRecord, read_run
from perpetua.pipeline.lease import LeaseWatch, read_lease
from perpetua.pipeline.runner import published_redraw, rejected_draws, stage_keys
from perpetua.pipeline.stages import STAGES

# Of more rooms than this, those that are finished are not listed.
_MOST_LISTED = 50


@dataclass(frozen=True)
class RoomStatus:
    """How far one room is. ``seconds`` holds the time of each finished stage.

    ``outdated``: its sequence is there, made with other settings or by another version; ``generate --replace`` makes it
    anew.
    ``worker`` is who works on it, as far as can be told: of another machine also one that just ended without a word.
    """

    room: int
    finished: bool
    outdated: bool
    seconds: dict[str, float]
    failed_stage: str | None
    reason: str | None
    worker: str | None

    @property
    def state(self) -> str:
        """One word for the room."""
        if self.finished:
            return "finished"
        if self.worker is not None:
            return "at work"
        if self.failed_stage is not None:
            return "failed"
        if self.seconds:
            return "started"
        return "outdated" if self.outdated else "waiting"


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
        lines += [f"room {room.room} is at work: {room.worker}" for room in self.rooms if room.worker is not None]
        if any(room.state == "outdated" for room in self.rooms):
            lines.append(
                "outdated: the sequence was made with other settings or by another version of perpetua, and generate "
                "--replace would make it anew; to keep it, generate to another --out"
            )
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
    layout = run.layout(out).room(room)
    published = published_redraw(layout, run.config)
    rejected = rejected_draws(layout, run.config) if published is None else published
    keys = stage_keys(run.config, run.seed, room, rejected)
    seconds: dict[str, float] = {}
    for stage in STAGES:
        manifest = layout.stage(stage).manifest()
        if manifest is not None and manifest.key == keys[stage.name]:
            seconds[stage.name] = manifest.seconds
    failure = read_json(layout.failure_file)
    _, holder = read_lease(layout.work_folder)
    return RoomStatus(
        room=room,
        finished=published is not None,
        outdated=published is None and layout.sequence_folder.is_dir(),
        seconds=seconds,
        failed_stage=failure.get("stage"),
        reason=failure.get("reason"),
        worker=None if holder is None or holder.is_over else str(holder),
    )


def status_table(report: StatusReport) -> Table:
    """Rooms by stages; of many rooms those that are not finished."""
    table = Table("room", "state", *(stage.name for stage in STAGES))
    if len(report.rooms) > _MOST_LISTED:
        table.caption = "finished rooms are left out"
    for room in report.rooms:
        if room.finished and len(report.rooms) > _MOST_LISTED:
            continue
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

    A room that someone is working on is left alone.

    Raises:
        InputError: ``out`` holds no run.
    """
    run = read_run(out)
    report = read_status(out)
    freed = 0.0
    for room in report.rooms:
        layout = run.layout(out).room(room.room)
        if (room.finished or unfinished) and LeaseWatch(layout.work_folder).is_free():
            freed += _remove(layout.work_folder)
            for left in layout.sequence_folder.parent.glob(f".{layout.sequence_folder.name}.*"):
                freed += _remove(left)
    work_area = run.layout(out).work_area
    # What is left when no room is at work or to be made: the files of Slurm's tasks, and the leases of their folders.
    if unfinished or all(room.finished for room in report.rooms):
        in_use = [run.layout(out).room(room.room).work_folder for room in report.rooms]
        if not any(folder.exists() for folder in in_use):
            freed += _remove(work_area)
    return freed


def _remove(folder: Path) -> float:
    """Bytes count only where no finished sequence shares the file."""
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and path.stat().st_nlink == 1)
    shutil.rmtree(folder, ignore_errors=True)
    return float(size)
