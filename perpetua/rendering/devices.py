"""What Cycles may render on, and how the processes of one machine share its GPUs and CPU threads."""

import os
from dataclasses import dataclass

DEVICES = ("auto", "cpu", "optix", "cuda", "hip", "oneapi", "metal")
# Set in each process that works on rooms beside others: its number and how many they are, as "1/4".
SHARE_VARIABLE = "PERPETUA_WORKER"


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


def cpu_threads(wanted: int, share: MachineShare) -> int:
    """Threads for one Blender: as set, or else an even share of the cores that this process may use; at least 1."""
    return wanted or max(1, usable_cores() // share.workers)


def usable_cores() -> int:
    """CPU cores that this process may use (fewer than the machine has, under Slurm or taskset)."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
