"""The documentation site builds strictly, says something about every public name, and asks no other host."""

import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT

PUBLIC = {"perpetua": "index", "perpetua.formats": "formats", "perpetua.evaluation": "evaluation"}
PLUG_INS = (
    "perpetua.rooms.source.RoomSource",
    "perpetua.actors.bodies.source.BodyModel",
    "perpetua.motion.source.MotionSource",
    "perpetua.formats.source.Exporter",
    "perpetua.registry.Registry",
)
# Scripts, styles and pictures that a page loads by itself; a link waits for a click.
_LOADED = re.compile(r"<(?:script|img|iframe|source)\b[^>]*\bsrc=\"?(?:https?:)?//|url\(\"?(?:https?:)?//")
_STYLES = re.compile(r"<link\b(?=[^>]*\brel=\"?(?:stylesheet|preconnect|icon))[^>]*\bhref=\"?(?:https?:)?//")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the built site; strict: a broken link, a page left out or an unknown name fails."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def _described(page: str) -> set[str]:
    """Names on a page of the reference that have a text below them."""
    parts = re.split(r"<h\d id=\"(perpetua[\w.]*)\"", page)
    return {name for name, text in zip(parts[1::2], parts[2::2], strict=True) if re.search(r"<p>\w", text)}


@pytest.mark.parametrize("package", PUBLIC)
def test_reference_describes_every_public_name(package: str, site: Path) -> None:
    named = set(importlib.import_module(package).__all__) - {"__version__"}
    described = _described((site / f"reference/{PUBLIC[package]}.html").read_text(encoding="utf-8"))
    assert sorted(name for name in named if f"{package}.{name}" not in described) == []


def test_reference_describes_what_plug_ins_are_made_of(site: Path) -> None:
    described = _described((site / "reference/plug_ins.html").read_text(encoding="utf-8"))
    assert sorted(set(PLUG_INS) - described) == []


def test_site_asks_no_other_host(site: Path) -> None:
    pages = [*site.rglob("*.html"), *site.rglob("*.css")]
    assert len(pages) > 10
    asking = {
        path.name: found.group()
        for path in pages
        for text in [path.read_text(encoding="utf-8")]
        if (found := _LOADED.search(text) or _STYLES.search(text))
    }
    assert asking == {}


@pytest.mark.parametrize("offender", ['<script src="https://host/x.js">', "src: url(//host/x.woff)"])
def test_a_request_to_another_host_would_be_noticed(offender: str) -> None:
    assert _LOADED.search(offender)


def test_a_style_of_another_host_would_be_noticed() -> None:
    assert _STYLES.search('<link rel="stylesheet" href="https://fonts.host/x">')
    assert not _STYLES.search('<link rel="next" href="https://host/page.html"> <a href="https://host/">')
