"""What Cycles may render on, and how the processes of one machine share its GPUs and CPU threads."""

import os
import shutil
import subprocess
from dataclasses import dataclass

DEVICES = ("auto", "cpu", "optix", "cuda", "hip", "oneapi", "metal")
# Set in each process that works on rooms beside others: its number and how many they are, as "1/4".
SHARE_VARIABLE = "PERPETUA_WORKER"
# Cores for each worker on the CPU. Of a frame's CPU time 1.3% is one core's work alone while the others wait
# (benchmarks/render_worker.py overhead, four views at 192 px and 24 samples): four cores lose 4% to that, sixteen 16%.
# Every worker holds a room of its own in memory, so not each core gets one.
CORES_PER_WORKER = 4


@dataclass(frozen=True)
class MachineShare:
    """This process is number ``worker`` (from 0) of ``workers`` that render on this machine."""

    worker: int = 0
    workers: int = 1


def share_machine(worker: int, workers: int) -> None:
    """Says that this process and those it starts render beside others, so that each takes GPUs of its own."""
    os.environ[SHARE_VARIABLE] = f"{worker}/{workers}"


def machine_share() -> MachineShare:
    """What ``share_machine`` said in this process or the one that started it; all of the machine if nothing."""
    try:
        worker, workers = (int(part) for part in os.environ[SHARE_VARIABLE].split("/"))
    except (KeyError, ValueError):
        return MachineShare()
    return MachineShare(worker, workers) if 0 <= worker < workers else MachineShare()


def cpu_threads(wanted: int, fraction: MachineShare) -> int:
    """Threads for one Blender: as set, or else an even share of the cores that this process may use; at least 1."""
    return wanted or max(1, usable_cores() // fraction.workers)


def usable_cores() -> int:
    """CPU cores that this process may use (fewer than the machine has, under Slurm or taskset)."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def auto_workers(rooms: int, device: str, free_mb: float, room_mb: float) -> int:
    """How many rooms to make at a time: one per GPU, or one per ``CORES_PER_WORKER`` cores; what memory holds.

    Args:
        rooms: how many are asked for.
        device: one of ``DEVICES``.
        free_mb: memory that is free, megabytes.
        room_mb: memory that one room may need, megabytes.
    """
    gpus = nvidia_gpus() if device in ("auto", "cuda", "optix") else 0
    places = gpus or usable_cores() // CORES_PER_WORKER
    return max(1, min(rooms, places, int(free_mb // room_mb)))


def nvidia_gpus() -> int:
    """How many GPUs NVIDIA's driver lists; 0 without that driver."""
    program = shutil.which("nvidia-smi")
    if program is None:
        return 0
    try:
        listed = subprocess.run([program, "-L"], capture_output=True, text=True, timeout=30.0, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return 0
    return sum(line.startswith("GPU ") for line in listed.stdout.splitlines()) if listed.returncode == 0 else 0
