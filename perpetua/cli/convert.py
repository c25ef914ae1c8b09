"""Commands that write a finished sequence once more: with other tracks, in other layouts."""

from pathlib import Path

import click

from perpetua.cli.options import WholeNumber
from perpetua.formats.config import OUTPUTS


@click.command(short_help="Write a finished sequence again with other tracks.")
@click.argument("sequence", type=click.Path(path_type=Path))
@click.option("--count", type=WholeNumber(1), default=1024, show_default=True, help="Tracks to draw.")
@click.option("--seed", type=WholeNumber(0), default=0, show_default=True, help="Decides which.")
@click.option("--from-pixels", metavar="VIEW:FRAME:STEP", help="Follow every STEP-th pixel of an image instead.")
@click.option("--label", "labels", type=click.Choice(OUTPUTS), multiple=True,
              help="Also write this label of every pixel. Can be given several times.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder to write.")
def tracks(sequence: Path, count: int, seed: int, from_pixels: str | None, labels: tuple[str, ...], out: Path) -> None:
    """Write a finished sequence again with other tracks, any number of them, without rendering.

    The run's work area must still be there. Labels that export.outputs asked for are written again too.
    """
    from perpetua.runs.resample_tracks import PixelChoice, write_other_tracks

    pixels = None if from_pixels is None else PixelChoice.parse(from_pixels)
    made = write_other_tracks(sequence, out, count, seed, pixels, labels)
    click.echo(f"wrote {len(made.queries_xytv)} tracks to {out}")


@click.command(short_help="Write finished sequences in the layout of another reader.")
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
    from perpetua.runs.export import export_sequence

    for folder in (folder for given in folders for folder in find_sequences(given)):
        for made in export_sequence(folder, export_format, out):
            click.echo(f"wrote {made}")
