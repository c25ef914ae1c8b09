"""What is given to Slurm: plans, and what submitit hands to a stand-in for Slurm's commands."""

import json
import os
import pickle
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

from perpetua.cli.app import main
from perpetua.cluster import slurm
from perpetua.cluster.plan import Resources, make_plan
from perpetua.cluster.task import MOST_IDLE_ATTEMPTS, RoomsTask
from perpetua.config import Config
from perpetua.errors import InputError, PerpetuaError
from perpetua.io.files import write_json
from perpetua.pipeline.events import Event
from perpetua.pipeline.layout import RoomLayout, RunLayout, RunRecord
from perpetua.pipeline.room_work import GenerateRequest
from perpetua.pipeline.runner import stage_keys
from perpetua.pipeline.stages import STAGES
from perpetua.pipeline.store import Manifest

SEED = 7
RESOURCES = Resources(
    partition="gpu",
    geometry_partition="cpu",
    cpus=2,
    memory_gb=4.5,
    gpus=1,
    minutes=60,
    array_parallelism=3,
    rooms_per_task=None,
)
ROOM_MB = 2000.0


def _layouts(out: Path, rooms: int) -> list[RoomLayout]:
    return [RunLayout(out, Config().export, SEED).room(room) for room in range(rooms)]


def _run(rooms: int) -> RunRecord:
    return RunRecord(SEED, tuple(range(rooms)), Config())


def _publish(layout: RoomLayout) -> None:
    key = stage_keys(Config(), SEED, layout.number)[STAGES[-1].name]
    write_json(layout.sequence_folder / "audit.json", {"key": key, "rejected_draws": 0})


def _finish_geometry(layout: RoomLayout) -> None:
    stage = next(stage for stage in STAGES if stage.name == "cameras")
    folder = layout.stage(stage)
    key = stage_keys(Config(), SEED, layout.number)[stage.name]
    folder.begin(key, resumable=False)
    folder.finish(Manifest(key, stage.name, stage.version, SEED, layout.number, {}, {}, 1.0, 1.0))


def test_only_what_is_missing_is_planned(tmp_path: Path) -> None:
    layouts = _layouts(tmp_path, 10)
    _publish(layouts[0])
    for room in (2, 3, 4):
        _finish_geometry(layouts[room])
    plan = make_plan(_run(10), layouts, {4, 5, 99}, RESOURCES, ROOM_MB, 1001)
    assert (plan.finished, plan.scheduled_before, plan.rooms) == (1, 2, 7)
    # As many rooms to a task as it can work on at a time: 2 on its CPUs and memory, 1 on its GPU.
    assert plan.from_start == ((1, 6), (7, 8), (9,))
    assert plan.from_pictures == ((2,), (3,))


def test_tasks_are_as_few_as_slurm_allows(tmp_path: Path) -> None:
    layouts = _layouts(tmp_path, 25)
    plan = make_plan(_run(25), layouts, (), RESOURCES, ROOM_MB, 4)
    assert [len(task) for task in plan.from_start] == [7, 7, 7, 4]
    assert sorted(room for task in plan.from_start for room in task) == list(range(25))
    with pytest.raises(InputError, match="would make 9 tasks, and Slurm allows 4 in an array here: give at least 7"):
        make_plan(_run(25), layouts, (), replace(RESOURCES, rooms_per_task=3), ROOM_MB, 4)


def test_rooms_at_a_time_keep_to_memory() -> None:
    assert RESOURCES.geometry_workers(ROOM_MB) == 2
    assert RESOURCES.geometry_workers(3000.0) == 1
    assert RESOURCES.geometry_workers(9000.0) == 1
    assert (RESOURCES.render_workers, replace(RESOURCES, gpus=0).render_workers) == (1, 1)


