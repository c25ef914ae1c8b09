"""Rooms on this machine: one after another here, or several at a time in worker processes."""

import ctypes
import logging
import multiprocessing
import signal
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing.managers import SyncManager
from queue import Queue
from threading import Thread
from types import FrameType

from perpetua.errors import PerpetuaError
from perpetua.pipeline.events import Event, OnEvent

PR_SET_PDEATHSIG = 1

RoomJob = Callable[[int, OnEvent], None]


def run_rooms(rooms: Sequence[int], workers: int, job: RoomJob, on_event: OnEvent) -> dict[int, str]:
    """Runs ``job(room, on_event)`` for every room; a room that fails does not stop the others.

    Args:
        rooms: the rooms' indices.
        workers: processes that work at a time; with 1 the work is done in this process.
        job: a picklable callable.
        on_event: told everything that happens, in this process, one event at a time.

    Returns:
        The reason of failure of each room that failed.
    """
    if workers == 1 or len(rooms) == 1:
        return {room: reason for room in rooms if (reason := _run_one(room, job, on_event)) is not None}
    return _run_in_processes(rooms, workers, job, on_event)


def raise_on_sigterm() -> None:
    """Makes SIGTERM end the work as Ctrl-C does: children die, what is finished stays."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)


def _run_one(room: int, job: RoomJob, on_event: OnEvent) -> str | None:
    relay = _LogRelay(room, on_event)
    logging.getLogger("perpetua").addHandler(relay)
    try:
        job(room, on_event)
    except PerpetuaError as error:
        on_event(Event("room_failed", room, text=str(error)))
        return str(error)
    except Exception as error:
        logging.getLogger("perpetua").exception("room %d met an error that perpetua does not know", room)
        reason = f"unexpected {type(error).__name__}: {error}"
        on_event(Event("room_failed", room, text=reason))
        return reason
    finally:
        logging.getLogger("perpetua").removeHandler(relay)
    return None


class _LogRelay(logging.Handler):
    """Turns log lines of a room's work into events."""

    def __init__(self, room: int, on_event: OnEvent) -> None:
        super().__init__(logging.INFO)
        self.room, self.on_event = room, on_event

    def emit(self, record: logging.LogRecord) -> None:
        self.on_event(Event("message", self.room, text=self.format(record)))


def _run_in_processes(rooms: Sequence[int], workers: int, job: RoomJob, on_event: OnEvent) -> dict[int, str]:
    context = multiprocessing.get_context("spawn")
    failures: dict[int, str] = {}
    manager = SyncManager(ctx=context)
    manager.start(_start_manager)
    with manager:
        events: Queue[Event | None] = manager.Queue()
        reporter = Thread(target=_drain, args=(events.get, on_event), daemon=True)
        reporter.start()
        pool = ProcessPoolExecutor(min(workers, len(rooms)), mp_context=context, initializer=_start_worker)
        try:
            pending = {pool.submit(_run_one, room, job, events.put): room for room in rooms}
            for future in as_completed(pending):
                room = pending[future]
                # A worker that was killed breaks the pool: its room and those still waiting fail, none is lost.
                error = future.exception()
                reason = future.result() if error is None else f"its worker process ended: {error}"
                if reason is not None:
                    failures[room] = reason
        except KeyboardInterrupt:
            _stop(pool)
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
            events.put(None)
            reporter.join()
    return dict(sorted(failures.items()))


def _start_manager() -> None:
    """The events' keeper outlives the workers: it ends when the run does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    _die_with_parent()


def _start_worker() -> None:
    """A worker ends at once on SIGTERM, without a word: a stage is finished or absent, so nothing is lost."""
    logging.getLogger("perpetua").setLevel(logging.INFO)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _die_with_parent()


def _die_with_parent() -> None:
    """Asks the kernel (Linux alone can) to end this process when the run that started it is killed."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def _stop(pool: ProcessPoolExecutor) -> None:
    for process in list(pool._processes.values()):
        process.terminate()


def _drain(next_event: Callable[[], Event | None], on_event: OnEvent) -> None:
    while (event := next_event()) is not None:
        on_event(event)
