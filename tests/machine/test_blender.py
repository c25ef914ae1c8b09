"""Running a script of Blender: events, last words, time-outs, and that no process is left behind."""

import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from perpetua.errors import AssetError, EnvironmentSetupError
from perpetua.machine.blender import BlenderError, Event, run_script
from perpetua.resources import SCRIPT_FOLDER
from tests.support.waiting import has_ended, wait_for


def _run(tmp_path: Path, body: str, timeout_s: float = 20.0, blender: str | None = None) -> list[Event]:
    script = tmp_path / "fake.py"
    script.write_text("import json, os, signal, subprocess, sys, time\n" + textwrap.dedent(body))
    events: list[Event] = []
    run_script(
        script,
        tmp_path / "job.json",
        blender=blender,
        scratch=tmp_path,
        silence_timeout_s=timeout_s,
        on_event=events.append,
    )
    return events


def _wait_until_gone(pid: int) -> None:
    wait_for(lambda: has_ended(pid), f"the end of process {pid}", most_s=50.0)


def test_only_events_are_handed_on(tmp_path: Path) -> None:
    events = _run(
        tmp_path,
        """
        print("Blender 4.2.0")
        print(json.dumps({"event": "frame", "frame": 3}), flush=True)
        print("[1, 2]")
        print('{"no": "event"}')
        sys.stdout.write('{"event": "la'); sys.stdout.flush(); time.sleep(0.1)
        print('st", "job": "%s"}' % os.path.basename(sys.argv[1]))
        """,
    )
    assert events == [{"event": "frame", "frame": 3}, {"event": "last", "job": "job.json"}]


def test_settings_folder_is_private(tmp_path: Path) -> None:
    events = _run(tmp_path, 'print(json.dumps({"event": "e", "at": os.environ["BLENDER_USER_RESOURCES"]}))')
    assert Path(events[0]["at"]).parent == tmp_path.resolve()


def test_failure_shows_the_last_words(tmp_path: Path) -> None:
    with pytest.raises(BlenderError, match="exit code 3") as error:
        _run(tmp_path, 'print("Fra:1 Mem:1M", file=sys.stderr); print("out of luck", file=sys.stderr); sys.exit(3)')
    assert error.value.tail == "out of luck"


def test_death_by_signal_is_named(tmp_path: Path) -> None:
    with pytest.raises(BlenderError, match=r"SIGKILL.*memory") as error:
        _run(tmp_path, "os.kill(os.getpid(), signal.SIGKILL)")
    assert error.value.memory


@pytest.mark.parametrize(
    ("words", "memory", "gpu_memory"),
    [
        ("MemoryError: Unable to allocate 3.2 GiB", True, False),
        ("terminate called after throwing an instance of 'std::bad_alloc'", True, False),
        ("Malloc returns null: len=3145728 in pixels, total 9", True, False),
        ("RuntimeError: Error: System is out of GPU memory", False, True),
        ("CUDA_ERROR_OUT_OF_MEMORY in cuMemAlloc", False, True),
        ("hipErrorOutOfMemory", False, True),
        ("segmentation fault", False, False),
    ],
)
def test_memory_that_runs_out_is_recognised(tmp_path: Path, words: str, memory: bool, gpu_memory: bool) -> None:
    with pytest.raises(BlenderError) as error:
        _run(tmp_path, f"sys.exit({words!r})")
    assert (error.value.memory, error.value.gpu_memory) == (memory, gpu_memory)
    assert ("memory ran out" in error.value.reason) == (memory or gpu_memory)


def test_eevee_without_graphics_says_what_to_set(tmp_path: Path) -> None:
    body = """
        print("Assertion `0 && \\"Couldn't find current GLX or EGL context.", file=sys.stderr, flush=True)
        os.abort()
        """
    with pytest.raises(EnvironmentSetupError, match=r"render\.engine=cycles"):
        _run(tmp_path, body)


