"""Options and output that several commands share."""

from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem
from rich.console import Console

from perpetua.config import PRESETS, field_table
from perpetua.machine.devices import DEVICES


class WholeNumber(click.ParamType):
    """A whole number with bounds, said as people say them: "must be 1 or more, not 0"."""

    name = "N"

    def __init__(self, least: int, most: int | None = None) -> None:
        self.least, self.most = least, most

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        try:
            number = int(value)
        except (TypeError, ValueError):
            self.fail(f"must be a whole number, not '{value}'", param, ctx)
        if number < self.least or (self.most is not None and number > self.most):
            bound = f"{self.least} or more" if self.most is None else f"{self.least} to {self.most}"
            self.fail(f"must be {bound}, not {number}", param, ctx)
        return number


def _complete(names: Any) -> Any:
    """Shell completion from a function that gives names with help texts."""

    def items(context: click.Context, parameter: click.Parameter, typed: str) -> list[CompletionItem]:
        return [CompletionItem(name, help=text) for name, text in names().items() if name.startswith(typed)]

    return items


def _settings() -> dict[str, str]:
    return {f"{key}=": meaning for key, meaning in field_table().items()}


SEED_OPTION = click.option(
    "--seed", type=WholeNumber(0), default=0, show_default=True, help="Decides everything drawn."
)
ROOMS_OPTION = click.option(
    "--rooms", type=WholeNumber(1), default=1, show_default=True, help="How many sequences to make."
)
START_ROOM_OPTION = click.option(
    "--start-room", type=WholeNumber(0), default=0, show_default=True, help="Index of the first room."
)
REPLACE_OPTION = click.option(
    "--replace", is_flag=True, help="Allow other settings than the ones the output folder was made with."
)
OUT_OPTION = click.option(
    "--out", type=click.Path(path_type=Path, file_okay=False), default=Path("out"), show_default=True,
    help="Output folder.",
)  # fmt: skip
RUN_ARGUMENT = click.argument(
    "out", metavar="[DIR]", default=Path("out"), type=click.Path(path_type=Path, file_okay=False)
)
PRESET_OPTION = click.option(
    "--preset", metavar="NAME", default="standard", show_default=True,
    shell_complete=_complete(lambda: dict.fromkeys(PRESETS, "")),
    help=f"Settings to start from: {', '.join(PRESETS)}.",
)  # fmt: skip
CONFIG_OPTION = click.option(
    "--config", "config_path", type=click.Path(path_type=Path), metavar="YAML", help="A file with settings."
)
SET_OPTION = click.option(
    "--set", "assignments", metavar="KEY=VALUE", multiple=True, shell_complete=_complete(_settings),
    help="Change one setting, for example --set sequence.frames=48. Can be given several times.",
)  # fmt: skip
DEVICE_OPTION = click.option(
    "--device", type=click.Choice(DEVICES), default="auto", show_default=True, metavar="NAME",
    help=f"What Cycles renders on: {', '.join(DEVICES)}.",
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
