"""A package of plug-ins, installed beside Perpetua: it is listed, passes the suites, and makes and exports a room."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from perpetua.formats.reader import read_sequence
from tests.support.paths import ROOT

pytestmark = pytest.mark.slow

SOURCES = ROOT / "tests" / "plugin"


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder into which pip has installed the package; building leaves files behind, so it works on a copy."""
    copy = shutil.copytree(SOURCES, tmp_path_factory.mktemp("sources") / "plugin")
    target = tmp_path_factory.mktemp("packages")
    options = ["--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--target", str(target)]
    subprocess.run([sys.executable, "-m", "pip", "install", *options, str(copy)], check=True)
    return target


def _python(packages: Path, place: Path, *arguments: str, package: str = "perpetua-hall") -> tuple[int, str]:
    """Exit code and output of Python in an empty folder, with the package installed."""
    environment = {**os.environ, "PYTHONPATH": str(packages), "PERPETUA_TEST_PACKAGE": package, "COLUMNS": "200"}
    done = subprocess.run([sys.executable, *arguments], cwd=place, env=environment, capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def _suites(packages: Path, place: Path, *arguments: str, suite: str = "perpetua.testing") -> tuple[int, str]:
    return _python(packages, place, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--pyargs", suite, *arguments)


def test_config_doctor_and_errors_name_the_package(packages: Path, tmp_path: Path) -> None:
    _, shown = _python(packages, tmp_path, "-m", "perpetua", "config", "--preset", "tiny")
    assert shown.count("installed beside perpetua: hall (of perpetua-hall 0.1)") == 1
    assert shown.count("installed beside perpetua: bowed (of perpetua-hall 0.1)") == 1
    _, told = _python(packages, tmp_path, "-m", "perpetua", "doctor")
    rows = [line for line in told.splitlines() if "perpetua-hall 0.1" in line]
    assert all(any(f" {name} " in row for row in rows) for name in ("hall", "bowed", "table")), told
    code, refusal = _python(
        packages, tmp_path, "-m", "perpetua", "generate", "--preset", "tiny", "--set", "rooms.source=hal", "--dry-run"
    )
    assert code == 2 and "'hall' (of perpetua-hall 0.1)" in refusal and "did you mean 'hall'?" in refusal


def test_the_package_passes_the_suites(packages: Path, tmp_path: Path) -> None:
    code, output = _suites(packages, tmp_path)
    assert code == 0, output[-3000:]
    _, collected = _suites(packages, tmp_path, "--collect-only")
    for suite, name in (("room_sources", "hall-livingroom"), ("motion_sources", "bowed"), ("exporters", "table")):
        assert any(f"test_{suite}.py" in line and name in line for line in collected.splitlines()), collected[-2000:]


def test_a_package_that_adds_nothing_is_refused(packages: Path, tmp_path: Path) -> None:
    code, output = _python(packages, tmp_path, "-m", "pytest", "--pyargs", "perpetua.testing", package="numpy")
    assert code != 0 and "no installed package 'numpy' adds anything to Perpetua" in output


def test_a_source_that_breaks_the_rules_fails_the_suites(packages: Path, tmp_path: Path) -> None:
    broken = Path(shutil.copytree(packages, tmp_path / "packages"))
    module = broken / "perpetua_hall" / "motion.py"
    code = module.read_text()
    assert "BOW_RAD = 0.2" in code
    # Another motion each time it is asked.
    each_time_another = code.replace("BOW_RAD = 0.2", "from itertools import count\nBOWS_RAD = count()")
    module.write_text(each_time_another.replace("BOW_RAD", "next(BOWS_RAD)"))
    suite = "perpetua.testing.test_motion_sources"
    exit_code, output = _suites(broken, tmp_path, "-k", "same_arguments", suite=suite)
    assert exit_code == 1 and "1 failed" in output, output[-3000:]


@pytest.mark.blender
def test_a_sequence_is_made_and_exported_with_its_plug_ins(packages: Path, tmp_path: Path) -> None:
    chosen = ("--set", "rooms.source=hall", "--set", "actors.motion.source=bowed")
    arguments = ("-m", "perpetua", "generate", "--preset", "tiny", "--rooms", "1", *chosen, "--out", "out")
    code, output = _python(packages, tmp_path, *arguments)
    assert code == 0, output[-3000:]
    sequence = read_sequence(tmp_path / "out/train/seed0-room0000")
    assert sequence.record is not None
    assert {"column", "floor", "wall", "person"} <= {entry["category"] for entry in sequence.record["objects"]}
    code, output = _python(
        packages, tmp_path, "-m", "perpetua", "export", str(sequence.folder), "--format", "table", "--out", "tables"
    )
    assert code == 0, output[-3000:]
    rows = np.loadtxt(tmp_path / "tables/seed0-room0000.csv", delimiter=",", skiprows=1)
    assert np.allclose(rows[:, 2:].reshape(sequence.tracks_m.shape), sequence.tracks_m, atol=1e-4)
