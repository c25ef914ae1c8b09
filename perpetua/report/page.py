"""``perpetua report DIR``: one HTML file about a data set that needs no other file and no network."""

import math
from collections.abc import Callable
from pathlib import Path

from perpetua.io.html_page import html_environment, write_html
from perpetua.machine.version import __version__
from perpetua.report.dataset import charts, check_rows, compare, stage_rows
from perpetua.report.gather import gather

TEMPLATE = "page.html.j2"
# More of them would make a page that a browser opens slowly.
MOST_PICTURED = 200


def write_report(root: Path, folders: list[Path], page: Path, say: Callable[[str], None]) -> None:
    """Writes the page of some sequences.

    Args:
        root: the data set's folder, for the title.
        folders: its sequences.
        page: HTML file to write.
        say: takes a line for the user, one per sequence that cannot be read.

    Raises:
        InputError: the page cannot be written.
    """
    figures = [
        gather(folder, name, pictured=number < MOST_PICTURED)
        for number, (folder, name) in enumerate(zip(folders, _names(root, folders), strict=True))
    ]
    for one in figures:
        if one.measured is None:
            say(f"{one.folder}: {one.missing[-1]}")
    environment = html_environment(Path(__file__).parent)
    environment.filters |= {"figure": _figure, "duration": _duration, "known": _known}
    write_html(
        environment,
        TEMPLATE,
        page,
        title=root.resolve().name,
        version=__version__,
        sequences=figures,
        readable=sum(one.measured is not None for one in figures),
        comparison=compare(figures),
        charts=charts(figures),
        checks=check_rows(figures),
        stages=stage_rows(figures),
        most_pictured=MOST_PICTURED,
    )


def _names(root: Path, folders: list[Path]) -> list[str]:
    """Names of the folders; where several folders share a name, their paths below the root."""
    names = [folder.resolve().name for folder in folders]
    if len(set(names)) == len(names):
        return names
    return [folder.relative_to(root).as_posix() for folder in folders]


def _known(value: float) -> float | None:
    """The value, or None if it is not finite."""
    return value if math.isfinite(value) else None


def _figure(value: float | None) -> str:
    """A number with as few digits as are useful."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0.0 or 1e-2 <= abs(value) < 1e5:
        return f"{value:,.3f}".rstrip("0").rstrip(".")
    return f"{value:.1e}"


def _duration(seconds: float | None) -> str:
    """Seconds, minutes or hours, whichever reads best."""
    if seconds is None:
        return "–"
    if seconds < 100.0:
        return f"{seconds:.1f} s"
    minutes = seconds / 60.0
    return f"{minutes:.1f} min" if minutes < 100.0 else f"{minutes / 60.0:.1f} h"
