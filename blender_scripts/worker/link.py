# SPDX-License-Identifier: GPL-3.0-or-later
"""What every script that Blender runs needs: its job, events for the parent, and an end when the parent ends.

An event is one line of JSON on the stdout that the parent gave us. Everything else that is written to stdout
(Blender's own progress) goes to stderr.
"""

import ctypes
import json
import os
import select
import signal
import sys
from pathlib import Path

PR_SET_PDEATHSIG = 1
# Set where stdin is a pipe that breaks when the parent ends.
PARENT_PIPE_VARIABLE = "PERPETUA_PARENT_PIPE"


class Worker:
    """The link to the parent process."""

    def __init__(self) -> None:
        self._parent = os.getppid()
        self._die_with_parent()
        # A parent that was killed while Blender was being loaded has someone else at work here by now.
        self.check_parent()
        self._events = os.fdopen(os.dup(1), "w", buffering=1, encoding="utf-8")
        os.dup2(2, 1)

    def job_path(self) -> Path:
        """The job file named on the command line, with bpy (``script job``) or Blender (``... -- job``)."""
        arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
        if len(arguments) != 1:
            raise SystemExit("one argument is needed: the path of the job file")
        return Path(arguments[0])

    def emit(self, event: str, **fields: object) -> None:
        """Tells the parent something."""
        self._events.write(json.dumps({"event": event, **fields}) + "\n")
        self._events.flush()

    def check_parent(self) -> None:
        """Ends this process if the parent is gone (where the kernel does not do so)."""
        if os.getppid() != self._parent or _parent_pipe_is_broken():
            os._exit(1)

    def _die_with_parent(self) -> None:
        if not sys.platform.startswith("linux"):
            return
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def _parent_pipe_is_broken() -> bool:
    if PARENT_PIPE_VARIABLE not in os.environ:
        return False
    watch = select.poll()
    watch.register(0, 0)
    return any(events & (select.POLLHUP | select.POLLERR) for _, events in watch.poll(0))


def read_job(path: Path) -> dict:
    """The job file's content."""
    return json.loads(path.read_text(encoding="utf-8"))


def write_atomically(path: Path, content: bytes) -> None:
    """A file that is there in full or not at all."""
    temporary = path.with_name(path.name + ".tmp")
    temporary.write_bytes(content)
    temporary.replace(path)
