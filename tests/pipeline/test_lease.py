"""Leases: one holder at a time; takes over from the dead and the silent, whatever the clocks say."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from perpetua.errors import InputError
from perpetua.pipeline import lease
from perpetua.pipeline.lease import (
    SILENT_BEATS,
    Holder,
    Lease,
    LeaseHeldError,
    LeaseLostError,
    LeaseWatch,
    hold,
    hold_when_free,
    read_lease,
)
from tests.support.waiting import wait_for

BEAT_S = 0.05

# A process that says it is of another machine, holds the lease, and says what it sees when told to go on.
ELSEWHERE = """
import sys, time
from pathlib import Path
from perpetua.pipeline import lease
lease._this_machine = lambda: "another machine"
with lease.hold(Path(sys.argv[1])) as held:
    print("held", flush=True)
    sys.stdin.readline()
    try:
        held.require_held()
        print("still mine", flush=True)
    except lease.LeaseLostError:
        print("lost", flush=True)
"""


@pytest.fixture(autouse=True)
def _quick_heartbeat(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(lease.HEARTBEAT_VARIABLE, str(BEAT_S))


@pytest.fixture
def elsewhere(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    holder = subprocess.Popen(
        [sys.executable, "-c", ELSEWHERE, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None and holder.stdout.readline() == "held\n"
    yield holder
    holder.kill()
    holder.communicate()


class Clock:
    """The looker's monotonic clock, which moves when it is told to."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_s = 0.0
        monkeypatch.setattr(lease.time, "monotonic", lambda: self.now_s)


def _wait_for_the_next_beat(folder: Path) -> None:
    beat = _beat(folder)
    wait_for(lambda: _beat(folder) > beat, "the next beat")


def _beat(folder: Path) -> int:
    _, holder = read_lease(folder)
    assert holder is not None
    return holder.beat


def test_one_holds_and_the_next_may_when_it_is_released(tmp_path: Path) -> None:
    folder = tmp_path / "new"
    with hold(folder) as held:
        held.require_held()
        with pytest.raises(LeaseHeldError, match=f"process {os.getpid()} on "):
            Lease.acquire(folder)
        assert not LeaseWatch(folder).is_free()
    assert LeaseWatch(folder).is_free()
    with hold(folder) as later:
        later.require_held()


def test_files_of_earlier_holders_do_not_pile_up(tmp_path: Path) -> None:
    for _ in range(9):
        with hold(tmp_path):
            pass
    assert [path.name for path in sorted(tmp_path.iterdir())] == [f".lease-{number:06d}" for number in (7, 8, 9)]


def test_a_killed_holder_of_this_machine_is_replaced_at_once(tmp_path: Path) -> None:
    code = ELSEWHERE.replace('lease._this_machine = lambda: "another machine"', "")
    holder = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None and holder.stdout.readline() == "held\n"
    with pytest.raises(LeaseHeldError):
        Lease.acquire(tmp_path)
    # Not yet waited for: a process that is dead but still listed counts as dead.
    holder.kill()
    os.waitid(os.P_PID, holder.pid, os.WEXITED | os.WNOWAIT)
    with hold(tmp_path):
        pass
    holder.communicate()


def test_who_finds_a_dead_holder_tells_other_machines(tmp_path: Path) -> None:
    dead = replace(Holder.this_process(), pid=2**22 + 1)
    (tmp_path / ".lease-000001").write_bytes(dead.to_bytes())
    assert LeaseWatch(tmp_path).is_free()
    number, holder = read_lease(tmp_path)
    assert (number, holder is not None and holder.released) == (2, True)


def test_a_reused_process_number_is_another_process(tmp_path: Path) -> None:
    me = Holder.this_process()
    assert me.started is not None and not me.is_over
    assert replace(me, started=me.started - 1).is_over


