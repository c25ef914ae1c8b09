"""Waiting for what another process does, without a guess at how long it takes."""

import time
from collections.abc import Callable
from pathlib import Path


def wait_for(is_so: Callable[[], object], what: str, most_s: float = 120.0, look_every_s: float = 0.02) -> None:
    """Waits until something is so; fails, saying what was waited for, when a machine of any speed would be done.

    The clock is another than the one that tests of leases replace.
    """
    end_s = time.perf_counter() + most_s
    while not is_so():
        assert time.perf_counter() < end_s, f"waited {most_s:g} s for {what}"
        time.sleep(look_every_s)


def has_ended(pid: int) -> bool:
    """Whether a process is gone, or dead and only still listed."""
    try:
        status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8", errors="replace")
    except (FileNotFoundError, ProcessLookupError):
        return True
    return "State:\tZ" in status
