"""The work on one room: through the stages, its contact sheet, and the note of a failure; picklable."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from perpetua.config import Config
from perpetua.errors import PerpetuaError
from perpetua.formats.reader import read_sequence
from perpetua.io.files import write_json
from perpetua.pipeline.cost import estimate_cost, require_room_space
from perpetua.pipeline.events import OnEvent
from perpetua.pipeline.layout import RoomLayout, RunLayout
from perpetua.pipeline.lease import hold
from perpetua.pipeline.os_errors import explained
from perpetua.pipeline.runner import RoomRun
from perpetua.pipeline.stages import STAGES
from perpetua.report.pictures.contact_sheet import write_contact_sheet

RoomJob = Callable[[int, OnEvent], None]
RoomFolder = Callable[[int], Path]


@dataclass(frozen=True)
class RoomWork:
    """What is done with each room. All must be picklable.

    ``job(room, on_event)`` does the work, ``folder(room)`` is where it is done, under a lease; ``memory_mb`` is what
    the work on one room may need at most, with all processes that it starts.
    """

    job: RoomJob
    folder: RoomFolder
    memory_mb: float


@dataclass(frozen=True)
class GenerateRequest:
    """What the user asked for. ``workers`` 0: as many as suit this machine."""

    config: Config
    seed: int
    rooms: range
    until: str | None
    out: Path
    workers: int
    device: str
    replace: bool

    @property
    def layout(self) -> RunLayout:
        """The folders of the run."""
        return RunLayout(self.out, self.config.export, self.seed)


def make_room(request: GenerateRequest, until: str, room: int, on_event: OnEvent) -> None:
    """One room through the stages, and its contact sheet."""
    if not request.layout.room(room).sequence_folder.exists():
        require_room_space(estimate_cost(request.config, 1), request.out)
    RoomRun(request.config, request.seed, room, request.out, request.device, on_event).run(until)
    layout = request.layout.room(room)
    if until == STAGES[-1].name and not layout.contact_sheet.exists():
        with hold(layout.work_folder):
            if not layout.contact_sheet.exists():
                with explained("preview", layout.contact_sheet):
                    _draw_contact_sheet(layout)


def room_work(request: GenerateRequest, until: str) -> RoomWork:
    """What is done with each room, in this process or another."""
    memory_mb = estimate_cost(request.config, len(request.rooms)).room_memory_mb
    return RoomWork(partial(make_room, request, until), partial(room_folder, request), memory_mb)


def note_failures(request: GenerateRequest, failures: dict[int, str]) -> None:
    """Leaves a note of failures that the room's own process could not note: it was killed, or met a fault of ours."""
    for room, reason in failures.items():
        layout = request.layout.room(room)
        if not layout.failure_file.exists():
            failure = {"stage": _first_missing(layout), "reason": reason, "exit_code": PerpetuaError.exit_code}
            # A full disk has no place for a note; the reason is said all the same.
            with suppress(OSError):
                write_json(layout.failure_file, failure)


def _first_missing(layout: RoomLayout) -> str:
    folders = {stage.name: layout.stage(stage) for stage in STAGES}
    return next((name for name, folder in folders.items() if folder.manifest() is None), STAGES[-1].name)


def room_folder(request: GenerateRequest, room: int) -> Path:
    """Where a room's work is done."""
    return request.layout.room(room).work_folder


def _draw_contact_sheet(layout: RoomLayout) -> None:
    partial_sheet = layout.contact_sheet.with_name(f".{layout.contact_sheet.name}")
    layout.contact_sheet.parent.mkdir(parents=True, exist_ok=True)
    write_contact_sheet(read_sequence(layout.sequence_folder), partial_sheet)
    partial_sheet.replace(layout.contact_sheet)
