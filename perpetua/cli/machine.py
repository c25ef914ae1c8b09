"""Commands about this machine and the settings."""

import sys
from pathlib import Path

import click
from rich.table import Table

from perpetua.cli.options import CONFIG_OPTION, OUT_OPTION, PRESET_OPTION, SET_OPTION, wide_console
from perpetua.config import load_config

PROGRAM = "perpetua"
COMPLETION_VARIABLE = "_PERPETUA_COMPLETE"
SHELLS = ("bash", "zsh", "fish")


@click.command(short_help="List outside assets: present or missing, licence, use.")
def assets() -> None:
    """List outside assets: present or missing, licence, and what is lost without them."""
    from perpetua.machine.assets import asset_folder, load_manifest

    table = Table("asset", "state", "what", "licence", "used by", "without it")
    for asset in load_manifest():
        present = asset.find() is not None
        state = "present" if present else "missing"
        table.add_row(asset.name, state, asset.what, asset.licence, asset.config_key, asset.without_it)
    wide_console().print(table)
    click.echo(f"files are looked for in {asset_folder()} (set PERPETUA_ASSETS to change it)")


@click.command(short_help="Check this machine and say what to install.")
@OUT_OPTION
def doctor(out: Path) -> None:
    """Check this machine and say what to install; list plug-ins. Exit code 1 if something needed is missing."""
    from perpetua.machine.doctor import examine

    findings = examine(out)
    table = Table("what", "state", "found", "what to do")
    for finding in findings:
        table.add_row(finding.subject, finding.state, finding.value, finding.remedy)
    wide_console().print(table)
    _print_plug_ins()
    missing = [finding for finding in findings if finding.state == "missing"]
    for finding in missing:
        click.echo(f"{finding.subject} is missing: {finding.remedy}")
    sys.exit(1 if missing else 0)


def _print_plug_ins() -> None:
    """What installed packages add; nothing if they add nothing. A broken one is no fault of the machine."""
    from perpetua.config.plugins import installed_plug_ins

    table = Table("plug-in for", "name", "package", "what to do")
    for plug_in in installed_plug_ins():
        table.add_row(plug_in.kind, plug_in.name, plug_in.package, plug_in.fault)
    if table.row_count:
        wide_console().print(table)


@click.command("config", short_help="Print every setting with its meaning, unit and range.")
@PRESET_OPTION
@CONFIG_OPTION
@SET_OPTION
@click.option("--format", "form", type=click.Choice(("yaml", "markdown")), default="yaml", show_default=True,
              help="YAML, which --config reads again, or a page of tables.")  # fmt: skip
def show_config(preset: str, config_path: Path | None, assignments: tuple[str, ...], form: str) -> None:
    """Print every setting with its meaning, unit and range, and the values that generate would use.

    The same --preset, --config and --set as for generate. `perpetua config > mine.yaml` is a start for a file of
    your own; a file may name just the settings that it changes.
    """
    from perpetua.config.plugins import setting_notes
    from perpetua.config.reference import annotated_yaml, markdown_page

    config = load_config(preset, config_path, assignments)
    click.echo(annotated_yaml(config, setting_notes()) if form == "yaml" else markdown_page(config))


@click.command(short_help="Print a script that completes commands in a shell.")
@click.argument("shell", type=click.Choice(SHELLS))
def completion(shell: str) -> None:
    """Print a script with which a shell completes commands, options, presets, stages and settings.

    \b
    bash: perpetua completion bash >> ~/.bashrc
    zsh:  perpetua completion zsh >> ~/.zshrc
    fish: perpetua completion fish > ~/.config/fish/completions/perpetua.fish

    It holds from the next shell on.
    """
    from click.shell_completion import get_completion_class

    made = get_completion_class(shell)
    assert made is not None
    program = click.get_current_context().find_root().command
    click.echo(made(program, {}, PROGRAM, COMPLETION_VARIABLE).source())
