"""Runs one of ``blender_scripts/`` as a process of its own: events, time-out, last words, private settings folder."""

import json
import os
import re
import selectors
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from perpetua.errors import AssetError, EnvironmentSetupError, StageError
from perpetua.machine.system_libraries import SYSTEM_LIBRARIES

# Tells a script that its stdin is a pipe which breaks when this process ends, even before the script looks for it.
PARENT_PIPE_VARIABLE = "PERPETUA_PARENT_PIPE"
TAIL_LINES = 12
READ_BYTES = 65536

# What Blender, Cycles' devices and Python print when memory runs out.
GPU_MEMORY_WORDS = re.compile(
    r"out of (gpu|device|video)|gpu and shared host memory|_ERROR_OUT_OF_(DEVICE_)?MEMORY|hipErrorOutOfMemory"
    r"|out of memory in (cuda|hip|optix)",
    re.IGNORECASE,
)
MEMORY_WORDS = re.compile(
    r"MemoryError|bad_alloc|out of memory|cannot allocate memory|[cm]alloc\w* returns null|failed to allocate",
    re.IGNORECASE,
)
# EEVEE on a machine without a graphics driver ends Blender with one of these.
NO_GRAPHICS_WORDS = ("Couldn't find current GLX or EGL context", "Failed to initialize the GPU", "No OpenGL vendor")

Event = dict[str, Any]


class BlenderError(StageError):
    """A Blender process crashed, failed, hung (``silent``) or ran out of memory (``memory``, ``gpu_memory``).

    ``reason`` is one clause; ``tail`` its last lines.
    """

    def __init__(
        self, reason: str, tail: str, silent: bool = False, memory: bool = False, gpu_memory: bool = False
    ) -> None:
        super().__init__(f"{reason}\n{tail}" if tail else reason)
        self.reason = reason
        self.tail = tail
        self.silent = silent
        self.memory = memory
        self.gpu_memory = gpu_memory


def run_script(
    script: Path,
    job_path: Path,
    *,
    blender: str | None,
    scratch: Path,
    silence_timeout_s: float,
    on_event: Callable[[Event], None],
) -> None:
    """Runs a script of Blender on a job until it ends; the process never outlives this call or this process.

    Args:
        script: a Python script that imports bpy; it gets ``job_path`` as its only argument.
        job_path: the job file.
        blender: a Blender program; None runs the script with this Python and the bpy package.
        scratch: existing folder for the log ``<script>.log`` and Blender's private settings.
        silence_timeout_s: the process is killed after this long without an event, seconds.
        on_event: called with each event: a line of JSON on stdout with the key "event".

    Raises:
        BlenderError: the process ended with an error or by a signal, or was silent for too long.
        EnvironmentSetupError: a system library that Blender needs is not installed.
        AssetError: ``blender`` is no program.
    """
    log_path = scratch / f"{script.stem}.log"
    with log_path.open("wb") as log:
        process = subprocess.Popen(
            script_command(script, job_path, blender),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            env=script_environment(scratch),
            start_new_session=True,
        )
        try:
            assert process.stdout is not None
            silent = _read_events(process.stdout, silence_timeout_s, on_event)
            code = 0 if silent else process.wait()
        finally:
            _kill_group(process)
    if silent:
        reason = f"Blender made no progress for {silence_timeout_s:g} s and was stopped"
        raise BlenderError(reason, _tail(log_path), silent=True)
    if code != 0:
        raise _explain_exit(code, _tail(log_path))


def script_command(script: Path, job_path: Path, blender: str | None) -> list[str]:
    """The command line that runs a script of Blender on a job, with the bpy package or a Blender program."""
    if blender is None:
        return [sys.executable, str(script), str(job_path)]
    program = shutil.which(blender)
    if program is None:
        raise AssetError(f"render.blender must be a Blender program, not '{blender}': no such program was found")
    options = ["-b", "--factory-startup", "--disable-autoexec", "--python-exit-code", "1"]
    return [program, *options, "-P", str(script), "--", str(job_path)]


def script_environment(scratch: Path) -> dict[str, str]:
    """Ours, with a settings folder of Blender's own: none of the user's add-ons, nothing written to their home."""
    resources = scratch.resolve() / "blender_user"
    resources.mkdir(exist_ok=True)
    private = {"BLENDER_USER_RESOURCES": str(resources), "PYTHONHASHSEED": "0", PARENT_PIPE_VARIABLE: "1"}
    return os.environ | private


def _read_events(stdout: IO[bytes], silence_timeout_s: float, on_event: Callable[[Event], None]) -> bool:
    """Hands on events until stdout is closed; True if none came for too long."""
    waiting = b""
    deadline = time.monotonic() + silence_timeout_s
    with selectors.DefaultSelector() as selector:
        selector.register(stdout, selectors.EVENT_READ)
        while True:
            if not selector.select(max(0.0, deadline - time.monotonic())):
                return True
            chunk = os.read(stdout.fileno(), READ_BYTES)
            if not chunk:
                return False
            *lines, waiting = (waiting + chunk).split(b"\n")
            for event in filter(None, map(_parse_event, lines)):
                deadline = time.monotonic() + silence_timeout_s
                on_event(event)


def _parse_event(line: bytes) -> Event | None:
    """An event, or None for anything else that a program prints."""
    try:
        event = json.loads(line)
    except ValueError:
        return None
    return event if isinstance(event, dict) and "event" in event else None


def _kill_group(process: subprocess.Popen[bytes]) -> None:
    """Ends the process and all that it started; harmless when they have ended."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            pipe.close()


def _tail(log_path: Path) -> str:
    text = log_path.read_bytes().decode("utf-8", "replace")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("Fra:")]
    return "\n".join(lines[-TAIL_LINES:])


def _explain_exit(code: int, tail: str) -> StageError | EnvironmentSetupError:
    if "cannot open shared object file" in tail:
        return EnvironmentSetupError(
            "Blender needs a system library that is not installed; on Debian: apt-get install "
            f"{' '.join(SYSTEM_LIBRARIES.values())}\n{tail}"
        )
    if any(words in tail for words in NO_GRAPHICS_WORDS):
        return EnvironmentSetupError(
            "render.engine=eevee needs a graphics driver with OpenGL, which this machine has not: set "
            f"render.engine=cycles\n{tail}"
        )
    end = f"Blender ended with exit code {code}" if code >= 0 else f"Blender was ended by {signal.Signals(-code).name}"
    if GPU_MEMORY_WORDS.search(tail):
        return BlenderError(f"{end}: the GPU's memory ran out", tail, gpu_memory=True)
    if MEMORY_WORDS.search(tail):
        return BlenderError(f"{end}: memory ran out", tail, memory=True)
    if -code == signal.SIGKILL:
        return BlenderError(f"{end} (memory ran out, or someone stopped it)", tail, memory=True)
    return BlenderError(end, tail)
