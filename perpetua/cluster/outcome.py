"""One room's work, wherever it runs: what came of it, and its own log."""

import logging
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Literal

from perpetua.errors import PerpetuaError
from perpetua.pipeline.events import Event, OnEvent, log_line
from perpetua.pipeline.layout import ROOM_LOG
from perpetua.pipeline.lease import LeaseHeldError, LeaseLostError
from perpetua.pipeline.room_work import RoomWork

logger = logging.getLogger("perpetua")


@dataclass(frozen=True)
class Outcome:
    """What came of one room: done, failed for a reason, or held by another run."""

    room: int
    kind: Literal["done", "failed", "held"]
    reason: str = ""


def work_on(room: int, work: RoomWork, on_event: OnEvent) -> Outcome:
    """Does a room's work here. Whatever it raises, but a wish to stop, becomes its outcome."""
    tell = RoomLog(work.folder(room) / ROOM_LOG, on_event)
    with _LogRelay(room, tell):
        try:
            work.job(room, tell)
        except (LeaseHeldError, LeaseLostError) as error:
            tell(Event("message", room, text=f"left to another run: {error}"))
            return Outcome(room, "held", str(error))
        except PerpetuaError as error:
            tell(Event("room_failed", room, text=str(error)))
            return Outcome(room, "failed", str(error))
        except Exception as error:
            logger.exception("room %d met an error that perpetua does not know", room)
            reason = f"unexpected {type(error).__name__}: {error}"
            tell(Event("room_failed", room, text=reason))
            return Outcome(room, "failed", reason)
    return Outcome(room, "done")


class RoomLog:
    """Hands events on, and appends them to the room's log; a room that was finished before gets no line.

    Args:
        path: the log, one JSON object per line.
        on_event: told every event.
    """

    def __init__(self, path: Path, on_event: OnEvent) -> None:
        self._path, self._on_event = path, on_event
        self._waiting: list[str] = []
        self._something_done = False

    def __call__(self, event: Event) -> None:
        """Takes one event."""
        self._on_event(event)
        self._waiting.append(log_line(event))
        self._something_done |= event.kind not in ("room_started", "room_finished")
        # A folder that is not there was freed, and is not made again for a log.
        if self._something_done and self._path.parent.is_dir():
            # A full disk costs lines of the log, not the room, whose own error says what is wrong.
            with suppress(OSError), self._path.open("a", encoding="utf-8") as log:
                log.writelines(self._waiting)
            self._waiting.clear()


class _LogRelay(logging.Handler):
    """Turns log lines of a room's work into events."""

    def __init__(self, room: int, on_event: OnEvent) -> None:
        super().__init__(logging.INFO)
        self.room, self.on_event = room, on_event

    def __enter__(self) -> "_LogRelay":
        logger.addHandler(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        logger.removeHandler(self)

    def emit(self, record: logging.LogRecord) -> None:
        self.on_event(Event("message", self.room, text=self.format(record)))
