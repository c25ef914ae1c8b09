"""Faults of the machine, on the runner with small stages: what is said, and that the same call then goes on."""

import errno
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from perpetua.config import Config
from perpetua.errors import PerpetuaError
from perpetua.pipeline.cost import check_disk, estimate_cost, require_room_space
from perpetua.pipeline.events import Event
from perpetua.pipeline.layout import RoomLayout, RunLayout, open_run
from perpetua.pipeline.os_errors import DiskError, OutOfMemoryError, explained
from perpetua.pipeline.runner import RoomRun
from perpetua.pipeline.stages import Stage, StageContext
from perpetua.pipeline.store import StageFolder, output_hashes
from perpetua.pipeline.work_area import free_work

NUMBERS = 300_000


def _room(context: StageContext) -> object:
    return context.seed.stream("room").random(NUMBERS)


def _export(context: StageContext) -> object:
    folder = context.folder / "sequence"
    folder.mkdir()
    np.save(folder / "numbers.npy", context.one("room", np.ndarray) * 2.0)
    return None


def _audit(context: StageContext) -> object:
    (context.folder / "audit.json").write_text("{}")
    return None


def _no_settings(config: Config) -> dict[str, Any]:
    return {}


def _stages(room: Callable[[StageContext], object] = _room) -> tuple[Stage, ...]:
    return (
        Stage(10, "room", 1, (), _no_settings, room),
        Stage(90, "export", 1, ("room",), _no_settings, _export),
        Stage(95, "audit", 1, ("export",), _no_settings, _audit),
    )


def _run(
    out: Path,
    room: Callable[[StageContext], object] = _room,
    keep: Literal["all", "tracks", "none"] = "all",
) -> tuple[RoomLayout, list[str]]:
    config = Config.model_validate({"work": {"keep": keep}})
    events: list[Event] = []
    RoomRun(config, 3, 0, out, "cpu", events.append, _stages(room)).run("audit")
    computed = [event.stage for event in events if event.kind == "stage_finished"]
    return RunLayout(out, config.export, 3).room(0), computed


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    layout, _ = _run(tmp_path_factory.mktemp("undisturbed"))
    return output_hashes(layout.sequence_folder)


