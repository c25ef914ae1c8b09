"""Commands about this machine and the settings."""

import sys
from pathlib import Path

import click
from rich.table import Table

from perpetua.commands.options import OUT_OPTION, wide_console
from perpetua.config import load_config, presets


@click.command()
def assets() -> None:
    """List outside assets: present or missing, licence, and what is lost without them."""
    from perpetua.assets import asset_folder, load_manifest

    table = Table("asset", "state", "what", "licence", "used by", "without it")
    for asset in load_manifest():
        present = asset.find() is not None
        state = "present" if present else "missing"
        table.add_row(asset.name, state, asset.what, asset.licence, asset.config_key, asset.without_it)
    wide_console().print(table)
    click.echo(f"files are looked for in {asset_folder()} (set PERPETUA_ASSETS to change it)")


@click.command()
@OUT_OPTION
def doctor(out: Path) -> None:
    """Check this machine and say what to install. Exit code 1 if something needed is missing."""
    from perpetua.doctor import examine

    findings = examine(out)
    table = Table("what", "state", "found", "what to do")
    for finding in findings:
        table.add_row(finding.subject, finding.state, finding.value, finding.remedy)
    wide_console().print(table)
    missing = [finding for finding in findings if finding.state == "missing"]
    for finding in missing:
        click.echo(f"{finding.subject} is missing: {finding.remedy}")
    sys.exit(1 if missing else 0)


@click.command("config")
@click.option("--preset", default="standard", show_default=True, help=f"One of {', '.join(presets())}.")
def show_config(preset: str) -> None:
    """Print every setting of a preset with its meaning, as YAML."""
    from perpetua.config import annotated_yaml

    click.echo(annotated_yaml(load_config(preset)))
