"""Commands that draw pictures."""

import os
import sys
from pathlib import Path

import click

from perpetua.cli.options import CONFIG_OPTION, DEVICE_OPTION, PRESET_OPTION, SET_OPTION, WholeNumber
from perpetua.config import load_config
from perpetua.errors import InputError

PICTURES = ("sheet", "video", "plan", "depth", "objects", "animation")
PICTURE_SUFFIXES = (".png", ".jpg")


@click.command(short_help="Draw pictures of a sequence, of rooms or of people.")
@click.argument("sequence", required=False, type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path),
              help="Folder to write into; with --actors a picture, .png or .jpg.")  # fmt: skip
@click.option("--only", type=click.Choice(PICTURES), multiple=True,
              help="Draw this alone. Can be given several times.")  # fmt: skip
@click.option("--times", type=WholeNumber(1, 24), default=6, show_default=True, help="Frames that a sheet shows.")
@click.option("--actors", type=WholeNumber(1), metavar="N",
              help="Instead of a sequence, draw the first N actors of a seed, standing and walking.")  # fmt: skip
@click.option("--rooms", type=WholeNumber(1), metavar="N",
              help="Instead of a sequence, a page of a seed's first N rooms, from above and from corners.")  # fmt: skip
@click.option("--seed", type=WholeNumber(0), default=0, show_default=True,
              help="Seed of those rooms or actors.")  # fmt: skip
@PRESET_OPTION
@CONFIG_OPTION
@SET_OPTION
@DEVICE_OPTION
def preview(
    sequence: Path | None,
    out: Path | None,
    only: tuple[str, ...],
    times: int,
    actors: int | None,
    rooms: int | None,
    seed: int,
    config_path: Path | None,
    preset: str,
    assignments: tuple[str, ...],
    device: str,
) -> None:
    """Draw pictures of a sequence into a folder, previews/<sequence> unless --out names another.

    \b
    sheet      views by times, tracks with fading tails, hidden points as rings, depth, outlines of people
    video      all views in step, with tracks, as MP4
    plan       the room from above with the ways of people and cameras, and curves of how they move
    depth      depth of all views, with a scale
    objects    which object each pixel shows
    animation  the video as an animated WebP for a web page, drawn only with --only animation

    With --rooms, rooms are made as generate makes them, in a folder that a later generate with the same settings
    goes on from. --seed, --preset, --config, --set and --device are for --rooms and --actors.
    """
    if (sequence is not None) + (actors is not None) + (rooms is not None) != 1:
        raise InputError("preview needs one of: the folder of a sequence, --actors N, --rooms N")
    if sequence is not None:
        _preview_sequence(sequence, out, only, times)
        return
    config = load_config(preset, config_path, assignments)
    if actors is not None:
        from perpetua.runs.preview_actors import write_actor_sheet

        picture = Path("actors.png") if out is None else out
        if picture.suffix.lower() not in PICTURE_SUFFIXES:
            raise InputError(f"a picture must end in {' or '.join(PICTURE_SUFFIXES)}, not '{picture.name}'")
        write_actor_sheet(actors, seed, config, device, picture)
        click.echo(f"wrote {picture}")
    if rooms is not None:
        from perpetua.runs.preview_rooms import GalleryRequest, write_room_gallery

        folder = Path("rooms") if out is None else out
        failed = write_room_gallery(GalleryRequest(config, seed, range(rooms), folder, device), click.echo)
        click.echo(f"wrote {folder / 'index.html'}")
        sys.exit(1 if failed else 0)


def _preview_sequence(sequence: Path, out: Path | None, only: tuple[str, ...], times: int) -> None:
    from perpetua.pipeline.layout import PREVIEW_FOLDER
    from perpetua.runs.preview_sequence import write_previews

    if out is not None and out.suffix.lower() in (*PICTURE_SUFFIXES, ".mp4", ".webp"):
        raise InputError(
            f"preview writes files of its own names into a folder, and '{out}' names a file: give a folder, and "
            "--only sheet for the contact sheet alone"
        )
    folder = out if out is not None else Path(PREVIEW_FOLDER) / sequence.resolve().name
    write_previews(sequence, folder, only, times, click.echo)


@click.command(short_help="Look at a sequence in Rerun, or write a recording for it.")
@click.argument("sequence", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE.rrd",
              help="Write a recording instead of opening the viewer.")  # fmt: skip
def view(sequence: Path, out: Path | None) -> None:
    """Look at a sequence in Rerun: cameras, images, depth, tracks; meshes while the run's work area is kept.

    Opens Rerun's viewer. Without a display, or with --out, writes a recording for it: <sequence>.rrd.
    """
    from perpetua.formats.rerun_recording import open_viewer, save_recording
    from perpetua.runs.export import load_source

    if out is not None and out.suffix != ".rrd":
        raise InputError(f"a recording must end in .rrd, not '{out.name}'")
    source = load_source(sequence)
    if out is None and _has_display():
        open_viewer(source)
        click.echo(f"Rerun's viewer shows '{source.name}'")
        return
    target = Path(f"{source.name}.rrd") if out is None else out
    save_recording(source, target)
    click.echo(f"wrote {target}; to look at it: {Path(sys.executable).with_name('rerun')} {target}")


def _has_display() -> bool:
    """Whether a window can be opened; only Linux may have none."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


@click.command(short_help="Write a page about a data set: pictures, figures, checks, cost.")
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), default=Path("report.html"), show_default=True,
              help="HTML file to write.")  # fmt: skip
def report(folder: Path, out: Path) -> None:
    """Write a page about a data set: pictures, figures and distributions, checks, cost. One HTML file, no other.

    DIR holds sequences, or is one; they need not be Perpetua's own.
    """
    from perpetua.audit.verify import find_sequences
    from perpetua.report.page import write_report

    write_report(folder, find_sequences(folder), out, click.echo)
    click.echo(f"wrote {out}")
