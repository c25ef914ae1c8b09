"""Who may work in a folder: one holder at a time, on one machine or on many that share the folder.

Shared file systems lock files badly or not at all, and the clocks of machines differ, so neither is relied on. A lease
is a numbered file: ``.lease-000001``, then ``.lease-000002`` for the next holder. The highest number holds. Creating a
file that must not exist yet is atomic on every file system in use (on NFS since version 3), so of several that want
the next number exactly one gets it, and no file is ever overwritten or taken away by another than its holder.

The holder counts up a heartbeat in its own file, through the handle it made it with. Others may go on when the holder
says it is done; when it was a process of the same machine that lives no more; or when its heartbeat did not change over
``SILENT_BEATS`` looks, each a heartbeat apart on the looker's own monotonic clock (a looker that was itself frozen
counts one look, not the time it missed). A holder that was frozen and wakes sees the higher number and stops.
"""

import json
import os
import socket
import sys
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from threading import Event, Lock, Thread

from perpetua.errors import InputError, PerpetuaError

HEARTBEAT_VARIABLE = "PERPETUA_HEARTBEAT_S"
HEARTBEAT_S = 10.0
# Long enough for a file server that fails over, or one call into a library that lets no other thread run.
SILENT_BEATS = 12

_PREFIX = ".lease-"
# Records are padded to one length, so that a shorter one leaves no tail of a longer one.
_RECORD_BYTES = 512
# Files of earlier holders that stay: who looked long ago must find that its number is taken.
_KEPT = 3


class LeaseHeldError(PerpetuaError):
    """Someone else holds the lease, or has not been silent for long enough."""


class LeaseLostError(PerpetuaError):
    """Another took over while this holder gave no sign of life."""


@dataclass(frozen=True)
class Holder:
    """What a lease file says. ``machine`` names one boot of one machine and one process table in it."""

    nonce: str = ""
    host: str = "an unknown host"
    machine: str | None = None
    pid: int = 0
    started: int | None = None
    job: str | None = None
    heartbeat_s: float = HEARTBEAT_S
    beat: int = 0
    released: bool = False

    @classmethod
    def this_process(cls) -> "Holder":
        """A record of its own for this process.

        Raises:
            InputError: the environment's heartbeat is no time.
        """
        return cls(
            nonce=uuid.uuid4().hex,
            host=os.environ.get("SLURMD_NODENAME") or socket.gethostname(),
            machine=_this_machine(),
            pid=os.getpid(),
            started=_started(os.getpid()),
            job=slurm_job(),
            heartbeat_s=_heartbeat_s(),
        )

    @classmethod
    def parse(cls, content: bytes) -> "Holder":
        """What a file says; one that is being written says nothing yet, and its holder is unknown."""
        try:
            return cls(**json.loads(content))
        except (ValueError, TypeError):
            return cls()

    def to_bytes(self) -> bytes:
        """The record as it stands in the file."""
        return json.dumps(asdict(self)).encode().ljust(_RECORD_BYTES - 1) + b"\n"

    @property
    def is_over(self) -> bool:
        """Whether the holder said so, or was a process of this machine that has ended."""
        if self.released:
            return True
        return self.machine is not None and self.machine == _this_machine() and _started(self.pid) != self.started

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}" + (f" (job {self.job})" if self.job else "")


class Lease:
    """A lease that this process holds, from ``acquire`` until ``release``; a thread keeps up the heartbeat."""

    def __init__(self, folder: Path, number: int, holder: Holder) -> None:
        self._folder, self._number, self._holder = folder, number, holder
        path = _path(folder, number)
        self._handle = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o644)
        self._writing = Lock()
        self._write()
        self._stop = Event()
        self._thread = Thread(target=self._keep_beating, name=f"heartbeat of {path}", daemon=True)

    @classmethod
    def acquire(cls, folder: Path) -> "Lease":
        """Takes the lease of a folder, which is made if need be.

        Raises:
            LeaseHeldError: another holds it.
        """
        folder.mkdir(parents=True, exist_ok=True)
        while True:
            number, holder = read_lease(folder)
            if holder is not None and not holder.is_over:
                raise LeaseHeldError(f"'{folder}' is being worked on by {holder}")
            try:
                lease = cls(folder, number + 1, Holder.this_process())
            except FileExistsError:
                continue
            if lease.is_held:
                lease._thread.start()
                lease._forget_earlier()
                return lease
            os.close(lease._handle)
            _path(folder, number + 1).unlink(missing_ok=True)

    @property
    def is_held(self) -> bool:
        """Whether no one took over."""
        return max(_numbers(self._folder), default=0) == self._number

    def require_held(self) -> None:
        """To be called before anything is put where others will look for it.

        Raises:
            LeaseLostError: another took over.
        """
        if not self.is_held:
            silent_s = SILENT_BEATS * self._holder.heartbeat_s
            raise LeaseLostError(
                f"this run gave no sign of life in '{self._folder}' for more than {silent_s:g} s, so another took "
                "over, and this one stops: nothing is lost"
            )

    def release(self) -> None:
        """Lets others go on at once; harmless when another took over."""
        self._stop.set()
        self._thread.join()
        with self._writing:
            self._holder = replace(self._holder, released=True)
        self._write()
        os.close(self._handle)

    def _keep_beating(self) -> None:
        while not self._stop.wait(self._holder.heartbeat_s):
            with self._writing:
                self._holder = replace(self._holder, beat=self._holder.beat + 1)
            try:
                self._write()
            except OSError:
                # The file server is away, or the folder is gone: the next look at the numbers tells.
                continue

    def _write(self) -> None:
        with self._writing:
            os.pwrite(self._handle, self._holder.to_bytes(), 0)
            os.fsync(self._handle)

    def _forget_earlier(self) -> None:
        for number in _numbers(self._folder):
            if number <= self._number - _KEPT:
                _path(self._folder, number).unlink(missing_ok=True)


