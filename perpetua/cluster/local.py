"""Rooms on this machine: one here, or many in worker processes."""

import signal
import time
from collections.abc import Sequence
from types import FrameType

from perpetua.cluster.outcome import work_on
from perpetua.cluster.pool import LOOK_EVERY_S, Pool
from perpetua.pipeline.events import OnEvent
from perpetua.pipeline.lease import LeaseWatch
from perpetua.pipeline.room_work import RoomWork


def run_rooms(rooms: Sequence[int], workers: int, work: RoomWork, on_event: OnEvent) -> dict[int, str]:
    """Does the work of every room; a room that fails does not stop the others, one held by another run is waited for.

    Args:
        rooms: the rooms' indices.
        workers: processes that work at a time, as far as memory allows; a single room is done in this process.
        work: what is done with each.
        on_event: told everything that happens, in this process, one event at a time.

    Returns:
        The reason of failure of each room that failed.
    """
    if len(rooms) == 1:
        return _run_here(rooms[0], work, on_event)
    return Pool(min(workers, len(rooms)), work, on_event).run(rooms)


def raise_on_sigterm() -> None:
    """Makes SIGTERM end the work as Ctrl-C does: children die, what is finished stays."""

    def stop(number: int, frame: FrameType | None) -> None:
        # A second one must not cut the first one's tidying short.
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, stop)


def _run_here(room: int, work: RoomWork, on_event: OnEvent) -> dict[int, str]:
    while True:
        outcome = work_on(room, work, on_event)
        if outcome.kind != "held":
            return {room: outcome.reason} if outcome.kind == "failed" else {}
        watch = LeaseWatch(work.folder(room))
        while not watch.is_free():
            time.sleep(LOOK_EVERY_S)
