"""The work area: one folder per stage and room, complete or absent, known by its key.

A stage is computed in ``NN_stage.partial`` and renamed to ``NN_stage`` when its manifest is written. A manifest
with another key, or an output whose hash differs, is as good as none.
"""

import hashlib
import importlib.metadata
import json
import os
import shutil
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Protocol, runtime_checkable

from perpetua.io.files import file_sha256, load_json

MANIFEST_FILE = "manifest.json"
KEY_FILE = "key"
LIBRARIES = ("anny", "bpy", "infinigen", "numpy", "scipy", "torch", "trimesh")


@dataclass(frozen=True)
class Manifest:
    """What one finished stage says of itself."""

    key: str
    stage: str
    version: int
    seed: int
    room: int
    inputs: dict[str, str]
    outputs: dict[str, str]
    seconds: float
    peak_memory_mb: float
    libraries: dict[str, str] = field(default_factory=dict)


def canonical_json(value: object) -> str:
    """JSON with sorted keys and no spaces: equal values give equal text."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=True)


def key_of(value: object) -> str:
    """SHA-256 of the canonical JSON."""
    return hashlib.sha256(canonical_json(value).encode()).hexdigest()


def output_hashes(folder: Path, leftovers: tuple[str, ...] = ()) -> dict[str, str]:
    """SHA-256 of every file below a folder but the manifest and ``leftovers``, by relative name."""
    skipped = {MANIFEST_FILE, KEY_FILE, *leftovers}
    files = sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return {path.as_posix(): file_sha256(folder / path) for path in files if path.parts[0] not in skipped}


@lru_cache(maxsize=1)
def library_versions() -> dict[str, str]:
    """Versions of the libraries that decide a stage's bits."""
    versions = {}
    for name in LIBRARIES:
        try:
            versions[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return versions


@runtime_checkable
class StageName(Protocol):
    """What the folder of a stage is named by."""

    @property
    def number(self) -> int:
        """Its place in the pipeline."""

    @property
    def name(self) -> str:
        """Its name."""


class StageFolder:
    """One stage of one room on disk."""

    def __init__(self, room_folder: Path, number: int, stage: str) -> None:
        self.final = room_folder / f"{number:02d}_{stage}"
        self.partial = room_folder / f"{number:02d}_{stage}.partial"

    def manifest(self) -> Manifest | None:
        """The manifest of the finished stage, or None where there is none that can be read."""
        try:
            return Manifest(**load_json(self.final / MANIFEST_FILE))
        except (OSError, ValueError, TypeError):
            return None

    def is_complete(self, key: str, leftovers: tuple[str, ...] = ()) -> bool:
        """Whether the stage is finished under this key and every output still has its hash."""
        manifest = self.manifest()
        return manifest is not None and manifest.key == key and self.damage(leftovers) is None

    def begin(self, key: str, resumable: bool) -> Path:
        """An empty partial folder, or the one an interrupted run left under the same key."""
        key_file = self.partial / KEY_FILE
        left_key = key_file.read_text(encoding="utf-8") if key_file.is_file() else None
        if not (resumable and left_key == key):
            shutil.rmtree(self.partial, ignore_errors=True)
            self.partial.mkdir(parents=True)
            key_file.write_text(key, encoding="utf-8")
        return self.partial

    def damage(self, leftovers: tuple[str, ...] = ()) -> str | None:
        """The first file of the finished stage that is not what was written, or None."""
        manifest = self.manifest()
        if manifest is None:
            return MANIFEST_FILE
        found = output_hashes(self.final, leftovers)
        changed = {name for name, _ in found.items() ^ manifest.outputs.items()}
        return min(changed, default=None)

    def finish(self, manifest: Manifest) -> None:
        """Writes the manifest and moves the partial folder into place."""
        path = self.partial / MANIFEST_FILE
        path.write_text(json.dumps(asdict(manifest), indent=1, sort_keys=True) + "\n", encoding="utf-8")
        replace_folder(self.partial, self.final)


def stage_folder(room_folder: Path, stage: StageName) -> StageFolder:
    """Where a room keeps a stage."""
    return StageFolder(room_folder, stage.number, stage.name)


def replace_folder(source: Path, target: Path) -> None:
    """Renames ``source`` to ``target``; what stood at ``target`` is removed after it is out of the way."""
    old = target.with_name(f".{target.name}.old")
    shutil.rmtree(old, ignore_errors=True)
    if target.exists():
        target.rename(old)
    source.rename(target)
    shutil.rmtree(old, ignore_errors=True)


def flush_tree(folder: Path) -> None:
    """Has the disk hold every file below a folder, so that no power failure leaves empty ones behind its new name."""
    for path in (*folder.rglob("*"), folder):
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def link_tree(source: Path, target: Path) -> None:
    """A copy of a folder that shares the files' space where the file system can."""

    def link(from_path: str, to_path: str) -> None:
        try:
            os.link(from_path, to_path)
        except OSError:
            shutil.copy2(from_path, to_path)

    shutil.copytree(source, target, copy_function=link)