class LeaseWatch:
    """Looks at a lease that another holds until it is free; breaks it when its holder is silent for too long."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._seen: tuple[int, Holder] | None = None
        self._looked_at = 0.0
        self._silent_s = 0.0

    def is_free(self) -> bool:
        """One look. Takes no lease: who wants it must still acquire it."""
        number, holder = read_lease(self._folder)
        if holder is None or holder.released:
            return True
        if holder.is_over:
            # Other machines cannot see that the process is gone.
            self._break(number)
            return True
        now = time.monotonic()
        if (number, holder) == self._seen:
            self._silent_s += min(now - self._looked_at, holder.heartbeat_s)
        else:
            self._seen, self._silent_s = (number, holder), 0.0
        self._looked_at = now
        if self._silent_s < SILENT_BEATS * holder.heartbeat_s:
            return False
        self._break(number)
        return True

    def _break(self, number: int) -> None:
        """Takes the next number and gives it up at once; who does so first decides for all."""
        record = replace(Holder.this_process(), released=True)
        try:
            handle = os.open(_path(self._folder, number + 1), os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o644)
        except FileExistsError:
            return
        try:
            os.write(handle, record.to_bytes())
        finally:
            os.close(handle)


@contextmanager
def hold(folder: Path) -> Iterator[Lease]:
    """Holds the lease of a folder.

    Raises:
        LeaseHeldError: another holds it.
    """
    lease = Lease.acquire(folder)
    try:
        yield lease
    finally:
        lease.release()


@contextmanager
def hold_when_free(folder: Path, look_every_s: float = 0.2) -> Iterator[Lease]:
    """Waits for the lease of a folder, for work that takes a moment, and holds it."""
    watch = LeaseWatch(folder)
    while True:
        try:
            lease = Lease.acquire(folder)
            break
        except LeaseHeldError:
            while not watch.is_free():
                time.sleep(look_every_s)
    try:
        yield lease
    finally:
        lease.release()


def read_lease(folder: Path) -> tuple[int, Holder | None]:
    """The number and the holder of a folder's newest lease; 0 and None where there never was one."""
    while True:
        number = max(_numbers(folder), default=0)
        if number == 0:
            return 0, None
        try:
            return number, Holder.parse(_path(folder, number).read_bytes())
        except FileNotFoundError:
            # Later holders have come and removed it between the two looks.
            continue


def slurm_job() -> str | None:
    """The job of Slurm that this process belongs to, as squeue names it."""
    array, task = os.environ.get("SLURM_ARRAY_JOB_ID"), os.environ.get("SLURM_ARRAY_TASK_ID")
    return f"{array}_{task}" if array and task else os.environ.get("SLURM_JOB_ID")


def _path(folder: Path, number: int) -> Path:
    return folder / f"{_PREFIX}{number:06d}"


def _numbers(folder: Path) -> list[int]:
    try:
        names = [entry.name for entry in os.scandir(folder) if entry.name.startswith(_PREFIX)]
    except FileNotFoundError:
        return []
    return [int(name.removeprefix(_PREFIX)) for name in names]


def _heartbeat_s() -> float:
    text = os.environ.get(HEARTBEAT_VARIABLE, "")
    try:
        seconds = float(text) if text else HEARTBEAT_S
    except ValueError:
        seconds = 0.0
    if not 0.05 <= seconds <= 3600:
        raise InputError(f"{HEARTBEAT_VARIABLE} must be seconds from 0.05 to 3600, not '{text}'")
    return seconds


@lru_cache
def _this_machine() -> str | None:
    """Boot and process table, so that a process number means one process; None where that cannot be told."""
    if not sys.platform.startswith("linux"):
        return None
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        return f"{boot} {Path('/proc/self/ns/pid').readlink()}"
    except OSError:
        return None


def _started(pid: int) -> int | None:
    """When a process started, in the kernel's ticks since boot, which no clock that is set changes; None: it ended."""
    try:
        content = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    # The name, in brackets, may hold anything; state is the first field after it, the start time the twentieth.
    fields = content.rpartition(")")[2].split()
    return None if fields[0] in "ZX" else int(fields[19])