def test_a_holder_elsewhere_is_left_alone_while_its_heart_beats(
    tmp_path: Path, elsewhere: subprocess.Popen[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    watch, clock = LeaseWatch(tmp_path), Clock(monkeypatch)
    for _ in range(3 * SILENT_BEATS):
        _wait_for_the_next_beat(tmp_path)
        clock.now_s += BEAT_S
        assert not watch.is_free()
    out, _ = elsewhere.communicate("\n")
    assert out == "still mine\n"
    assert LeaseWatch(tmp_path).is_free()


def test_a_frozen_holder_elsewhere_is_replaced_and_stops_when_it_wakes(
    tmp_path: Path, elsewhere: subprocess.Popen[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere.send_signal(signal.SIGSTOP)
    wait_for(lambda: "State:\tT" in Path(f"/proc/{elsewhere.pid}/status").read_text(), "the holder to be frozen")
    watch, clock = LeaseWatch(tmp_path), Clock(monkeypatch)
    looks = 0
    while not watch.is_free():
        clock.now_s += BEAT_S
        looks += 1
        assert looks <= SILENT_BEATS + 1
    assert looks >= SILENT_BEATS
    with hold(tmp_path) as held:
        elsewhere.send_signal(signal.SIGCONT)
        out, _ = elsewhere.communicate("\n")
        assert out == "lost\n"
        held.require_held()
        _, holder = read_lease(tmp_path)
        assert holder is not None and holder.pid == os.getpid() and not holder.released


def test_clocks_do_not_matter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither this machine's clock nor the file server's decides who is silent."""
    path = tmp_path / ".lease-000001"
    record = replace(Holder.this_process(), machine="another machine")
    watch, clock = LeaseWatch(tmp_path), Clock(monkeypatch)
    now = time.time()
    for beat in range(3 * SILENT_BEATS):
        path.write_bytes(replace(record, beat=beat).to_bytes())
        jump_s = (-1) ** beat * 1e8
        os.utime(path, (now + jump_s, now + jump_s))
        monkeypatch.setattr(time, "time", lambda jump_s=jump_s: now - jump_s)
        assert not watch.is_free()
        clock.now_s += BEAT_S


def test_time_that_the_looker_missed_is_not_held_against_the_holder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / ".lease-000001").write_bytes(replace(Holder.this_process(), machine="another machine").to_bytes())
    watch = LeaseWatch(tmp_path)
    clock = Clock(monkeypatch)
    looks = 0
    while not watch.is_free():
        clock.now_s += 1e6
        looks += 1
    assert SILENT_BEATS <= looks <= SILENT_BEATS + 1


def test_a_holder_that_died_before_it_wrote_its_name_is_replaced_in_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / ".lease-000001").touch()
    with pytest.raises(LeaseHeldError, match="an unknown host"):
        Lease.acquire(tmp_path)
    watch = LeaseWatch(tmp_path)
    clock = Clock(monkeypatch)
    while not watch.is_free():
        assert clock.now_s < 1000
        clock.now_s += lease.HEARTBEAT_S
    assert clock.now_s == SILENT_BEATS * lease.HEARTBEAT_S
    with hold(tmp_path):
        pass


def test_a_folder_that_is_removed_takes_the_lease_with_it(tmp_path: Path) -> None:
    held = Lease.acquire(tmp_path)
    (tmp_path / ".lease-000001").unlink()
    with pytest.raises(LeaseLostError, match="gave no sign of life"):
        held.require_held()
    held.release()


def test_heartbeat_must_be_a_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(lease.HEARTBEAT_VARIABLE, "soon")
    with pytest.raises(InputError, match=r"PERPETUA_HEARTBEAT_S must be seconds from 0\.05 to 3600, not 'soon'"):
        Lease.acquire(tmp_path)


def _count_up(folder: Path, times: int) -> None:
    counter = folder / "counter"
    for _ in range(times):
        with hold_when_free(folder, look_every_s=0.001) as held:
            counted = int(counter.read_text())
            time.sleep(0.001)
            held.require_held()
            counter.write_text(str(counted + 1))


def test_of_many_that_want_it_one_has_it(tmp_path: Path) -> None:
    (tmp_path / "counter").write_text("0")
    context = multiprocessing.get_context("spawn")
    processes = [context.Process(target=_count_up, args=(tmp_path, 40)) for _ in range(4)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(300)
    assert [process.exitcode for process in processes] == [0] * 4
    assert (tmp_path / "counter").read_text() == "160"
