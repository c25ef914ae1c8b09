# SPDX-License-Identifier: GPL-3.0-or-later
"""Ends a generation that takes too much memory, and says so, before the machine does it without a word."""

import os
import threading
import time
from pathlib import Path

from blender_scripts.worker.link import Worker

INTERVAL_S = 0.25
STATUS = Path("/proc/self/statm")


class Watchdog(threading.Thread):
    """Watches the resident memory of this process; without effect where the system does not tell it."""

    def __init__(self, worker: Worker, max_memory_mb: float) -> None:
        super().__init__(daemon=True)
        self._worker = worker
        self._max_memory_mb = max_memory_mb

    def run(self) -> None:
        """Looks until the process ends."""
        while STATUS.is_file():
            memory_mb = int(STATUS.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
            if memory_mb > self._max_memory_mb:
                limit = f"rooms.max_memory_mb = {self._max_memory_mb:.0f}"
                self._worker.emit("refused", rule="memory", reason=f"Infinigen took {memory_mb:.0f} MB; {limit}")
                os._exit(1)
            time.sleep(INTERVAL_S)
