"""Commands that make sequences and look after their folder."""

import json
import sys
from pathlib import Path

import click
from rich.console import Console

from perpetua.commands.options import DEVICE_OPTION, OUT_OPTION, WorkerCount, wide_console
from perpetua.config import load_config


@click.command()
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Decides everything drawn.")
@click.option("--rooms", type=click.IntRange(min=1), default=1, show_default=True, help="How many sequences to make.")
@click.option("--start-room", type=click.IntRange(min=0), default=0, show_default=True, help="Index of the first room.")
@click.option("--until", metavar="STAGE", help="Stop after this stage, for example 'cameras'.")
@OUT_OPTION
@click.option("--config", "config_path", type=click.Path(path_type=Path), help="A YAML file with settings.")
@click.option("--preset", metavar="NAME", default="standard", show_default=True,
              help="Settings to start from: tiny, quick, standard or benchmark.")  # fmt: skip
@click.option("--set", "assignments", metavar="KEY=VALUE", multiple=True,
              help="Change one setting, for example --set sequence.frames=48. Can be given several times.")  # fmt: skip
@click.option("--workers", type=WorkerCount(), default=1, show_default=True,
              help="Rooms made at a time; auto: one per GPU, or per four cores, as memory allows.")  # fmt: skip
@DEVICE_OPTION
@click.option("--replace", is_flag=True, help="Allow other settings than the ones the output folder was made with.")
@click.option("--dry-run", is_flag=True, help="Say what would be done and what it costs, and do nothing.")
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
    """Make sequences: rooms, actors, cameras, video, tracks.

    Stopped at any moment, the same command goes on where it was. Room k of a seed is the same however many rooms
    are made, in whichever order.
    """
    from perpetua.generation import GenerateRequest, run_generate

    request = GenerateRequest(
        config=load_config(preset, config_path, assignments),
        seed=seed,
        rooms=range(start_room, start_room + rooms),
        until=until,
        out=out,
        workers=workers,
        device=device,
        replace=replace,
    )
    sys.exit(run_generate(request, Console(), dry_run))


@click.command()
@OUT_OPTION
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def status(out: Path, as_json: bool) -> None:
    """Rooms and stages of an output folder: done, failed with its reason, time left."""
    from perpetua.pipeline.status import read_status, status_table

    report = read_status(out)
    if as_json:
        click.echo(json.dumps(report.to_json(), indent=1))
    else:
        wide_console().print(status_table(report))
        for line in report.notes():
            click.echo(line)


@click.command()
@OUT_OPTION
@click.option("--all", "unfinished", is_flag=True, help="Also the work of rooms that are not finished.")
def clean(out: Path, unfinished: bool) -> None:
    """Free the work area of finished rooms. Sequences stay."""
    from perpetua.pipeline.cost import gigabytes
    from perpetua.pipeline.status import clean_work_area

    click.echo(f"freed {gigabytes(clean_work_area(out, unfinished))}")
