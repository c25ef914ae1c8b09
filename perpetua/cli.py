"""The command line: the group of all commands, and what becomes of errors."""

from typing import Any

import click

import perpetua
from perpetua.commands import check, convert, look, machine, run
from perpetua.errors import PerpetuaError


class PerpetuaGroup(click.Group):
    """Turns errors meant for the user into a message and their exit code."""

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except PerpetuaError as error:
            click.echo(f"perpetua: {error}", err=True)
            context.exit(error.exit_code)


@click.group(cls=PerpetuaGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(perpetua.__version__, prog_name="perpetua")
def main() -> None:
    """Procedural multi-view indoor video with exact 3D ground truth.

    Try: perpetua generate --preset quick --seed 7 --rooms 1
    """


for command in (
    run.generate,
    run.status,
    run.clean,
    check.verify,
    check.evaluate,
    look.preview,
    look.view,
    look.report,
    convert.tracks,
    convert.export,
    machine.assets,
    machine.doctor,
    machine.show_config,
):
    main.add_command(command)
