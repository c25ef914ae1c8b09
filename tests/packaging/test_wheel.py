"""What is installed from a wheel does all that a checkout does, from an empty folder with no checkout in sight."""

import subprocess
import tomllib
import zipfile
from importlib.metadata import requires, version
from pathlib import Path

import pytest

from perpetua.machine.extras import EXTRAS
from tests.support.installed_wheel import build, build_wheel, copy_sources, install_wheel
from tests.support.paths import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.blender]

_RESOURCES = ("assets_manifest", "blender_scripts", "configs")


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sources")
    copy_sources(folder)
    return folder


@pytest.fixture(scope="module")
def wheel(sources: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_wheel(sources, tmp_path_factory.mktemp("built"))


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install_wheel(wheel, tmp_path_factory.mktemp("fresh"))


def _content(wheel: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist() if not name.endswith("RECORD")}


def test_wheel_of_the_sdist_is_the_wheel_of_the_repository(
    sources: Path, wheel: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    direct = build("wheel", sources, tmp_path_factory.mktemp("direct"))
    assert _content(direct) == _content(wheel)


def test_wheel_holds_every_file_that_runs(wheel: Path) -> None:
    below = {"perpetua": "perpetua", **{name: f"perpetua/resources/{name}" for name in _RESOURCES}}
    wanted = {
        f"{place}/{path.relative_to(ROOT / name).as_posix()}"
        for name, place in below.items()
        for path in (ROOT / name).rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    held = {name for name in _content(wheel) if ".dist-info/" not in name}
    assert held == wanted
    assert "perpetua/py.typed" in held
    assert "perpetua/resources/configs/presets/tiny.yaml" in held


def _perpetua(python: Path, folder: Path, *words: str) -> str:
    """What a command prints in a folder; it must end well."""
    environment = {"PATH": "/usr/bin:/bin", "HOME": str(folder)}
    command = [str(python), "-W", "error::SyntaxWarning", "-m", "perpetua", *words]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{words}: {done.stdout[-1000:]} {done.stderr[-2000:]}"
    return done.stdout


def test_every_command_works_from_an_empty_folder(python: Path, tmp_path: Path) -> None:
    where = "import perpetua, perpetua.resources as r; print(perpetua.__file__, r.SCRIPT_FOLDER)"
    code = [str(python), "-c", where]
    places = subprocess.run(code, cwd=tmp_path, env={}, capture_output=True, text=True, check=True).stdout.split()
    assert all(Path(place).is_relative_to(python.parents[1]) for place in places)

    assert _perpetua(python, tmp_path, "--version").split()[-1] == version("perpetua")
    assert "system libraries" in _perpetua(python, tmp_path, "doctor")
    assert "frames: 6" in _perpetua(python, tmp_path, "config", "--preset", "tiny")
    assert "infinigen" in _perpetua(python, tmp_path, "assets").lower()
    run = ("--preset", "tiny", "--seed", "7", "--rooms", "1", "--out", "out")
    _perpetua(python, tmp_path, "generate", *run)
    sequence = "out/train/seed7-room0000"
    _perpetua(python, tmp_path, "preview", sequence, "--only", "sheet", "--out", "pictures")
    assert list((tmp_path / "pictures").iterdir())
    _perpetua(python, tmp_path, "verify", "--deep", sequence)
    _perpetua(python, tmp_path, "export", sequence, "--format", "tapvid3d", "--out", "exported")
    assert list((tmp_path / "exported").iterdir())
    _perpetua(python, tmp_path, "report", "out")
    planned = _perpetua(python, tmp_path, "submit", "--dry-run", *run)
    assert "1 finished" in planned


def test_the_version_has_one_place() -> None:
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert version("perpetua") == stated, "pyproject.toml is newer than the installed package: ./setup.sh"


def test_every_extra_that_errors_name_brings_packages() -> None:
    wanted = requires("perpetua") or []
    for extra in (*EXTRAS, "all"):
        assert any(f'extra == "{extra}"' in line for line in wanted), extra
