"""What one task of a Slurm array does on its node. Submitit keeps it as a pickle and calls it."""

import logging
import signal
import sys
from dataclasses import dataclass, field, replace
from typing import Any

from perpetua.cluster.local import raise_on_sigterm
from perpetua.cluster.plan import LAST_OF_GEOMETRY, has_geometry
from perpetua.cluster.pool import Pool
from perpetua.errors import PerpetuaError
from perpetua.io.files import read_json
from perpetua.machine.system_libraries import require_libraries
from perpetua.pipeline.events import Event
from perpetua.pipeline.layout import RunRecord
from perpetua.pipeline.progress import describe
from perpetua.pipeline.room_work import GenerateRequest, note_failures, room_work
from perpetua.pipeline.stages import STAGE_NAMES

# Attempts in a row in which nothing was finished, not even a frame, after which a task is not requeued again.
MOST_IDLE_ATTEMPTS = 3


@dataclass(frozen=True)
class RoomsTask:
    """Takes rooms through stages, in worker processes.

    Args:
        request: what the user asked for.
        rooms: those of this task.
        until: the last stage: the cameras in an array for geometry, else the audit.
        idle_attempts: earlier attempts in a row that came no further.
    """

    request: GenerateRequest
    rooms: tuple[int, ...]
    until: str
    idle_attempts: int = 0
    finished: list[str] = field(default_factory=list, compare=False)

    def __call__(self) -> None:
        """Does the work.

        Raises:
            PerpetuaError: some rooms failed, so that Slurm too lists the task as failed. A task of geometry ends well
                all the same: a dependent task must start for the rooms that came out.
        """
        logging.getLogger("perpetua").setLevel(logging.INFO)
        require_libraries()
        raise_on_sigterm()
        failed_before = self._failed_geometry() if self.until != LAST_OF_GEOMETRY else {}
        rooms = [room for room in self.rooms if room not in failed_before]
        try:
            failures = Pool(self.request.workers, room_work(self.request, self.until), self._tell).run(rooms)
        except KeyboardInterrupt:
            print("told to stop (SIGTERM): what is done is kept, and a further attempt goes on from it", flush=True)
            sys.exit(128 + signal.SIGTERM)
        note_failures(self.request, failures)
        for room, reason in (failed_before | failures).items():
            print(f"room {room} failed: {reason}", flush=True)
        failed = len(failed_before | failures)
        if self.until != LAST_OF_GEOMETRY and failed:
            raise PerpetuaError(f"{failed} of {len(self.rooms)} rooms failed; they are named above")

    def checkpoint(self) -> Any:
        """Called by submitit before it requeues the task, on preemption or shortly before its time is up.

        Returns:
            What is to be called in the next attempt; None where no further attempt makes sense.
        """
        from submitit.helpers import DelayedSubmission

        # Slurm's own signal to end comes while this process tidies up.
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        idle = 0 if self.finished else self.idle_attempts + 1
        if idle >= MOST_IDLE_ATTEMPTS:
            print(f"not requeued: {idle} attempts finished no frame and no stage; raise --time", flush=True)
            return None
        return DelayedSubmission(replace(self, idle_attempts=idle, finished=[]))

    def _tell(self, event: Event) -> None:
        if event.kind in ("stage_finished", "frame_rendered"):
            self.finished.append(event.stage)
        print(describe(event), flush=True)

    def _failed_geometry(self) -> dict[int, str]:
        """Rooms that the task before this one tried and could not make: not tried again where a GPU waits."""
        run = RunRecord(self.request.seed, self.rooms, self.request.config)
        failed = {}
        for room in self.rooms:
            layout = self.request.layout.room(room)
            failure = read_json(layout.failure_file)
            if failure.get("stage") in _GEOMETRY and not has_geometry(run, layout):
                failed[room] = str(failure.get("reason"))
        return failed


_GEOMETRY = STAGE_NAMES[: STAGE_NAMES.index(LAST_OF_GEOMETRY) + 1]
