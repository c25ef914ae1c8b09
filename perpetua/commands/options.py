"""Options and output that several commands share."""

from pathlib import Path

import click
from rich.console import Console

from perpetua.rendering.devices import DEVICES

DEVICE_OPTION = click.option(
    "--device", type=click.Choice(DEVICES), default="auto", show_default=True, help="What Cycles renders on."
)
OUT_OPTION = click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out"), show_default=True,
    help="Output folder.",
)  # fmt: skip


class WorkerCount(click.ParamType):
    """A number from 1, or "auto", which is handed on as 0."""

    name = "integer|auto"

    def convert(self, value: str | int, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """The number.

        Raises:
            BadParameter: it is neither.
        """
        if value == "auto":
            return 0
        try:
            count = int(value)
        except ValueError:
            count = 0
        if count < 1:
            self.fail(f"must be a number from 1, or auto, not '{value}'", param, ctx)
        return count


def wide_console() -> Console:
    """As wide as the terminal; in a pipe or file wide enough for a table's lines to stay whole."""
    console = Console()
    return console if console.is_terminal else Console(width=160)
