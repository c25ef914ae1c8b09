"""Rooms on a real Slurm of two virtual nodes, disturbed in many ways, against two local runs that share a folder.

The cluster works with an installed wheel, the local runs with the checkout.
"""

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from perpetua.config import load_config
from perpetua.pipeline.layout import ROOM_LOG, WORK_FOLDER, RoomLayout, RunLayout
from perpetua.pipeline.stages import STAGE_NAMES
from perpetua.pipeline.store import output_hashes
from tests.support.installed_wheel import build_wheel, copy_sources, install_wheel
from tests.support.paths import BENCHMARKS
from tests.support.slurm_cluster import SlurmCluster, missing_programs, slurm_cluster
from tests.support.waiting import wait_for

pytestmark = [pytest.mark.cluster, pytest.mark.blender, pytest.mark.slow]

SETTINGS = BENCHMARKS / "minimal.yaml"
SEED, ROOMS = 7, 6
WHAT = ("--config", str(SETTINGS), "--seed", str(SEED), "--rooms", str(ROOMS))
SUBMIT = ("submit", *WHAT, "--cpus", "1", "--mem", "4", "--time", "60", "--rooms-per-task", "2", "--device", "cpu")
# Much more than it takes, for machines with other work.
PATIENCE_S = 900


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SlurmCluster]:
    if missing := missing_programs():
        reason = f"needs Slurm and Munge (Debian: slurm-wlm munge); these programs are missing: {', '.join(missing)}"
        if os.environ.get("PERPETUA_TEST_SLURM") == "required":
            pytest.fail(reason)
        pytest.skip(reason)
    with slurm_cluster(tmp_path_factory.mktemp("slurm"), ("n1", "n2")) as started:
        yield started


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of an environment with the wheel."""
    sources, built = tmp_path_factory.mktemp("sources"), tmp_path_factory.mktemp("built")
    copy_sources(sources)
    return install_wheel(build_wheel(sources, built), tmp_path_factory.mktemp("installed"))


@dataclass(frozen=True)
class Installed:
    """The installed program, called from a folder that holds no checkout."""

    python: Path
    folder: Path
    environment: dict[str, str]

    def __call__(self, *arguments: str) -> str:
        """What a command prints; it must end well."""
        done = subprocess.run(
            [str(self.python), "-m", "perpetua", *arguments],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE_S,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout


def _layout(out: Path, room: int) -> RoomLayout:
    return RunLayout(out, load_config("standard", SETTINGS).export, SEED).room(room)


def _jobs(folder: Path) -> list[str]:
    return sorted((path.stem.removeprefix("submission-") for path in folder.glob("submission-*.json")), key=int)


def _events(out: Path, kind: str) -> list[tuple[int, str, int]]:
    """Room, stage and number of frames done of every event of a kind, from the rooms' logs."""
    found = []
    for room in range(ROOMS):
        log = _layout(out, room).work_folder / ROOM_LOG
        lines = log.read_text().splitlines() if log.exists() else []
        events = [json.loads(line) for line in lines if line.endswith("}")]
        found += [(room, event["stage"], event["frames_done"]) for event in events if event["kind"] == kind]
    return found


def _when(cluster: SlurmCluster, is_so: Callable[[], bool], what: str) -> None:
    """Waits for something, while tasks that were queued again are let go at once."""

    def looked() -> bool:
        cluster.start_requeued()
        return is_so()

    try:
        wait_for(looked, what, PATIENCE_S, 0.25)
    except AssertionError as error:
        raise AssertionError(f"{error}\n{cluster.describe()}") from None


def _assert_nothing_was_made_twice(out: Path) -> None:
    """Every stage of every room, and every frame, was made, by one process alone."""
    assert {stage for _, stage, _ in _events(out, "stage_finished")} == set(STAGE_NAMES)
    for kind in ("stage_finished", "frame_rendered"):
        assert set(Counter(_events(out, kind)).values()) == {1}


def test_a_disturbed_cluster_makes_the_bytes_of_two_local_runs(
    cluster: SlurmCluster, installed: Path, tmp_path: Path
) -> None:
    perpetua = Installed(installed, tmp_path, cluster.environment)
    out, local = tmp_path / "cluster", tmp_path / "local"
    folder = out / WORK_FOLDER / "slurm"
    submit = (*SUBMIT, "--out", str(out))

    assert "6 to schedule" in perpetua(*submit, "--dry-run")
    assert not out.exists()
    assert "3 task(s) of up to 2" in perpetua(*submit)
    assert folder.stat().st_mode & 0o777 == 0o700
    geometry, rest = _jobs(folder)
    said = perpetua(*submit)
    assert "0 finished, 6 scheduled before, 0 to schedule" in said and _jobs(folder) == [geometry, rest]

    # Queued again by an administrator, in the middle of geometry.
    _when(cluster, lambda: len(_events(out, "stage_finished")) >= 1, "geometry to begin")
    name = min(cluster.running(geometry))
    cluster.run("scontrol", "requeue", name)

    # Out of time while it renders: the signal that Slurm sends before the time is up.
    _when(cluster, lambda: _events(out, "frame_rendered") != [], "a first frame")
    room, _, _ = _events(out, "frame_rendered")[-1]
    stopped = f"{rest}_{room // 2}"
    cluster.run("scancel", "--signal=USR2", stopped)
    _when(cluster, lambda: "Requeued job" in (folder / f"{stopped}_0_log.out").read_text(), "its being queued again")

    # A node loses its power under its task.
    _when(cluster, lambda: cluster.running(rest) != {}, "a task of the rest")
    name, node = min(cluster.running(rest).items())
    cluster.power_off(node)
    _when(cluster, lambda: cluster.tasks().get(name, ("RUNNING", node))[1] != node, "its leaving the node")

    # Cancelled by mistake.
    cancelled = max(cluster.tasks())
    cluster.run("scancel", cancelled)
    cluster.power_on(node)
    _when(cluster, lambda: cluster.tasks() == {}, "all that is queued")

    # The same command schedules what is missing, and that alone.
    said = perpetua(*submit)
    assert "0 scheduled before, " in said and "6 to schedule" not in said and "0 to schedule" not in said
    _when(cluster, lambda: cluster.tasks() == {}, "what was missing")
    said = perpetua(*submit)
    assert "6 finished, 0 scheduled before, 0 to schedule" in said

    status = json.loads(perpetua("status", str(out), "--json"))
    assert [room["state"] for room in status["rooms"]] == ["finished"] * ROOMS
    # Though a task was stopped while it rendered.
    _assert_nothing_was_made_twice(out)

    command = (sys.executable, "-m", "perpetua", "generate")
    generate = [*command, *WHAT, "--workers", "1", "--device", "cpu", "--out", str(local)]
    runs = [subprocess.Popen(generate, stdout=subprocess.DEVNULL) for _ in range(2)]
    assert [run.wait(PATIENCE_S) for run in runs] == [0, 0]
    _assert_nothing_was_made_twice(local)
    for room in range(ROOMS):
        made, expected = (output_hashes(_layout(where, room).sequence_folder) for where in (out, local))
        assert len(made) > 10 and made == expected
    perpetua("clean", str(out))
    assert not (out / WORK_FOLDER).exists()
