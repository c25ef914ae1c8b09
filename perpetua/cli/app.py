"""The command line: the group of all commands, and what becomes of errors."""

import errno
from typing import Any

import click

from perpetua.cli import check, convert, look, machine, run
from perpetua.errors import InputError, PerpetuaError
from perpetua.machine.version import __version__

SECTIONS = {
    "Make": (run.generate, run.submit, run.status, run.clean),
    "Look": (look.preview, look.view, look.report),
    "Check": (check.verify, check.evaluate),
    "Write in other ways": (convert.tracks, convert.export),
    "Settings and machine": (machine.show_config, machine.doctor, machine.assets, machine.completion),
}
# What the system refuses because of the path that was given; a full disk or a broken one is not the user's mistake.
PATH_ERRORS = (errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.EACCES, errno.EPERM, errno.EROFS)


class PerpetuaGroup(click.Group):
    """Turns errors meant for the user into a message and their exit code, and lists commands by what they are for."""

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except PerpetuaError as error:
            click.echo(f"perpetua: {error}", err=True)
            context.exit(error.exit_code)
        except OSError as error:
            if error.filename is None:
                raise
            click.echo(f"perpetua: cannot use '{error.filename}': {error.strerror}", err=True)
            context.exit(InputError.exit_code if error.errno in PATH_ERRORS else PerpetuaError.exit_code)

    def parse_args(self, context: click.Context, args: list[str]) -> list[str]:
        try:
            return super().parse_args(context, args)
        except click.NoSuchOption as error:
            owners = [name for name, command in self.commands.items() if _has_option(command, error.option_name)]
            if owners:
                first = error.option_name
                said = f"'{first}' comes after a command, for example: perpetua {owners[0]} {first} ..."
                raise click.NoSuchOption(first, said, ctx=context) from None
            raise

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        for title, commands in SECTIONS.items():
            with formatter.section(title):
                formatter.write_dl([(str(command.name), command.get_short_help_str(70)) for command in commands])


def _has_option(command: click.Command, option: str) -> bool:
    return any(option in parameter.opts for parameter in command.params)


@click.group(cls=PerpetuaGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="perpetua")
def main() -> None:
    """Procedural multi-view indoor video with exact 3D ground truth.

    Try: perpetua generate --preset quick --seed 7 --rooms 1
    """


for command in (command for commands in SECTIONS.values() for command in commands):
    main.add_command(command)