def _partial_stages(out: Path) -> list[str]:
    return [path.name for path in out.rglob("*.partial")]


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 4 MB, of which the room takes 2.4 and the sequence as much again."""
    disk = tmp_path / "disk"
    disk.mkdir()
    if _mount(disk, "size=4m", "-t", "tmpfs", "tmpfs").returncode != 0:
        pytest.skip("mounting needs rights that this process does not have")
    yield disk
    # Lazily: what failed in a test may hold a file open.
    subprocess.run(["umount", "-l", str(disk)], check=True)


def _mount(disk: Path, option: str, *what: str) -> subprocess.CompletedProcess[bytes]:
    program = shutil.which("mount") or "mount"
    return subprocess.run([program, "-o", option, *what, str(disk)], capture_output=True, check=False)


def test_full_disk_says_so_and_the_same_call_goes_on(small_disk: Path, undisturbed: dict[str, str]) -> None:
    with pytest.raises(DiskError, match=r"stage 'export' could not write .*disk is full.*perpetua clean") as caught:
        _run(small_disk)
    assert caught.value.exit_code == 1
    assert _partial_stages(small_disk) == []
    assert _mount(small_disk, "remount,size=16m").returncode == 0
    layout, computed = _run(small_disk)
    assert computed == ["export", "audit"]
    assert output_hashes(layout.sequence_folder) == undisturbed


def test_read_only_folder_is_refused_before_work_begins(small_disk: Path) -> None:
    assert _mount(small_disk, "remount,ro").returncode == 0
    with pytest.raises(PerpetuaError, match="cannot write to --out") as caught:
        open_run(small_disk, 3, range(1), Config(), replace=False)
    assert caught.value.exit_code == 2
    assert _mount(small_disk, "remount,rw,size=16m").returncode == 0
    assert _run(small_disk)[1] == ["room", "export", "audit"]


@pytest.mark.parametrize("number", [errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EIO, errno.ESTALE, errno.EMFILE])
def test_every_fault_of_a_disk_has_a_remedy(tmp_path: Path, number: int) -> None:
    def room(context: StageContext) -> object:
        raise OSError(number, "fault", str(tmp_path / "file"))

    with pytest.raises(DiskError, match=r"'room' could not write '.*file': .*: .*, then run the same command again"):
        _run(tmp_path / "out", room)
    assert _run(tmp_path / "out")[1] == ["room", "export", "audit"]


@pytest.mark.parametrize(
    "error", [MemoryError(), RuntimeError("[enforce fail at alloc_cpu.cpp] DefaultCPUAllocator: can't allocate memory")]
)
def test_memory_that_runs_out_says_so(tmp_path: Path, error: Exception, undisturbed: dict[str, str]) -> None:
    def room(context: StageContext) -> object:
        raise error

    with pytest.raises(OutOfMemoryError, match=r"stage 'room' ran out of memory: lower --workers"):
        _run(tmp_path, room)
    layout, _ = _run(tmp_path)
    assert output_hashes(layout.sequence_folder) == undisturbed


def test_other_errors_pass_unchanged(tmp_path: Path) -> None:
    for error in (RuntimeError("a fault of ours"), FileNotFoundError(errno.ENOENT, "not there")):
        with pytest.raises(type(error)) as caught, explained("room", tmp_path):
            raise error
        assert caught.value is error


@pytest.mark.parametrize("damage", ["flip", "cut", "empty", "remove", "manifest"])
def test_damaged_stage_is_made_again_with_what_follows(
    tmp_path: Path, damage: str, undisturbed: dict[str, str]
) -> None:
    layout, _ = _run(tmp_path)
    shutil.rmtree(layout.sequence_folder)
    folder = StageFolder(layout.work_folder, 10, "room").final
    path = folder / ("manifest.json" if damage == "manifest" else "a1.npy")
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    match damage:
        case "flip":
            path.write_bytes(content)
        case "cut" | "manifest":
            path.write_bytes(content[:-7])
        case "empty":
            path.write_bytes(b"")
        case "remove":
            path.unlink()
    again, computed = _run(tmp_path)
    assert computed == ["room"]
    assert output_hashes(again.sequence_folder) == undisturbed


def test_clock_that_jumps_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, undisturbed: dict[str, str]
) -> None:
    jumps = np.random.default_rng(0)
    monkeypatch.setattr(time, "time", lambda: float(jumps.uniform(-1e9, 4e9)))
    layout, _ = _run(tmp_path)
    assert output_hashes(layout.sequence_folder) == undisturbed


@pytest.mark.parametrize(
    ("keep", "left"), [("all", {"room", "export", "audit"}), ("tracks", {"room"}), ("none", set[str]())]
)
def test_what_is_kept_of_the_work_follows_the_policy(
    tmp_path: Path, keep: Literal["all", "tracks", "none"], left: set[str], undisturbed: dict[str, str]
) -> None:
    layout, computed = _run(tmp_path, keep=keep)
    stages = {stage.name: layout.stage(stage).final for stage in _stages()}
    assert {name for name, folder in stages.items() if folder.exists()} == left
    assert output_hashes(layout.sequence_folder) == undisturbed
    assert computed == ["room", "export", "audit"]
    # The policy changes nothing of the sequence, so that a finished one is not made again for it.
    assert _run(tmp_path, keep="all")[1] == []
    _run(tmp_path, keep="none")
    assert not any(folder.exists() for folder in stages.values())


def test_freeing_leaves_what_is_no_stage(tmp_path: Path) -> None:
    layout, _ = _run(tmp_path)
    (layout.work_folder / "log.jsonl").write_text("{}\n")
    free_work(layout.work_folder, "none", _stages())
    assert (layout.work_folder / "log.jsonl").exists()


def test_disk_is_looked_at_before_work_begins(small_disk: Path) -> None:
    cost = estimate_cost(Config(), 2)
    with pytest.raises(
        PerpetuaError, match=r"2 room\(s\) need about .* GB .*4\.2 MB free: .*work\.keep=none"
    ) as caught:
        check_disk(cost, small_disk / "not" / "there" / "yet")
    assert caught.value.exit_code == 2
    with pytest.raises(DiskError, match=r"a room needs about .* has 4\.2 MB left: free space"):
        require_room_space(cost, small_disk)


def test_files_are_counted_too(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    if _mount(disk, "size=64g,nr_inodes=50", "-t", "tmpfs", "tmpfs").returncode != 0:
        pytest.skip("mounting needs rights that this process does not have")
    try:
        with pytest.raises(PerpetuaError, match=r"one room needs about \d+ files .* place for 4\d more"):
            check_disk(estimate_cost(Config(), 1), disk)
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_estimate_follows_what_is_kept_and_how_many_work_at_once() -> None:
    def total(keep: str, workers: int) -> float:
        return estimate_cost(Config.model_validate({"work": {"keep": keep}}), 100, workers).total_bytes

    assert total("none", 1) < total("tracks", 1) < total("all", 1)
    assert total("none", 8) > total("none", 1)
    one = estimate_cost(Config(), 1)
    assert one.total_bytes == pytest.approx(one.room_bytes)
