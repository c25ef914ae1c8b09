"""Rooms in worker processes: failures, killed workers, memory, other runs on the same folder."""

import json
import multiprocessing
import os
import signal
import time
from collections import Counter
from functools import partial
from pathlib import Path

import pytest

from perpetua.cluster import pool
from perpetua.cluster.local import run_rooms
from perpetua.errors import RouteError
from perpetua.machine.devices import machine_share
from perpetua.machine.free_memory import free_memory_mb
from perpetua.pipeline.events import Event, OnEvent
from perpetua.pipeline.layout import ROOM_LOG
from perpetua.pipeline.lease import HEARTBEAT_S, SILENT_BEATS, hold
from perpetua.pipeline.room_work import RoomWork
from tests.support.waiting import wait_for


def _folder(out: Path, room: int) -> Path:
    return out / ".work" / str(room)


def _job(out: Path, room: int, on_event: OnEvent) -> None:
    """Makes a room that is not made yet; room 1 of a run with a file ``fail`` or ``kill`` does not work out."""
    on_event(Event("room_started", room))
    made = out / f"made-{room}"
    if not made.exists():
        with hold(_folder(out, room)):
            if not made.exists():
                _make(out, made, room, on_event)
    on_event(Event("room_finished", room))


def _make(out: Path, made: Path, room: int, on_event: OnEvent) -> None:
    on_event(Event("stage_started", room, "render"))
    if room == 1 and (out / "fail").exists():
        raise RouteError("no way through")
    kills = out / "kill"
    if room == 1 and kills.exists() and len(kills.read_text()) > 0:
        kills.write_text(kills.read_text()[1:])
        os.kill(os.getpid(), signal.SIGKILL)
    (out / f"at-work-{room}").touch()
    if (out / "meet").exists():
        wait_for(lambda: len(list(out.glob("at-work-*"))) >= 2, "another room at the same time")
    time.sleep(0.05)
    with (out / "computed").open("a") as log:
        log.write(f"{room} {os.getpid()}\n")
    made.touch()
    on_event(Event("stage_finished", room, "render"))


def _work(out: Path, memory_mb: float = 1.0) -> RoomWork:
    return RoomWork(partial(_job, out), partial(_folder, out), memory_mb)


def _computed(out: Path) -> dict[int, list[str]]:
    processes: dict[int, list[str]] = {}
    for line in (out / "computed").read_text().splitlines():
        room, process = line.split()
        processes.setdefault(int(room), []).append(process)
    return processes


@pytest.mark.parametrize("workers", [1, 2])
def test_one_failing_room_does_not_stop_the_others(tmp_path: Path, workers: int) -> None:
    (tmp_path / "fail").touch()
    events: list[Event] = []
    failures = run_rooms(range(4), workers, _work(tmp_path), events.append)
    assert failures == {1: "no way through"}
    assert {event.room for event in events if event.kind == "room_finished"} == {0, 2, 3}
    assert [event.text for event in events if event.kind == "room_failed"] == ["no way through"]
    (tmp_path / "fail").unlink()
    assert run_rooms(range(4), workers, _work(tmp_path), events.append) == {}
    assert {room: len(processes) for room, processes in _computed(tmp_path).items()} == {0: 1, 1: 1, 2: 1, 3: 1}


def test_a_room_whose_worker_is_killed_is_tried_once_more(tmp_path: Path) -> None:
    (tmp_path / "kill").write_text("x")
    events: list[Event] = []
    assert run_rooms(range(5), 2, _work(tmp_path), events.append) == {}
    assert sorted(_computed(tmp_path)) == [0, 1, 2, 3, 4]
    told = [event.text for event in events if event.kind == "message"]
    assert told == [
        "its worker process was ended by SIGKILL (memory ran out, or someone stopped it); it is tried once more, alone"
    ]


def test_a_room_that_kills_its_worker_twice_fails_alone(tmp_path: Path) -> None:
    (tmp_path / "kill").write_text("xxxx")
    failures = run_rooms(range(5), 2, _work(tmp_path), lambda event: None)
    assert list(failures) == [1] and failures[1].startswith("its worker process was ended by SIGKILL")
    assert failures[1].endswith("twice: if memory ran out, lower --workers or the size of the pictures")
    assert sorted(_computed(tmp_path)) == [0, 2, 3, 4]
    assert (tmp_path / "kill").read_text() == "xx"


def _most_at_a_time(events: list[Event]) -> int:
    at_work, most = 0, 0
    for event in events:
        at_work += {"room_started": 1, "room_finished": -1}.get(event.kind, 0)
        most = max(most, at_work)
    return most