@pytest.fixture
def fake_slurm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Commands that take everything, count jobs up from 101, and list what a file says."""
    folder = tmp_path / "bin"
    folder.mkdir()
    (folder / "queue").touch()
    (folder / "last").write_text("100")
    sbatch = f'n=$(($(cat {folder}/last) + 1)); echo $n > {folder}/last; cp "$1" {folder}/$n.sh; '
    scripts = {
        "sbatch": sbatch + 'echo "Submitted batch job $n"',
        "srun": "exit 1",
        "squeue": f"cat {folder}/queue",
        "scontrol": 'echo "MaxArraySize            = 3"',
    }
    for name, script in scripts.items():
        (folder / name).write_text(f"#!/bin/sh\n{script}\n")
        (folder / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}{os.pathsep}{os.environ['PATH']}")
    return folder


def _submit(out: Path, *more: str, code: int = 0) -> str:
    arguments = ["submit", "--preset", "tiny", "--seed", str(SEED), "--out", str(out), *more]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == code, done.output
    return done.output


def test_two_dependent_arrays_are_submitted_once(fake_slurm: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    options = ("--rooms", "5", "--gpus", "2", "--partition", "gpu", "--geometry-partition", "cpu", "--mem", "4")
    said = _submit(out, *options, "--sbatch", "account=vision", "--array-parallelism", "2")
    assert "0 finished, 0 scheduled before, 5 to schedule" in said
    geometry, rest = ((fake_slurm / f"{job}.sh").read_text() for job in (101, 102))
    for script in (geometry, rest):
        for line in ("array=0-2%2", "account=vision", "requeue", "mem=4000M", "signal=USR2@60"):
            assert f"#SBATCH --{line}" in script
        assert " --cpus-per-task=4 " in script
    assert "--partition=cpu\n" in geometry and "--gpus-per-node" not in geometry and "dependency" not in geometry
    assert "--partition=gpu\n" in rest and "--gpus-per-node=2\n" in rest and "--dependency=aftercorr:101\n" in rest

    (fake_slurm / "queue").write_text("101_0 RUNNING\n101_1 COMPLETING\n102_0 PENDING\n102_2 PENDING\n900_1 RUNNING\n")
    said = _submit(out, *options, "--dry-run")
    assert "0 finished, 3 scheduled before, 2 to schedule" in said
    (fake_slurm / "queue").write_text("")
    said = _submit(out, "--rooms", "1")
    assert "0 scheduled before, 1 to schedule" in said
    assert "--dependency=afterok:103" in (fake_slurm / "104.sh").read_text()


def test_settings_are_not_changed_under_scheduled_tasks(fake_slurm: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    _submit(out, "--rooms", "2")
    (fake_slurm / "queue").write_text("101 RUNNING\n")
    assert "was made with other settings" in _submit(out, "--rooms", "2", "--set", "tracks.count=9", code=2)
    said = _submit(out, "--rooms", "2", "--set", "tracks.count=9", "--replace", code=2)
    assert "are scheduled: scancel them" in said


def test_refusals_of_slurm_are_told(fake_slurm: Path, tmp_path: Path) -> None:
    (fake_slurm / "sbatch").write_text("#!/bin/sh\necho 'sbatch: error: invalid partition' >&2\nexit 1\n")
    said = _submit(tmp_path / "out", "--rooms", "2", code=1)
    assert "Slurm did not take the tasks" in said and "invalid partition" in said


def test_a_missing_input_is_told_before_anything_is_scheduled(fake_slurm: Path, tmp_path: Path) -> None:
    wrong = ("--set", "actors.clothing.source=makehuman", "--set", f"actors.clothing.folder={tmp_path / 'none'}")
    assert "none" in _submit(tmp_path / "out", *wrong, code=2)
    (tmp_path / "file").touch()
    assert "file" in _submit(tmp_path / "file", code=2)
    assert (fake_slurm / "last").read_text() == "100" and not (tmp_path / "out").exists()


def test_tasks_run_nothing_that_others_may_have_stored(tmp_path: Path) -> None:
    folder = tmp_path / "slurm"
    slurm.open_folder(folder)
    assert folder.stat().st_mode & 0o777 == 0o700
    folder.chmod(0o770)
    with pytest.raises(InputError, match="must be yours alone"):
        slurm.open_folder(folder)


def test_submit_needs_slurm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "submit needs Slurm's 'sbatch'" in _submit(tmp_path / "out", code=2)
    assert "--sbatch takes OPTION=VALUE" in _submit(tmp_path / "out", "--sbatch", "exclusive", code=2)


def _task(out: Path, until: str) -> RoomsTask:
    request = GenerateRequest(Config(), SEED, range(4), None, out, 1, "cpu", False)
    return RoomsTask(request, (0, 1), until)


def test_a_task_that_comes_no_further_is_not_queued_for_ever(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("signal.signal", lambda *_: None)
    task = _task(tmp_path, "audit")
    for _ in range(3 * MOST_IDLE_ATTEMPTS):
        task._tell(Event("frame_rendered", 0, "render", frames_done=1, frames_total=2))
        task = pickle.loads(pickle.dumps(task.checkpoint())).function
        assert task == _task(tmp_path, "audit")
    for _ in range(MOST_IDLE_ATTEMPTS - 1):
        task = task.checkpoint().function
    assert task.checkpoint() is None
    assert capsys.readouterr().out.endswith("attempts finished no frame and no stage; raise --time\n")


def test_rooms_without_geometry_are_not_tried_where_a_gpu_waits(tmp_path: Path) -> None:
    for layout in _layouts(tmp_path, 2):
        write_json(layout.failure_file, {"stage": "routes", "reason": f"too narrow {layout.number}", "exit_code": 1})
    task = _task(tmp_path, "audit")
    assert task._failed_geometry() == {0: "too narrow 0", 1: "too narrow 1"}
    _finish_geometry(_layouts(tmp_path, 2)[0])
    assert task._failed_geometry() == {1: "too narrow 1"}
    write_json(_layouts(tmp_path, 2)[1].failure_file, {"stage": "render", "reason": "no light", "exit_code": 1})
    assert task._failed_geometry() == {}


def test_a_task_whose_rooms_failed_fails_in_the_end_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("perpetua.cluster.task.Pool.run", lambda self, rooms: dict.fromkeys(rooms, "no"))
    monkeypatch.setattr("perpetua.cluster.task.raise_on_sigterm", lambda: None)
    _task(tmp_path, "cameras")()
    notes = [json.loads(layout.failure_file.read_text()) for layout in _layouts(tmp_path, 2)]
    assert [(note["stage"], note["reason"]) for note in notes] == [("room", "no")] * 2
    with pytest.raises(PerpetuaError, match="2 of 2 rooms failed"):
        _task(tmp_path, "audit")()
