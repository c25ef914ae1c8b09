"""Commands that draw pictures."""

import sys
from pathlib import Path

import click

from perpetua.commands.options import DEVICES
from perpetua.config import load_config
from perpetua.errors import InputError

PICTURE_SUFFIXES = (".png", ".jpg")


@click.command()
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
        from perpetua.pictures.room_gallery import GalleryRequest, write_room_gallery

        config = load_config(preset, config_path, assignments)
        folder = Path("rooms") if out is None else out
        failed = write_room_gallery(GalleryRequest(config, seed, range(rooms), folder, device), click.echo)
        click.echo(f"wrote {folder / 'index.html'}")
        sys.exit(1 if failed else 0)
    from perpetua.pictures.actor_sheets import write_actor_sheet
    from perpetua.pictures.contact_sheet import write_contact_sheet
    from perpetua.pictures.plan_view import write_plan_view

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
