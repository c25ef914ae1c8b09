"""What the user sees while rooms are made: a live table on a terminal, plain lines elsewhere, and log.jsonl."""

import time
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from types import TracebackType

from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from perpetua.pipeline.events import Event, log_line


class Progress(AbstractContextManager["Progress"]):
    """Takes the runner's events one at a time, shows them, and appends them to ``log.jsonl``.

    Args:
        log_path: the machine-readable log, one JSON object per line.
        rooms: how many rooms the run makes.
        images_per_frame: views rendered per frame, for the estimate after the first frame.
        console: where to show; a live table if it is a terminal.
    """

    def __init__(self, log_path: Path, rooms: int, images_per_frame: int, console: Console) -> None:
        self._log_path = log_path
        self._rooms = rooms
        self._images_per_frame = images_per_frame
        self._console = console
        self._live = Live(console=console, refresh_per_second=4) if console.is_terminal else None
        self._lines: dict[int, Event] = {}
        self._last_frame_line = 0.0
        self._estimated = False

    def __enter__(self) -> "Progress":
        if self._live is not None:
            self._live.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.__exit__(kind, error, trace)

    def show(self, event: Event) -> None:
        """Takes one event."""
        # A full disk costs lines of the log, not the run: what failed for it says so itself.
        with suppress(OSError), self._log_path.open("a", encoding="utf-8") as log:
            log.write(log_line(event))
        if event.kind == "frame_rendered" and not self._estimated and event.seconds > 0:
            self._estimated = True
            self._console.print(self._estimate(event), highlight=False, markup=False)
        if self._live is None:
            self._print_line(event)
        else:
            self._update_table(self._live, event)

    def _estimate(self, event: Event) -> str:
        per_image = event.seconds / self._images_per_frame
        left = event.seconds * (event.frames_total - event.frames_done)
        line = f"first frame: {per_image:.1f} s per image; about {_duration(left)} of rendering left for this room"
        if self._rooms > 1:
            line += f", {_duration(event.seconds * event.frames_total)} for each further one"
        return line

    def _print_line(self, event: Event) -> None:
        if event.kind == "frame_rendered":
            last = event.frames_done == event.frames_total
            if not last and time.monotonic() - self._last_frame_line < 10:
                return
            self._last_frame_line = time.monotonic()
        self._console.print(describe(event), highlight=False, markup=False, soft_wrap=True)

    def _update_table(self, live: Live, event: Event) -> None:
        if event.kind in ("message", "room_failed", "stage_finished", "room_finished"):
            live.console.print(describe(event), highlight=False, markup=False)
        if event.kind in ("room_finished", "room_failed"):
            self._lines.pop(event.room, None)
        elif event.kind != "message":
            self._lines[event.room] = event
        table = Table.grid(padding=(0, 2))
        for room in sorted(self._lines):
            table.add_row(Text(describe(self._lines[room])))
        live.update(table)


def describe(event: Event) -> str:
    """One event as a line of plain text."""
    head = f"room {event.room}: "
    match event.kind:
        case "room_started":
            return head + "started"
        case "stage_started":
            return head + f"{event.stage} ..."
        case "stage_skipped":
            return head + f"{event.stage} was done before"
        case "stage_finished":
            return head + f"{event.stage} done in {_duration(event.seconds)}, peak memory {event.peak_memory_mb:.0f} MB"
        case "frame_rendered":
            return head + f"frame {event.frames_done} of {event.frames_total} rendered"
        case "room_finished":
            return head + "finished"
        case "room_failed":
            return head + f"FAILED: {event.text}"
        case "message":
            return head + event.text


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.1f} s"
    if seconds < 5400:
        return f"{seconds / 60:.1f} min"
    return f"{seconds / 3600:.1f} h"
