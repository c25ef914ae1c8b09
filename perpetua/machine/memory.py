"""Peak memory of this process and everything it starts."""

import ctypes
import gc
import threading
from types import TracebackType

import psutil


class PeakMemory:
    """Context manager that samples the resident memory of the process tree; ``peak_mb`` afterwards."""

    def __init__(self, interval_s: float = 0.2) -> None:
        self.peak_mb = 0.0
        self._interval_s = interval_s
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)

    def __enter__(self) -> "PeakMemory":
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._done.set()
        self._thread.join()

    def _watch(self) -> None:
        root = psutil.Process()
        while True:
            self.peak_mb = max(self.peak_mb, tree_memory_mb(root))
            if self._done.wait(self._interval_s):
                return


def tree_memory_mb(root: psutil.Process) -> float:
    """Resident memory of a process and all that it started, megabytes; 0 if it has ended."""
    try:
        processes = [root, *root.children(recursive=True)]
    except psutil.Error:
        return 0.0
    total = 0
    for process in processes:
        try:
            total += process.memory_info().rss
        except psutil.Error:
            continue
    return total / 1e6


def give_back() -> None:
    """Returns freed memory to the system: the C library keeps what it once had, so a worker would stay as large as its
    largest room made it."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