def test_no_more_rooms_at_a_time_than_memory_allows(tmp_path: Path) -> None:
    events: list[Event] = []
    run_rooms(range(4), 3, _work(tmp_path, 0.7 * free_memory_mb()), events.append)
    assert _most_at_a_time(events) == 1
    assert [event.text.partition(":")[0] for event in events if event.kind == "message"] == ["waits for memory"]
    (tmp_path / "roomy").mkdir()
    events.clear()
    (tmp_path / "roomy" / "meet").touch()
    assert run_rooms(range(6), 2, _work(tmp_path / "roomy"), events.append) == {}, "two met at work"
    assert _most_at_a_time(events) <= 2


def test_a_worker_that_keeps_much_memory_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_rooms(range(3), 1, _work(tmp_path), lambda event: None)
    assert len({process for [process] in _computed(tmp_path).values()}) == 1
    monkeypatch.setattr(pool, "RECYCLED_ABOVE_MB", 1.0)
    run_rooms(range(3, 6), 1, _work(tmp_path), lambda event: None)
    assert len({process for [process] in _computed(tmp_path).values()}) == 4


def test_each_room_has_a_log_of_its_own(tmp_path: Path) -> None:
    for _ in range(2):
        run_rooms(range(2), 2, _work(tmp_path), lambda event: None)
    for room in range(2):
        lines = [json.loads(line) for line in (_folder(tmp_path, room) / ROOM_LOG).read_text().splitlines()]
        kinds = ["room_started", "stage_started", "stage_finished", "room_finished"]
        assert [line["kind"] for line in lines] == kinds
        assert {line["room"] for line in lines} == {room}


def _whole_run(out: Path, name: str, rooms: int, workers: int) -> None:
    failures = run_rooms(range(rooms), workers, _work(out), lambda event: None)
    (out / f"result-{name}").write_text(json.dumps([failures, sorted(path.name for path in out.glob("made-*"))]))


@pytest.mark.parametrize("rooms", [1, 6])
def test_two_runs_on_one_folder_share_the_rooms(tmp_path: Path, rooms: int) -> None:
    context = multiprocessing.get_context("spawn")
    runs = [context.Process(target=_whole_run, args=(tmp_path, name, rooms, 2)) for name in "ab"]
    for run in runs:
        run.start()
    for run in runs:
        run.join(300)
    for name in "ab":
        result = json.loads((tmp_path / f"result-{name}").read_text())
        assert result == [{}, [f"made-{room}" for room in range(rooms)]]
    computed = _computed(tmp_path)
    assert Counter(len(processes) for processes in computed.values()) == {1: rooms}


def test_ctrl_c_does_not_hit_a_worker_that_is_being_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    start_worker = pool._start_worker

    def start_and_interrupt(work: RoomWork, place: int, size: int) -> pool.Worker:
        worker = start_worker(work, place, size)
        assert worker.process.pid is not None
        os.kill(worker.process.pid, signal.SIGINT)
        return worker

    monkeypatch.setattr(pool, "_start_worker", start_and_interrupt)
    assert run_rooms(range(2), 2, _work(tmp_path), lambda event: None) == {}
    assert sorted(_computed(tmp_path)) == [0, 1]
    assert {len(processes) for processes in _computed(tmp_path).values()} == {1}
    assert capfd.readouterr().err == ""


def test_a_room_of_a_run_that_was_killed_is_taken_over(tmp_path: Path) -> None:
    """The killed run's workers die with it, and their leases are seen to be over."""
    context = multiprocessing.get_context("spawn")
    run = context.Process(target=_whole_run, args=(tmp_path, "a", 20, 2))
    run.start()
    wait_for((tmp_path / "computed").exists, "the first room")
    run.kill()
    run.join()
    started = time.monotonic()
    assert run_rooms(range(20), 2, _work(tmp_path), lambda event: None) == {}
    # By the silence of their heartbeats alone it would take longer.
    assert time.monotonic() - started < SILENT_BEATS * HEARTBEAT_S
    assert sorted(_computed(tmp_path)) == list(range(20))


def _note_fraction(out: Path, room: int, on_event: OnEvent) -> None:
    fraction = machine_share()
    (out / f"share-{room}").write_text(f"{os.getpid()} {fraction.worker}/{fraction.workers}")
    wait_for(lambda: len(list(out.glob("share-*"))) >= 2, "the other worker")


def test_each_worker_has_a_place_of_its_own_on_the_machine(tmp_path: Path) -> None:
    """By its place it takes GPUs and CPU threads that no other takes."""
    work = RoomWork(partial(_note_fraction, tmp_path), partial(_folder, tmp_path), 1.0)
    assert run_rooms(range(4), 2, work, lambda event: None) == {}
    noted = {path.read_text() for path in tmp_path.glob("share-*")}
    assert {text.split()[1] for text in noted} == {"0/2", "1/2"}
    assert len(noted) == 2
