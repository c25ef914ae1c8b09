"""What pages call by name is there: modules, classes, groups of plug-ins, files and folders."""

import importlib
import re
from pathlib import Path

import pytest

from perpetua.actors.bodies.source import BODY_MODELS
from perpetua.cli.app import main
from perpetua.formats.source import EXPORTERS
from perpetua.motion.source import MOTION_SOURCES
from perpetua.rooms.source import ROOM_SOURCES
from tests.support.doc_pages import ALL_PAGES
from tests.support.paths import ROOT

GROUPS = {registry.group for registry in (ROOM_SOURCES, BODY_MODELS, MOTION_SOURCES, EXPORTERS)}
_NAME = re.compile(r"(?<![\w/.-])perpetua(?:\.[A-Za-z_]\w*)+(?![\w(]*\.)")
_FILE = re.compile(r"(?<![\w/.~-])(?:perpetua|tests|benchmarks|blender_scripts|configs|docs)/[\w./-]*[\w/]")
# Files that a page tells the reader to write.
_WRITTEN = re.compile(r"\.(?:def|sif|fish)$")


def _is_there(name: str) -> bool:
    """Whether a dotted name is a module, or something in one."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            found: object = importlib.import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_names_of_the_page_are_there(page: Path) -> None:
    names = {name for name in _NAME.findall(page.read_text(encoding="utf-8")) if not _WRITTEN.search(name)}
    assert sorted(name for name in names - GROUPS if not _is_there(name)) == []


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_files_of_the_page_are_there(page: Path) -> None:
    files = set(_FILE.findall(page.read_text(encoding="utf-8")))
    assert sorted(file for file in files if not (ROOT / file).exists()) == []


def test_every_command_is_on_the_page() -> None:
    page = (ROOT / "docs/command_line.md").read_text(encoding="utf-8")
    named = re.findall(r"^\| `([a-z]+)` \|", page, re.MULTILINE)
    assert sorted(named) == sorted(name for name, command in main.commands.items() if not command.hidden)


def test_a_name_that_moved_would_be_noticed() -> None:
    assert _is_there("perpetua.formats.source.EXPORTERS")
    assert not _is_there("perpetua.formats.source.GONE")
    assert not _is_there("perpetua.gone")
    assert _NAME.findall("in `perpetua.formats.layout` and `perpetua.def`.") == [
        "perpetua.formats.layout",
        "perpetua.def",
    ]
    assert _FILE.findall("`perpetua/gone/` and `out/tests/x`") == ["perpetua/gone/"]