def test_missing_system_library_names_the_packages(tmp_path: Path) -> None:
    body = 'sys.exit("ImportError: libXi.so.6: cannot open shared object file: No such file or directory")'
    with pytest.raises(EnvironmentSetupError, match="libxi6"):
        _run(tmp_path, body)


def test_silence_ends_the_process_and_its_children(tmp_path: Path) -> None:
    body = f"""
        child = subprocess.Popen([{sys.executable!r}, "-c", "import time; time.sleep(600)"])
        open({str(tmp_path / "pids")!r}, "w").write(f"{{os.getpid()}} {{child.pid}}")
        print("not an event", flush=True)
        time.sleep(600)
        """
    with pytest.raises(BlenderError, match="no progress for 2 s"):
        _run(tmp_path, body, timeout_s=2.0)
    for pid in (tmp_path / "pids").read_text().split():
        _wait_until_gone(int(pid))


def test_events_keep_a_slow_process_alive(tmp_path: Path) -> None:
    body = """
        for k in range(12):
            time.sleep(0.25)
            print(json.dumps({"event": "tick", "k": k}), flush=True)
        """
    # Silent for an eighth of the time allowed at a time, and longer than it on the whole.
    assert len(_run(tmp_path, body, timeout_s=2.0)) == 12


def test_interrupt_ends_the_process(tmp_path: Path) -> None:
    script = tmp_path / "fake.py"
    script.write_text(
        'import json, os, time\nprint(json.dumps({"event": "pid", "pid": os.getpid()}), flush=True)\ntime.sleep(60)\n'
    )
    pids: list[int] = []

    def interrupt(event: Event) -> None:
        pids.append(event["pid"])
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_script(script, tmp_path / "job", blender=None, scratch=tmp_path, silence_timeout_s=20.0, on_event=interrupt)
    _wait_until_gone(pids[0])


def test_parent_that_is_killed_while_blender_is_loaded_leaves_no_worker(tmp_path: Path) -> None:
    script = tmp_path / "slow_to_load.py"
    script.write_text(
        f"""
import sys, time
from pathlib import Path
sys.path.insert(0, {str(SCRIPT_FOLDER.parent)!r})
from blender_scripts.worker.link import Worker
here = Path(__file__).parent
(here / "loading").touch()
while not (here / "loaded").exists():
    time.sleep(0.02)
worker = Worker()
(here / "working").touch()
worker.emit("done")
"""
    )
    call = f"""
from pathlib import Path
from perpetua.machine.blender import run_script
script = Path({str(script)!r})
run_script(script, script, blender=None, scratch=script.parent, silence_timeout_s=60.0, on_event=print)
"""
    for killed in (True, False):
        for mark in ("loading", "loaded", "working"):
            (tmp_path / mark).unlink(missing_ok=True)
        parent = subprocess.Popen([sys.executable, "-c", call], stdout=subprocess.DEVNULL)
        wait_for((tmp_path / "loading").exists, "Blender to be loading")
        child = int(Path(f"/proc/{parent.pid}/task/{parent.pid}/children").read_text())
        if killed:
            parent.kill()
            parent.wait()
        (tmp_path / "loaded").touch()
        _wait_until_gone(child)
        assert parent.wait(timeout=120) == (-signal.SIGKILL if killed else 0)
        assert (tmp_path / "working").exists() is not killed


def test_a_blender_program_gets_the_job_after_two_dashes(tmp_path: Path) -> None:
    program = tmp_path / "blender"
    program.write_text(
        f'#!{sys.executable}\nimport json, sys\nprint(json.dumps({{"event": "e", "argv": sys.argv[1:]}}))\n'
    )
    program.chmod(0o755)
    (event,) = _run(tmp_path, "", blender=str(program))
    assert event["argv"][:3] == ["-b", "--factory-startup", "--disable-autoexec"]
    assert event["argv"][-4:] == ["-P", str(tmp_path / "fake.py"), "--", str(tmp_path / "job.json")]


def test_unknown_program_is_named(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"render\.blender.*no-such-blender"):
        _run(tmp_path, "", blender="no-such-blender")
