"""The command line: parse, call the pipeline, report; decide nothing."""

import json
import sys
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table

import perpetua
from perpetua.config import Config, load_config, presets
from perpetua.errors import InputError, PerpetuaError

DEVICES = ("auto", "cpu", "cuda", "optix", "hip", "metal", "oneapi")
PICTURE_SUFFIXES = (".png", ".jpg")
OUT_OPTION = click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out"), show_default=True,
    help="Output folder.",
)  # fmt: skip


class PerpetuaGroup(click.Group):
    """Turns errors meant for the user into a message and their exit code."""

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except PerpetuaError as error:
            click.echo(f"perpetua: {error}", err=True)
            context.exit(error.exit_code)


def _wide_console() -> Console:
    """As wide as the terminal; in a pipe or file wide enough for a table's lines to stay whole."""
    console = Console()
    return console if console.is_terminal else Console(width=160)


@click.group(cls=PerpetuaGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(perpetua.__version__, prog_name="perpetua")
def main() -> None:
    """Procedural multi-view indoor video with exact 3D ground truth.

    Try: perpetua generate --preset quick --seed 7 --rooms 1
    """


@main.command()
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
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="Rooms made at a time.")
@click.option("--device", type=click.Choice(DEVICES), default="auto", show_default=True, help="What Cycles renders on.")
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


@main.command()
@OUT_OPTION
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def status(out: Path, as_json: bool) -> None:
    """Rooms and stages of an output folder: done, failed with its reason, time left."""
    from perpetua.pipeline.status import read_status, status_table

    report = read_status(out)
    if as_json:
        click.echo(json.dumps(report.to_json(), indent=1))
    else:
        _wide_console().print(status_table(report))
        for line in report.notes():
            click.echo(line)


