"""HTML pages of one file, which need no other file and no network."""

from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from perpetua.errors import InputError


def html_environment(folder: Path) -> Environment:
    """Templates of a folder; all that they are given is escaped, and what they are not given is an error."""
    return Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def write_html(environment: Environment, template: str, page: Path, **given: Any) -> None:
    """Fills a template in and writes it, whole or not at all.

    Raises:
        InputError: the page cannot be written.
    """
    text = environment.get_template(template).render(**given)
    partial = page.with_name(f".{page.name}.partial")
    try:
        partial.write_text(text, encoding="utf-8")
        partial.replace(page)
    except OSError as error:
        raise InputError(f"cannot write '{page}': {error}") from None
