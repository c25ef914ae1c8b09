"""Which Blender scripts a stage's result depends on: the one it starts and those that this one imports."""

import ast
import hashlib
from pathlib import Path

from perpetua.machine.blender import SCRIPT_FOLDER


def script_files(entry: str, folder: Path = SCRIPT_FOLDER) -> list[Path]:
    """The script ``entry`` and all scripts beside it that it imports, directly or not, sorted by name."""
    found: set[Path] = set()
    waiting = [folder / entry]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found.add(path)
            waiting += [folder / f"{name}.py" for name in _imported(path) if (folder / f"{name}.py").is_file()]
    return sorted(found)


def scripts_sha256(entries: tuple[str, ...], folder: Path = SCRIPT_FOLDER) -> str:
    """SHA-256 over the names and contents of all scripts behind ``entries``."""
    digest = hashlib.sha256()
    for path in sorted({path for entry in entries for path in script_files(entry, folder)}):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _imported(path: Path) -> set[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            names.add(node.module)
    return names