@main.command()
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--deep", is_flag=True, help="Also cast rays at the meshes, which the work area must still hold.")
@click.option("--frames", type=click.IntRange(min=1), default=8, show_default=True, help="Frames that --deep looks at.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def verify(folders: tuple[Path, ...], deep: bool, frames: int, as_json: bool) -> None:
    """Check finished sequences: layout, projection, depth, visibility, queries.

    FOLDERS are sequence folders, or folders that hold some. Exit code 1 if a check fails.
    """
    from perpetua.audit.verify import find_sequences, verify_sequence
    from perpetua.pipeline.kept import load_deep_scene

    bounds = Config().audit
    reports = []
    for folder in (folder for given in folders for folder in find_sequences(given)):
        scene = load_deep_scene(folder) if deep else None
        reports.append(verify_sequence(folder, bounds, scene, frames))
    if as_json:
        click.echo(json.dumps([report.to_json() for report in reports], indent=1))
    else:
        for report in reports:
            _wide_console().print(report.table())
    sys.exit(0 if all(report.passed for report in reports) else 1)


@main.command()
@click.argument("paths", metavar="[PRED] DIR", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--baseline", type=click.Choice(("still", "flow")),
              help="Instead of PRED, score points that stay, or optical flow lifted with depth.")  # fmt: skip
@click.option("--save", type=click.Path(path_type=Path, dir_okay=False), metavar="NPZ",
              help="With --baseline and one sequence: also write what it predicts, as an example.")  # fmt: skip
@click.option("--score-queries", is_flag=True, help="Also score each track at its own query, as TAPVid-3D does.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, with the scores at each threshold.")
def evaluate(
    paths: tuple[Path, ...], baseline: str | None, save: Path | None, score_queries: bool, as_json: bool
) -> None:
    """Score predicted tracks: average Jaccard (AJ), position accuracy (APD), occlusion accuracy (OA).

    DIR is a sequence, or a folder that holds some. PRED is an .npz file, or for several sequences a folder with one
    <sequence>.npz for each. With C views, F frames and P tracks it holds:

    \b
    visibility            bool   (C,F,P), or (F,P) for world tracks alone
    tracks_xyz_camera     float  (C,F,P,3)  in the axes of each camera at each frame, and/or
    tracks_xyz_world      float  (F,P,3)    in the axes of the first view's camera at the first frame
    track_index           int    (K,)       optional: which tracks these are, where P is only K of them
    geometry_pixels_xytv  int    (G,4)      optional: pixels x, y of frame t, view v, and
    geometry_xyz_world    float  (G,3)      where their surfaces are, for the scores under a Sim(3)

    NaN and absent tracks count as failures. Scale is free: one factor per view, and one for the world, is taken out.
    The module perpetua.evaluation.protocol states every rule.
    """
    from perpetua.evaluation.report import evaluate_baseline, evaluate_files

    if len(paths) != (2 if baseline is None else 1):
        raise InputError("evaluate needs PRED and DIR, or DIR alone with --baseline still or --baseline flow")
    if baseline is None and save is not None:
        raise InputError("--save writes what --baseline predicts: give both, or none")
    if baseline is None:
        report = evaluate_files(paths[0], paths[1], score_queries)
    else:
        report = evaluate_baseline(baseline, paths[0], score_queries, save)
    if as_json:
        click.echo(json.dumps(report.to_json(), indent=1))
    else:
        _wide_console().print(report.table())


@main.command()
@click.argument("sequence", required=False, type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Picture to write, .png or .jpg; with --rooms a folder.")
@click.option(
    "--plan", "plan_png", type=click.Path(path_type=Path, dir_okay=False), help="Also a plan, to this .png or .jpg."
)
@click.option("--times", type=click.IntRange(1, 24), default=6, show_default=True, help="Frames shown.")
@click.option("--actors", type=click.IntRange(min=1), metavar="N",
              help="Instead of a sequence, draw the first N actors of a seed, standing and walking.")  # fmt: skip
@click.option("--rooms", type=click.IntRange(min=1), metavar="N",
              help="Instead of a sequence, a page of a seed's first N rooms, from above and from corners.")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True,
              help="With --actors or --rooms: their seed.")  # fmt: skip
@click.option("--config", "config_path", type=click.Path(path_type=Path), help="With --actors or --rooms: a YAML file.")
@click.option("--preset", metavar="NAME", default="standard", show_default=True,
              help="With --actors or --rooms: settings to start from.")  # fmt: skip
@click.option(
    "--set", "assignments", metavar="KEY=VALUE", multiple=True, help="With --actors or --rooms: change one setting."
)
@click.option("--device", type=click.Choice(DEVICES), default="auto", show_default=True, help="What Cycles renders on.")
def preview(
    sequence: Path | None,
    out: Path | None,
    plan_png: Path | None,
    times: int,
    actors: int | None,
    rooms: int | None,
    seed: int,
    config_path: Path | None,
    preset: str,
    assignments: tuple[str, ...],
    device: str,
) -> None:
    """Draw a contact sheet of a sequence: views by times, tracks with fading tails, depth, actors.

    The plan shows the ways of people and cameras from above. With --rooms, rooms are made as generate makes them,
    in a folder that a later generate with the same settings goes on from.
    """
    if rooms is not None:
        from perpetua.audit.room_gallery import GalleryRequest, write_room_gallery

        config = load_config(preset, config_path, assignments)
        folder = Path("rooms") if out is None else out
        failed = write_room_gallery(GalleryRequest(config, seed, range(rooms), folder, device), click.echo)
        click.echo(f"wrote {folder / 'index.html'}")
        sys.exit(1 if failed else 0)
    from perpetua.audit.actor_sheets import write_actor_sheet
    from perpetua.audit.contact_sheet import write_contact_sheet
    from perpetua.audit.plan_view import write_plan_view

    if actors is None and sequence is None:
        raise InputError("preview needs the folder of a sequence, or --actors N, or --rooms N")
    name = "actors" if sequence is None else sequence.absolute().name
    target = out if out is not None else Path(f"{name}.png")
    for picture in (target, plan_png):
        if picture is not None and picture.suffix.lower() not in PICTURE_SUFFIXES:
            raise InputError(f"a picture must end in {' or '.join(PICTURE_SUFFIXES)}, not '{picture.name}'")
    if actors is not None:
        write_actor_sheet(actors, seed, load_config(preset, config_path, assignments), device, target)
    elif sequence is not None:
        write_contact_sheet(sequence, target, times)
    click.echo(f"wrote {target}")
    if plan_png is not None and sequence is not None:
        write_plan_view(sequence, plan_png)
        click.echo(f"wrote {plan_png}")


@main.command()
@click.argument("sequence", type=click.Path(path_type=Path))
@click.option("--count", type=click.IntRange(min=1), default=1024, show_default=True, help="Tracks to draw.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Decides which.")
@click.option("--from-pixels", metavar="VIEW:FRAME:STEP", help="Follow every STEP-th pixel of an image instead.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder to write.")
def tracks(sequence: Path, count: int, seed: int, from_pixels: str | None, out: Path) -> None:
    """Write a finished sequence again with other tracks, any number of them, without rendering.

    The run's work area must still be there.
    """
    from perpetua.pipeline.retrack import PixelChoice, write_other_tracks

    pixels = None if from_pixels is None else PixelChoice.parse(from_pixels)
    made = write_other_tracks(sequence, out, count, seed, pixels)
    click.echo(f"wrote {len(made.queries_xytv)} tracks to {out}")


@main.command()
@click.argument("folders", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--format", "export_format", metavar="NAME", required=True,
              help="kubric (multi-view, as MVTracker reads it), tapvid3d (one file per view) or rerun.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder to write into.")
def export(folders: tuple[Path, ...], export_format: str, out: Path) -> None:
    """Write finished sequences in the layout of another reader.

    FOLDERS are sequence folders, or folders that hold some. Only formats that tell objects apart look into the run's
    work area, and do without where it is gone.
    """
    from perpetua.audit.verify import find_sequences
    from perpetua.pipeline.convert import export_sequence

    for folder in (folder for given in folders for folder in find_sequences(given)):
        for made in export_sequence(folder, export_format, out):
            click.echo(f"wrote {made}")


@main.command()
def assets() -> None:
    """List outside assets: present or missing, licence, and what is lost without them."""
    from perpetua.assets import asset_folder, load_manifest

    table = Table("asset", "state", "what", "licence", "used by", "without it")
    for asset in load_manifest():
        present = asset.find() is not None
        state = "present" if present else "missing"
        table.add_row(asset.name, state, asset.what, asset.licence, asset.config_key, asset.without_it)
    _wide_console().print(table)
    click.echo(f"files are looked for in {asset_folder()} (set PERPETUA_ASSETS to change it)")


@main.command()
@OUT_OPTION
def doctor(out: Path) -> None:
    """Check this machine and say what to install. Exit code 1 if something needed is missing."""
    from perpetua.doctor import examine

    findings = examine(out)
    table = Table("what", "state", "found", "what to do")
    for finding in findings:
        table.add_row(finding.subject, finding.state, finding.value, finding.remedy)
    _wide_console().print(table)
    missing = [finding for finding in findings if finding.state == "missing"]
    for finding in missing:
        click.echo(f"{finding.subject} is missing: {finding.remedy}")
    sys.exit(1 if missing else 0)


@main.command()
@OUT_OPTION
@click.option("--all", "unfinished", is_flag=True, help="Also the work of rooms that are not finished.")
def clean(out: Path, unfinished: bool) -> None:
    """Free the work area of finished rooms. Sequences stay."""
    from perpetua.pipeline.cost import gigabytes
    from perpetua.pipeline.status import clean_work_area

    click.echo(f"freed {gigabytes(clean_work_area(out, unfinished))}")


@main.command("config")
@click.option("--preset", default="standard", show_default=True, help=f"One of {', '.join(presets())}.")
def show_config(preset: str) -> None:
    """Print every setting of a preset with its meaning, as YAML."""
    from perpetua.config import annotated_yaml

    click.echo(annotated_yaml(load_config(preset)))
