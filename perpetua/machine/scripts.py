"""Which Blender scripts a stage's result depends on: the one it starts and those that this one imports."""

import ast
import hashlib
from pathlib import Path

from perpetua.resources import SCRIPT_FOLDER

# Scripts import each other by the name of their folder in the repository.
_PACKAGE = "blender_scripts"


def script_files(entry: Path, folder: Path = SCRIPT_FOLDER) -> list[Path]:
    """The script ``entry`` and all scripts below ``folder`` that it imports, directly or not, sorted by name."""
    found: set[Path] = set()
    waiting = [entry]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            places = (folder.joinpath(*name.split(".")[1:]).with_suffix(".py") for name in _imported(path))
            waiting += [place for place in places if place.is_file()]
    return sorted(found)


def scripts_sha256(entries: tuple[Path, ...], folder: Path = SCRIPT_FOLDER) -> str:
    """SHA-256 over the names and contents of all scripts behind ``entries``."""
    digest = hashlib.sha256()
    for path in sorted({path for entry in entries for path in script_files(entry, folder)}):
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _imported(path: Path) -> set[str]:
    """Full names of what may be modules of the scripts: ``a.b`` and, for ``from a import b``, ``a`` and ``a.b``."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return {name for name in names if name.startswith(f"{_PACKAGE}.")}
