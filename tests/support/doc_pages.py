"""The README and the pages of docs/: their fenced blocks, and the commands in them."""

import re
import shlex
from dataclasses import dataclass

from tests.support.paths import ROOT

PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
# Those whose commands are not run too: for people who change Perpetua, and the reference made of docstrings.
ALL_PAGES = (*PAGES, *sorted((ROOT / "docs/reference").glob("*.md")), ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md")
PROGRAMS = (".venv/bin/perpetua", "perpetua")
# Stands in examples for what the reader had before, and for a folder of a cluster.
_ELISION, _SHARED = "...", "/shared/"
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class DocCommand:
    """One command of a page: its words, without comment and redirection."""

    page: str
    words: tuple[str, ...]

    @property
    def arguments(self) -> list[str]:
        """What follows the program's name; a shared folder as one beside."""
        return [word.removeprefix(_SHARED) for word in self.words[1:] if word != _ELISION]

    def __str__(self) -> str:
        return shlex.join(self.words)


def blocks(page: str, language: str) -> list[str]:
    """The contents of a page's fenced blocks of one language, in order; the page by its path in the repository."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return [content for name, content in _BLOCK.findall(text) if name == language]


def commands() -> list[DocCommand]:
    """Every command of every bash block, in order; ``a && b`` counts as two, what two pages share as one."""
    found: dict[tuple[str, ...], DocCommand] = {}
    for page in (path.relative_to(ROOT).as_posix() for path in PAGES):
        for block in blocks(page, "bash"):
            for part in re.split(r" && |\n", block.replace("\\\n", " ")):
                words = tuple(shlex.split(re.sub(r"\s>>?\s.*", "", part), comments=True))
                if words:
                    found.setdefault(words, DocCommand(page, words))
    return list(found.values())
