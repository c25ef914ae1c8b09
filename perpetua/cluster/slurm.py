"""Slurm, through submitit and Slurm's own commands."""

import os
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from perpetua.errors import EnvironmentSetupError, InputError, PerpetuaError
from perpetua.io.files import read_json, write_json
from perpetua.machine.extras import missing_extra

# Slurm's default of MaxArraySize, for plans where there is no Slurm to ask.
DEFAULT_MOST_TASKS = 1001
# A task that is at its end adds nothing, and one that was cancelled shows like this for a while.
_ENDING = ("COMPLETING", "CANCELLED", "COMPLETED", "FAILED", "TIMEOUT")
# Before its time is up a task has this long to leave all in order.
_SIGNAL_DELAY_S = 60
_MOST_TIME_OUTS = 1000
_SUBMISSION = "submission-"

# The rooms of each task.
Tasks = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Submission:
    """An array that was given to Slurm: the rooms of each task, as kept beside submitit's files."""

    job: str
    tasks: Tasks

    def task_names(self) -> dict[str, tuple[int, ...]]:
        """The rooms by the name that squeue has for a task; submitit makes no array of a single one."""
        if len(self.tasks) == 1:
            return {self.job: self.tasks[0]}
        return {f"{self.job}_{index}": rooms for index, rooms in enumerate(self.tasks)}


def require_slurm() -> None:
    """Raises EnvironmentSetupError where Slurm's commands or submitit are missing."""
    for program in ("sbatch", "squeue", "scontrol"):
        if shutil.which(program) is None:
            raise EnvironmentSetupError(f"submit needs Slurm's '{program}', which is not here: run it on a login node")
    try:
        import submitit  # noqa: F401
    except ImportError:
        raise missing_extra("submit", "submitit", "slurm") from None


def most_tasks() -> int:
    """Tasks that an array may have; Slurm's default where there is no Slurm."""
    try:
        answer = _ask("scontrol", "show", "config")
    except PerpetuaError:
        return DEFAULT_MOST_TASKS
    for line in answer.splitlines():
        name, _, value = line.partition("=")
        if name.strip() == "MaxArraySize":
            return max(1, int(value))
    return DEFAULT_MOST_TASKS


def scheduled_rooms(folder: Path) -> set[int]:
    """Rooms of tasks that Slurm has queued or runs, of all that was submitted from a folder."""
    submissions = [_read(path) for path in sorted(folder.glob(f"{_SUBMISSION}*.json"))]
    if not submissions:
        return set()
    lines = _ask("squeue", "--noheader", "--array", "--me", "--format=%i %T").splitlines()
    states = dict(line.split() for line in lines if line.strip())
    rooms: set[int] = set()
    for submission in submissions:
        for name, of_task in submission.task_names().items():
            if states.get(name, _ENDING[0]) not in _ENDING:
                rooms |= set(of_task)
    return rooms


def open_folder(folder: Path) -> None:
    """Makes the folder for submitit's files. Tasks run what its pickles say, so none but the user may write there.

    Raises:
        InputError: it belongs to someone else, or others may write to it.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    status = folder.stat()
    if status.st_uid != os.getuid() or status.st_mode & 0o022:
        raise InputError(
            f"'{folder}' must be yours alone, as tasks run what is stored there: chmod 700 it, or choose another --out"
        )


def submit_array(
    folder: Path,
    functions: Sequence[Any],
    rooms: Tasks,
    python: str | None,
    options: dict[str, Any],
) -> Submission:
    """Gives an array to Slurm.

    Args:
        folder: for submitit's files, on a file system that all nodes share.
        functions: one per task, called without arguments on its node.
        rooms: of each task.
        python: the command that starts Python in a task; None: this one.
        options: parameters of submitit's executor.

    Raises:
        PerpetuaError: Slurm does not take it.
    """
    from submitit import SlurmExecutor
    from submitit.core.utils import FailedJobError, FailedSubmissionError

    executor = SlurmExecutor(folder=folder, max_num_timeout=_MOST_TIME_OUTS, python=python)
    executor.update_parameters(signal_delay_s=_SIGNAL_DELAY_S, stderr_to_stdout=True, **options)
    try:
        with executor.batch():
            jobs = [executor.submit(function) for function in functions]
        submission = Submission(jobs[0].job_id.partition("_")[0], rooms)
    except (FailedJobError, FailedSubmissionError, subprocess.CalledProcessError) as error:
        raise PerpetuaError(f"Slurm did not take the tasks: {error}") from None
    write_json(
        folder / f"{_SUBMISSION}{submission.job}.json", {"job": submission.job, "tasks": [list(task) for task in rooms]}
    )
    return submission


def _read(path: Path) -> Submission:
    content = read_json(path)
    return Submission(str(content["job"]), tuple(tuple(task) for task in content["tasks"]))


def _ask(*command: str) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    except (OSError, subprocess.SubprocessError) as error:
        said = getattr(error, "stderr", None) or ""
        raise PerpetuaError(f"'{' '.join(command)}' failed: {error} {said}".rstrip()) from None
    return done.stdout
