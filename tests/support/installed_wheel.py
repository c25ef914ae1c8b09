"""Perpetua as people install it: built from the repository's tracked files, in an environment without the checkout."""

import subprocess
import sys
import tarfile
import venv
from pathlib import Path

import numpy as np
import pytest

from tests.support.paths import ROOT

_BUILD = "import sys; from setuptools import build_meta; print(build_meta.build_{kind}(sys.argv[1]))"


def build(kind: str, source: Path, target: Path) -> Path:
    """Builds an sdist or a wheel with the installed setuptools; returns the file."""
    command = [sys.executable, "-c", _BUILD.format(kind=kind), str(target)]
    done = subprocess.run(command, cwd=source, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return target / done.stdout.splitlines()[-1]


def copy_sources(folder: Path) -> None:
    """The repository's tracked files as they are now: building leaves files behind, so it works on a copy."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes((ROOT / name).read_bytes())


def build_wheel(sources: Path, folder: Path) -> Path:
    """The wheel, built from the sdist of a copy of the sources."""
    with tarfile.open(build("sdist", sources, folder)) as archive:
        archive.extractall(folder, filter="data")
    [unpacked] = [path for path in folder.iterdir() if path.is_dir()]
    return build("wheel", unpacked, folder)


def install_wheel(wheel: Path, folder: Path) -> Path:
    """Python of a fresh environment with the wheel; what it depends on comes from the environment of the tests."""
    venv.create(folder, with_pip=False, symlinks=True)
    [packages] = folder.glob("lib/python*/site-packages")
    # Nothing of this checkout comes with them: what an editable install adds lies in .pth files, which are not read.
    shared = {str(Path(module.__file__).parents[1]) for module in (np, pytest) if module.__file__ is not None}
    (packages / "shared.pth").write_text("\n".join(sorted(shared)))
    python = folder / "bin" / "python"
    install = [sys.executable, "-m", "pip", "--python", str(python), "install", "--no-deps", "--no-index", "--quiet"]
    subprocess.run([*install, str(wheel)], check=True)
    return python
