"""Checks of the machine: Python, the system libraries bpy links, packages, disk, devices, optional assets."""

import importlib.metadata
import platform
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from perpetua.machine.assets import load_manifest
from perpetua.machine.system_libraries import missing_libraries

NEEDED_PACKAGES = ("bpy", "numpy", "scipy", "torch", "trimesh", "anny", "opencv-python-headless", "OpenEXR")
WANTED_DISK_GB = 5.0

State = Literal["ok", "missing", "optional"]


@dataclass(frozen=True)
class Finding:
    """One object looked at; ``remedy`` says what to do when it is missing."""

    subject: str
    state: State
    value: str
    remedy: str = ""


def examine(out: Path) -> list[Finding]:
    """Looks at everything; nothing is changed."""
    return [*_python(), *_libraries(), *_packages(), *_disk(out), *_devices(), *_assets()]


def _python() -> Iterator[Finding]:
    version = platform.python_version()
    fits = sys.version_info[:2] == (3, 11)
    remedy = "" if fits else "use Python 3.11: bpy 4.2.0, which Infinigen 2 needs, exists for no other"
    yield Finding("Python", "ok" if fits else "missing", version, remedy)


def _libraries() -> Iterator[Finding]:
    missing = missing_libraries()
    if missing:
        yield Finding("system libraries", "missing", ", ".join(missing), f"sudo apt-get install -y {' '.join(missing)}")
    else:
        yield Finding("system libraries", "ok", "all that bpy links")


def _packages() -> Iterator[Finding]:
    for name in NEEDED_PACKAGES:
        version = _version(name)
        yield Finding(
            name,
            "ok" if version else "missing",
            version or "not installed",
            "" if version else f"./setup.sh, or pip install {name}",
        )
    infinigen = _version("infinigen")
    yield Finding(
        "infinigen",
        "ok" if infinigen else "optional",
        infinigen or "not installed",
        "" if infinigen else "./setup.sh, or pip install 'perpetua[infinigen]', or set rooms.source to procedural",
    )
    if _version("opencv-python"):
        yield Finding(
            "opencv-python",
            "optional",
            "installed beside opencv-python-headless, into the same folder",
            "pip uninstall -y opencv-python, then pip install --force-reinstall --no-deps opencv-python-headless",
        )


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _disk(out: Path) -> Iterator[Finding]:
    place = out.absolute()
    while not place.exists():
        place = place.parent
    free_gb = shutil.disk_usage(place).free / 1e9
    enough = free_gb >= WANTED_DISK_GB
    remedy = "" if enough else f"free some: a standard sequence takes up to {WANTED_DISK_GB:.0f} GB while it is made"
    yield Finding(f"free disk at {place}", "ok" if enough else "missing", f"{free_gb:.0f} GB", remedy)


def _devices() -> Iterator[Finding]:
    import torch

    if torch.cuda.is_available():
        yield Finding("GPU", "ok", torch.cuda.get_device_name(0))
    else:
        yield Finding("GPU", "optional", "none found", "rendering uses the CPU")


def _assets() -> Iterator[Finding]:
    for asset in load_manifest():
        if asset.find() is None:
            yield Finding(asset.name, "optional", "not present", asset.without_it)
        else:
            yield Finding(asset.name, "ok", str(asset.find()))
