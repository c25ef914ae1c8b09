"""Worker processes, each a room at a time: one that dies takes no other room with it.

The standard library's pools break or hang when a worker is killed, and start work without a look at memory.
"""

import ctypes
import logging
import multiprocessing
import os
import signal
import sys
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

import psutil

from perpetua.cluster.outcome import Outcome, work_on
from perpetua.machine.devices import share_machine
from perpetua.machine.free_memory import free_memory_mb
from perpetua.machine.memory import tree_memory_mb
from perpetua.pipeline.events import Event, OnEvent
from perpetua.pipeline.lease import LeaseWatch
from perpetua.pipeline.room_work import RoomWork

PR_SET_PDEATHSIG = 1
LOOK_EVERY_S = 1.0
# A worker that holds more than this after a room is replaced by a fresh one: what libraries keep grows with each room.
RECYCLED_ABOVE_MB = 1500.0


@dataclass
class Worker:
    """A process and what it is at. ``room`` is None while it waits; ``place`` numbers the pool's workers from 0."""

    process: BaseProcess
    connection: Connection
    place: int
    room: int | None = None

    def memory_mb(self) -> float:
        """Of it and all that it started; 0 if it has ended."""
        try:
            return tree_memory_mb(psutil.Process(self.process.pid))
        except psutil.Error:
            return 0.0

    def end(self) -> None:
        """Ends it, in the middle of its room if need be: a stage is finished or absent, so nothing is lost."""
        self.connection.close()
        self.process.terminate()
        self.process.join()


@dataclass
class Pool:
    """Takes rooms through worker processes.

    Args:
        size: processes at most.
        work: what is done with each room.
        on_event: told everything that happens, in this process, one event at a time.
    """

    size: int
    work: RoomWork
    on_event: OnEvent
    failures: dict[int, str] = field(default_factory=dict)
    _workers: list[Worker] = field(default_factory=list)
    _waiting: deque[int] = field(default_factory=deque)
    _held: dict[int, LeaseWatch] = field(default_factory=dict)
    _killed: set[int] = field(default_factory=set)
    _said_low: bool = False

    def run(self, rooms: Sequence[int]) -> dict[int, str]:
        """Does all rooms; those that another run holds come last, when they are free.

        Returns:
            The reason of failure of each room that failed.
        """
        self._waiting.extend(rooms)
        looked_at = time.monotonic()
        try:
            while self._waiting or self._held or self._busy():
                self._start_what_fits()
                self._listen()
                if time.monotonic() - looked_at >= LOOK_EVERY_S:
                    looked_at = time.monotonic()
                    self._look_at_held()
        finally:
            self._end_all()
        return dict(sorted(self.failures.items()))

    def _busy(self) -> list[Worker]:
        return [worker for worker in self._workers if worker.room is not None]

    def _start_what_fits(self) -> None:
        while self._waiting and len(self._busy()) < self.size and self._may_start(self._waiting[0]):
            worker = next((worker for worker in self._workers if worker.room is None), None)
            if worker is None:
                place = min(set(range(self.size)) - {worker.place for worker in self._workers})
                worker = _start_worker(self.work, place, self.size)
                self._workers.append(worker)
            worker.room = self._waiting.popleft()
            try:
                worker.connection.send(worker.room)
            except OSError:
                self._bury(worker)

    def _may_start(self, room: int) -> bool:
        """One room always may; a further one if all would still fit when each takes the most it may need."""
        busy = self._busy()
        if not busy:
            return True
        if self._killed & {room, *(worker.room for worker in busy)}:
            # Its worker was killed before, most likely for memory: it has the machine to itself.
            return False
        promised_mb = sum(max(0.0, self.work.memory_mb - worker.memory_mb()) for worker in busy)
        free_mb = free_memory_mb()
        fits = free_mb - promised_mb >= self.work.memory_mb
        if not fits and not self._said_low:
            self._said_low = True
            text = (
                f"waits for memory: {free_mb:.0f} MB are free, {promised_mb:.0f} MB of them kept for rooms at work, "
                f"and a room may need {self.work.memory_mb:.0f} MB"
            )
            self.on_event(Event("message", room, text=text))
        return fits

    def _listen(self) -> None:
        """Takes what workers have to say, waiting for it a moment."""
        by_connection = {worker.connection: worker for worker in self._workers}
        if not by_connection:
            time.sleep(LOOK_EVERY_S)
        for connection in wait(list(by_connection), LOOK_EVERY_S):
            worker = by_connection[connection]  # type: ignore[index]
            try:
                message = worker.connection.recv()
            except (EOFError, OSError):
                self._bury(worker)
                continue
            if isinstance(message, Event):
                self.on_event(message)
            else:
                self._settle(worker, message)

    def _settle(self, worker: Worker, outcome: Outcome) -> None:
        worker.room = None
        self._killed.discard(outcome.room)
        if outcome.kind == "failed":
            self.failures[outcome.room] = outcome.reason
        elif outcome.kind == "held":
            self._held[outcome.room] = LeaseWatch(self.work.folder(outcome.room))
        if worker.memory_mb() > RECYCLED_ABOVE_MB:
            self._workers.remove(worker)
            worker.end()

    def _bury(self, worker: Worker) -> None:
        """A worker died: its room is tried once more, after the others and alone, and then given up."""
        self._workers.remove(worker)
        worker.end()
        room = worker.room
        if room is None:
            return
        LeaseWatch(self.work.folder(room)).is_free()
        reason = f"its worker process was ended by {_name_end(worker.process.exitcode)}"
        if room in self._killed:
            self._killed.discard(room)
            self.failures[room] = f"{reason}, twice: if memory ran out, lower --workers or the size of the pictures"
            self.on_event(Event("room_failed", room, text=self.failures[room]))
        else:
            self._killed.add(room)
            self._waiting.append(room)
            self.on_event(Event("message", room, text=f"{reason}; it is tried once more, alone"))

    def _look_at_held(self) -> None:
        for room in [room for room, watch in self._held.items() if watch.is_free()]:
            del self._held[room]
            self._waiting.append(room)

    def _end_all(self) -> None:
        """Ends all workers; rooms in the middle of their work are free for others at once."""
        for worker in self._workers:
            worker.process.terminate()
        for worker in self._workers:
            worker.end()
            if worker.room is not None:
                LeaseWatch(self.work.folder(worker.room)).is_free()


def _name_end(exit_code: int | None) -> str:
    if exit_code is not None and exit_code < 0:
        name = signal.Signals(-exit_code).name
        return f"{name} (memory ran out, or someone stopped it)" if name == "SIGKILL" else name
    return f"exit code {exit_code}"


def _start_worker(work: RoomWork, place: int, size: int) -> Worker:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_work_until_closed, args=(theirs, work, os.getpid(), place, size), daemon=True)
    with _interrupts_held_back():
        process.start()
    # Ours alone is open now, so that a worker's end is seen as the end of what it says.
    theirs.close()
    return Worker(process, ours, place)


@contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """A process that is started meanwhile does not hear Ctrl-C before it ignores it; this one hears it afterwards."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _work_until_closed(connection: Connection, work: RoomWork, parent: int, place: int, size: int) -> None:
    """A worker's life."""
    share_machine(place, size)
    logging.getLogger("perpetua").setLevel(logging.INFO)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _die_with(parent)
    while True:
        try:
            room = connection.recv()
        except EOFError:
            return
        connection.send(work_on(room, work, connection.send))


def _die_with(parent: int) -> None:
    """Asks the kernel (Linux alone can) to end this process when the run that started it is killed."""
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            sys.exit(1)
