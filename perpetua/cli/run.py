"""Commands that make sequences and look after their folder."""

import json
import sys
from pathlib import Path

import click
from rich.console import Console

from perpetua.cli.options import (
    CONFIG_OPTION,
    DEVICE_OPTION,
    OUT_OPTION,
    PRESET_OPTION,
    REPLACE_OPTION,
    ROOMS_OPTION,
    RUN_ARGUMENT,
    SEED_OPTION,
    SET_OPTION,
    START_ROOM_OPTION,
    WholeNumber,
    WorkerCount,
    wide_console,
)
from perpetua.config import load_config
from perpetua.errors import InputError


def _complete_stages(context: click.Context, parameter: click.Parameter, typed: str) -> list[str]:
    from perpetua.pipeline.stages import STAGE_NAMES

    return [name for name in STAGE_NAMES if name.startswith(typed)]


@click.command(short_help="Make sequences: rooms, people, cameras, video, tracks.")
@SEED_OPTION
@ROOMS_OPTION
@START_ROOM_OPTION
@OUT_OPTION
@PRESET_OPTION
@CONFIG_OPTION
@SET_OPTION
@click.option("--until", metavar="STAGE", shell_complete=_complete_stages,
              help="Stop after this stage, for example 'cameras'.")  # fmt: skip
@click.option("--workers", type=WorkerCount(), default=1, show_default=True,
              help="Rooms made at a time; auto: one per GPU, or per four cores, as memory allows.")  # fmt: skip
@DEVICE_OPTION
@REPLACE_OPTION
@click.option("--dry-run", is_flag=True, help="Check everything, say what it takes, and do nothing.")
def generate(
    seed: int,
    rooms: int,
    start_room: int,
    until: str | None,
    out: Path,
    config_path: Path | None,
    preset: str,
    assignments: tuple[str, ...],
    workers: int,
    device: str,
    replace: bool,
    dry_run: bool,
) -> None:
    """Make sequences: rooms, people, cameras, video, tracks.

    Stopped at any moment, the same command goes on where it was. Room k of a seed is the same however many rooms
    are made, in whichever order.

    Exit codes: 0 all rooms are made, 1 some failed, 2 something in the command is wrong, 130 stopped.
    """
    from perpetua.pipeline.room_work import GenerateRequest
    from perpetua.runs.generate import run_generate

    request = GenerateRequest(
        config=load_config(preset, config_path, assignments),
        seed=seed,
        rooms=range(start_room, start_room + rooms),
        out=out,
        until=until,
        workers=workers,
        device=device,
        replace=replace,
    )
    sys.exit(run_generate(request, Console(), dry_run))


@click.command(short_help="Make sequences on a Slurm cluster.")
@SEED_OPTION
@ROOMS_OPTION
@START_ROOM_OPTION
@OUT_OPTION
@PRESET_OPTION
@CONFIG_OPTION
@SET_OPTION
@DEVICE_OPTION
@click.option("--partition", help="Slurm partition of tasks that make pictures, and of all if no other is given.")
@click.option("--geometry-partition", help="Slurm partition of tasks up to the cameras, which use no GPU.")
@click.option("--cpus", type=WholeNumber(1), default=4, show_default=True, help="CPUs of a task.")
@click.option("--mem", type=click.FloatRange(min=0, min_open=True), default=8, show_default=True, help="GB of a task.")
@click.option("--gpus", type=WholeNumber(0), default=0, show_default=True,
              help="GPUs of a task that makes pictures; it makes as many rooms at a time.")  # fmt: skip
@click.option("--time", "minutes", type=WholeNumber(1), default=240, show_default=True,
              help="Minutes until a task is stopped and queued again, to go on at the next frame.")  # fmt: skip
@click.option("--array-parallelism", type=WholeNumber(1), default=256, show_default=True,
              help="Tasks that run at a time.")  # fmt: skip
@click.option("--rooms-per-task", type=WholeNumber(1), help="Default: as few as Slurm's limit of tasks allows.")
@click.option("--python", help="What starts Python on a node, for example 'apptainer exec --nv perpetua.sif python3'.")
@click.option("--sbatch", "sbatch", metavar="OPTION=VALUE", multiple=True,
              help="A further option of sbatch, for example account=vision. Can be given several times.")  # fmt: skip
@REPLACE_OPTION
@click.option("--dry-run", is_flag=True, help="Say what would be scheduled, and schedule nothing.")
def submit(
    seed: int,
    rooms: int,
    start_room: int,
    out: Path,
    config_path: Path | None,
    preset: str,
    assignments: tuple[str, ...],
    device: str,
    partition: str | None,
    geometry_partition: str | None,
    cpus: int,
    mem: float,
    gpus: int,
    minutes: int,
    array_parallelism: int,
    rooms_per_task: int | None,
    python: str | None,
    sbatch: tuple[str, ...],
    replace: bool,
    dry_run: bool,
) -> None:
    """Make sequences on a Slurm cluster, in a folder that all nodes share.

    Up to the cameras rooms are made on CPUs by one array of tasks; a second one, each task after its own of the
    first, makes pictures and all else. The same command again schedules what is missing, and not what is scheduled
    still or running.
    """
    from perpetua.cluster.plan import Resources
    from perpetua.pipeline.room_work import GenerateRequest
    from perpetua.runs.submit import SubmitRequest, run_submit

    for option in sbatch:
        if "=" not in option:
            raise InputError(f"--sbatch takes OPTION=VALUE such as account=vision, not '{option}'")
    generate = GenerateRequest(
        config=load_config(preset, config_path, assignments),
        seed=seed,
        rooms=range(start_room, start_room + rooms),
        until=None,
        out=out,
        workers=1,
        device=device,
        replace=replace,
    )
    resources = Resources(
        partition=partition,
        geometry_partition=partition if geometry_partition is None else geometry_partition,
        cpus=cpus,
        memory_gb=mem,
        gpus=gpus,
        minutes=minutes,
        array_parallelism=array_parallelism,
        rooms_per_task=rooms_per_task,
    )
    further = dict(option.split("=", 1) for option in sbatch)
    run_submit(SubmitRequest(generate, resources, python, further), Console(), dry_run)


@click.command(short_help="How far an output folder is: rooms by stages, failures, time left.")
@RUN_ARGUMENT
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def status(out: Path, as_json: bool) -> None:
    """Rooms and stages of the output folder DIR, "out" if none is named: done, failed with its reason, time left."""
    from perpetua.pipeline.status import read_status, status_table

    report = read_status(out)
    if as_json:
        click.echo(json.dumps(report.to_json(), indent=1))
    else:
        wide_console().print(status_table(report))
        for line in report.notes():
            click.echo(line)


@click.command(short_help="Free the work area of finished rooms; sequences stay.")
@RUN_ARGUMENT
@click.option("--all", "unfinished", is_flag=True, help="Also the work of rooms that are not finished.")
def clean(out: Path, unfinished: bool) -> None:
    """Free the work area of finished rooms in the output folder DIR, "out" if none is named. Sequences stay."""
    from perpetua.pipeline.cost import gigabytes
    from perpetua.pipeline.status import clean_work_area

    click.echo(f"freed {gigabytes(clean_work_area(out, unfinished))}")
