"""Commands that draw pictures."""

import sys
from pathlib import Path

import click

from perpetua.commands.options import DEVICES
from perpetua.config import load_config
from perpetua.errors import InputError

PICTURES = ("sheet", "video", "plan", "depth", "objects")
PICTURE_SUFFIXES = (".png", ".jpg")


@click.command()
@click.argument("sequence", required=False, type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path),
              help="Folder to write into; with --actors a picture, .png or .jpg.")  # fmt: skip
@click.option("--only", type=click.Choice(PICTURES), multiple=True,
              help="Draw this alone. Can be given several times.")  # fmt: skip
@click.option("--times", type=click.IntRange(1, 24), default=6, show_default=True, help="Frames that a sheet shows.")
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
    sheet    views by times, tracks with fading tails, hidden points as rings, depth, outlines of people
    video    all views in step, with tracks, as MP4
    plan     the room from above with the ways of people and cameras, and curves of how they move
    depth    depth of all views, with a scale
    objects  which object each pixel shows

    With --rooms, rooms are made as generate makes them, in a folder that a later generate with the same settings
    goes on from.
    """
    if (sequence is not None) + (actors is not None) + (rooms is not None) != 1:
        raise InputError("preview needs one of: the folder of a sequence, --actors N, --rooms N")
    if sequence is not None:
        _preview_sequence(sequence, out, only, times)
        return
    config = load_config(preset, config_path, assignments)
    if actors is not None:
        from perpetua.pictures.actor_sheets import write_actor_sheet

        picture = Path("actors.png") if out is None else out
        if picture.suffix.lower() not in PICTURE_SUFFIXES:
            raise InputError(f"a picture must end in {' or '.join(PICTURE_SUFFIXES)}, not '{picture.name}'")
        write_actor_sheet(actors, seed, config, device, picture)
        click.echo(f"wrote {picture}")
    if rooms is not None:
        from perpetua.pictures.room_gallery import GalleryRequest, write_room_gallery

        folder = Path("rooms") if out is None else out
        failed = write_room_gallery(GalleryRequest(config, seed, range(rooms), folder, device), click.echo)
        click.echo(f"wrote {folder / 'index.html'}")
        sys.exit(1 if failed else 0)


def _preview_sequence(sequence: Path, out: Path | None, only: tuple[str, ...], times: int) -> None:
    from perpetua.pictures.preview_set import write_previews

    if out is not None and out.suffix.lower() in (*PICTURE_SUFFIXES, ".mp4"):
        raise InputError(
            f"preview writes files of its own names into a folder, and '{out}' names a file: give a folder, and "
            "--only sheet for the contact sheet alone"
        )
    folder = out if out is not None else Path("previews") / sequence.resolve().name
    write_previews(sequence, folder, only, times, click.echo)
