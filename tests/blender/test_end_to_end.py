"""The main job on the tiny preset, through the command line, with real Blender."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from perpetua.config import load_config
from perpetua.pipeline.layout import RoomLayout, RunLayout
from perpetua.pipeline.stages import STAGES
from perpetua.pipeline.store import output_hashes
from tests.support.waiting import wait_for

pytestmark = [pytest.mark.blender, pytest.mark.slow]

SEED, ROOM = 7, 2
ONE_ROOM = ("--preset", "tiny", "--seed", str(SEED), "--start-room", str(ROOM), "--rooms", "1")


def _command(*arguments: str) -> list[str]:
    return [sys.executable, "-c", "from perpetua.cli.app import main; main()", *arguments]


def _perpetua(*arguments: str, code: int = 0) -> str:
    done = subprocess.run(_command(*arguments), capture_output=True, text=True, check=False, timeout=1200)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout


def _layout(out: Path) -> RoomLayout:
    return RunLayout(out, load_config("tiny").export, SEED).room(ROOM)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("finished")
    _perpetua("generate", *ONE_ROOM, "--out", str(out))
    return out


def test_sequence_is_complete_and_passes_verify(finished: Path) -> None:
    config = load_config("tiny")
    sequence = _layout(finished).sequence_folder
    frames, tracks = config.sequence.frames, config.tracks.count
    assert np.load(sequence / "tracks_xyz.npy").shape == (frames, tracks, 3)
    assert sorted(path.name for path in sequence.iterdir() if path.is_dir()) == ["0", "1", "2", "3"]
    for view in range(4):
        depth_m = np.load(sequence / str(view) / "depth.npy")
        assert depth_m.shape == (frames, config.render.height_px, config.render.width_px)
        # What is left is seen through windows.
        assert (depth_m > 0).mean() > 0.6
    reports = json.loads(_perpetua("verify", str(finished), "--json"))
    assert [report["passed"] for report in reports] == [True]


def test_actors_walk_and_cameras_move(finished: Path) -> None:
    sequence = _layout(finished).sequence_folder
    assert any(np.load(sequence / str(view) / "foreground_mask.npy").any() for view in range(4))
    for view in range(4):
        camera_from_world = np.load(sequence / str(view) / "extrinsics_w2c.npy").astype(np.float64)
        centre_m = -np.einsum("tji,tj->ti", camera_from_world[:, :3, :3], camera_from_world[:, :3, 3])
        assert np.linalg.norm(centre_m - centre_m[0], axis=1).max() > 0.05


def test_contact_sheet_and_status(finished: Path) -> None:
    assert _layout(finished).contact_sheet.stat().st_size > 10_000
    status = json.loads(_perpetua("status", str(finished), "--json"))
    assert [room["state"] for room in status["rooms"]] == ["finished"]
    assert set(status["rooms"][0]["seconds"]) == {stage.name for stage in STAGES}


def test_killed_while_rendering_ends_in_the_same_bytes(finished: Path, tmp_path: Path) -> None:
    log = tmp_path / "log.jsonl"
    run = subprocess.Popen(
        _command("generate", *ONE_ROOM, "--out", str(tmp_path)),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    wait_for(lambda: run.poll() is not None or len(_frames_rendered(log)) >= 2, "two frames", most_s=600.0)
    assert run.poll() is None
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    before = _frames_rendered(log)
    _perpetua("generate", *ONE_ROOM, "--out", str(tmp_path))
    after = _frames_rendered(log)[len(before) :]
    assert min(after) > max(before) >= 2
    undisturbed = output_hashes(_layout(finished).sequence_folder)
    assert output_hashes(_layout(tmp_path).sequence_folder) == undisturbed

    _perpetua("clean", str(tmp_path))
    assert not (tmp_path / ".work").exists()
    assert "render ..." not in _perpetua("generate", *ONE_ROOM, "--out", str(tmp_path))
    assert output_hashes(_layout(tmp_path).sequence_folder) == undisturbed


def _frames_rendered(log: Path) -> list[int]:
    if not log.exists():
        return []
    lines = [json.loads(line) for line in log.read_text().splitlines() if line.endswith("}")]
    return [line["frames_done"] for line in lines if line["kind"] == "frame_rendered"]


@pytest.mark.parametrize(
    ("workers", "send", "number"),
    [
        ("1", os.killpg, signal.SIGINT),
        ("2", os.killpg, signal.SIGINT),
        ("2", os.killpg, signal.SIGTERM),
        ("2", os.kill, signal.SIGTERM),
    ],
    ids=["Ctrl-C", "Ctrl-C, workers", "SIGTERM for all processes", "SIGTERM for the command alone"],
)
def test_told_to_stop_it_stops_cleanly_and_says_how_to_go_on(
    tmp_path: Path, workers: str, send: Callable[[int, int], None], number: int
) -> None:
    arguments = ("generate", "--preset", "tiny", "--rooms", "2", "--workers", workers, "--out", str(tmp_path))
    run = subprocess.Popen(
        _command(*arguments),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=_heed_interrupts,
    )
    log = tmp_path / "log.jsonl"
    wait_for(lambda: run.poll() is not None or _a_stage_has_begun(log), "the first stage")
    assert run.poll() is None
    send(run.pid, number)
    out, err = run.communicate(timeout=120)
    assert run.returncode == 130, out + err
    assert "To go on, run the same command again" in out
    assert err == ""
    wait_for(lambda: not _group_lives(run.pid), "the end of every process of the run")


def _a_stage_has_begun(log: Path) -> bool:
    return log.exists() and '"stage_started"' in log.read_text()


def _heed_interrupts() -> None:
    """A job that a script starts in the background, and what it starts, ignore Ctrl-C; the run under test must not."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _group_lives(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


def test_third_of_three_rooms_is_the_room_made_alone(finished: Path, tmp_path: Path) -> None:
    _perpetua(
        "generate", "--preset", "tiny", "--seed", str(SEED), "--rooms", "3", "--workers", "2",
        "--until", "cameras", "--out", str(tmp_path),
    )  # fmt: skip
    for stage in STAGES:
        if stage.name == "render":
            break
        folders = [_layout(out).stage(stage) for out in (finished, tmp_path)]
        alone, among_three = (folder.manifest() for folder in folders)
        assert alone is not None and among_three is not None
        assert alone.outputs == among_three.outputs, stage.name
        assert alone.key == among_three.key
