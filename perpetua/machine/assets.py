"""Outside assets: what each is, under which licence, where it goes, and what it costs to lack it."""

import importlib.util
import os
import shutil
from dataclasses import dataclass
from pathlib import Path

import yaml

from perpetua.errors import AssetError
from perpetua.resources import MANIFEST_FOLDER

ASSET_FOLDER_VARIABLE = "PERPETUA_ASSETS"


def asset_folder() -> Path:
    """Where a user's assets lie: ``$PERPETUA_ASSETS``, else ``~/.local/share/perpetua/assets``."""
    chosen = os.environ.get(ASSET_FOLDER_VARIABLE)
    return Path(chosen) if chosen else Path.home() / ".local" / "share" / "perpetua" / "assets"


def file_listing(folder: Path) -> list[str]:
    """Name, size and time of change of all files of a folder, which stand for its content; empty without a folder."""
    if not folder.is_dir():
        return []
    stats = {path.relative_to(folder).as_posix(): path.stat() for path in folder.rglob("*") if path.is_file()}
    return [f"{name} {stat.st_size} {stat.st_mtime_ns}" for name, stat in sorted(stats.items())]


@dataclass(frozen=True)
class Asset:
    """One entry of the manifest: a Python ``package``, a ``program`` on PATH, or ``files`` below the asset folder."""

    name: str
    what: str
    licence: str
    origin: str
    without_it: str
    config_key: str = ""
    package: str = ""
    program: str = ""
    files: tuple[str, ...] = ()
    sha256: tuple[str, ...] = ()

    def find(self) -> Path | None:
        """Where the asset is, or None."""
        if self.package:
            spec = importlib.util.find_spec(self.package)
            return Path(spec.origin).parent if spec is not None and spec.origin is not None else None
        if self.program:
            found = shutil.which(self.program)
            return Path(found) if found is not None else None
        places = [asset_folder() / name for name in self.files]
        return places[0] if places and all(place.exists() for place in places) else None


def load_manifest(folder: Path = MANIFEST_FOLDER) -> list[Asset]:
    """All entries, by file name.

    Raises:
        AssetError: an entry is not valid.
    """
    return [_read_entry(path) for path in sorted(folder.glob("*.yaml"))]


def _read_entry(path: Path) -> Asset:
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        files, sha256 = (tuple(content.pop(key, ())) for key in ("files", "sha256"))
        return Asset(**content, files=files, sha256=sha256)
    except (OSError, yaml.YAMLError, TypeError, AttributeError, ValueError) as error:
        raise AssetError(f"asset manifest '{path}' is not valid: {error}") from None
