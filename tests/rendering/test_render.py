"""The parent's side of rendering, with workers that need no Blender: resume, restarts, damage, changed jobs."""

import json
import logging
import textwrap
from pathlib import Path

import numpy as np
import pytest

from perpetua.errors import RenderError
from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.pinhole import Intrinsics
from perpetua.machine.devices import SHARE_VARIABLE
from perpetua.rendering.config import RenderConfig
from perpetua.rendering.frames import drop_damaged, frame_folder
from perpetua.rendering.render import render_views
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Material, Room, SceneObject
from perpetua.scene.scene import RenderedView

WIDTH_PX, HEIGHT_PX, FRAMES = 8, 6, 4

FAKE_WORKER = """
import hashlib, json, os, pathlib, sys, time
import numpy as np, OpenEXR
folder = pathlib.Path(sys.argv[1]).parent
job = json.loads((folder / "job.json").read_text())
tries = len(list(folder.glob("try_*")))
(folder / f"try_{tries}").touch()
def emit(**event): print(json.dumps(event), flush=True)
def write(frame):
    final = folder / "frames" / f"{frame:06d}"
    temporary = folder / "frames" / f"{frame:06d}.tmp"
    temporary.mkdir(parents=True)
    files = {}
    for camera in job["cameras"]:
        stem = f"view_{camera['camera']:02d}"
        depth = np.full((HEIGHT, WIDTH), 1.0 + frame + 10 * camera["camera"], np.float32)
        index = np.full((HEIGHT, WIDTH), 1.0, np.float32)
        depth[0, 0], index[0, 0] = 1e10, 0.0
        depth[0, 1], index[0, 1] = 3.0, 0.0
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        OpenEXR.File(header, {"depth.V": depth, "index.V": index}).write(str(temporary / (stem + ".exr")))
        (temporary / (stem + ".jpg")).write_bytes(b"jpeg %d of try %d" % (frame, tries))
        for path in (temporary / (stem + ".exr"), temporary / (stem + ".jpg")):
            content = path.read_bytes()
            files[path.name] = {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    (temporary / "frame.json").write_text(json.dumps({"files": files}))
    temporary.rename(final)
    emit(event="frame", frame=frame, seconds=0.5)
emit(event="device", backend="cpu", device="2 threads", warning=None)
for frame in json.loads((folder / "pending.json").read_text())["frames"]:
    FAULT
    write(frame)
""".replace("HEIGHT", str(HEIGHT_PX)).replace("WIDTH", str(WIDTH_PX))


def _worker(tmp_path: Path, fault: str = "pass") -> Path:
    script = tmp_path / "worker.py"
    script.write_text(FAKE_WORKER.replace("FAULT", fault))
    return script


def _room() -> Room:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    mesh = TriMesh(np.column_stack([square, np.zeros(4)]), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    floor = SceneObject(1, "floor", "floor", mesh, Material("grey", (0.5, 0.5, 0.5)), True, True)
    return Room("room", "kitchen", square, 2.5, (floor,), (), None)


def _cameras(count: int = 2) -> tuple[CameraPath, ...]:
    intrinsics = Intrinsics.centred(WIDTH_PX, HEIGHT_PX, 1.0)
    return tuple(CameraPath(k, np.tile(np.eye(4), (FRAMES, 1, 1)), intrinsics) for k in range(count))


def _render(
    work_dir: Path, script: Path, config: RenderConfig, seen: list[tuple[int, int, float]]
) -> tuple[RenderedView, ...]:
    return render_views(
        _room(), (), _cameras(), config, "cpu", work_dir, lambda *progress: seen.append(progress), script=script
    )


@pytest.fixture
def config() -> RenderConfig:
    return RenderConfig(width_px=16, height_px=16, max_restarts=2, frame_timeout_s=5.0)


def test_arrays_hold_depth_and_index_of_every_frame(tmp_path: Path, config: RenderConfig) -> None:
    seen: list[tuple[int, int, float]] = []
    views = _render(tmp_path / "work", _worker(tmp_path), config, seen)
    assert seen == [(k + 1, FRAMES, 0.5) for k in range(FRAMES)]
    for camera, view in enumerate(views):
        expected_m = np.broadcast_to(np.arange(1.0, FRAMES + 1)[:, None, None] + 10 * camera, view.depth_m.shape).copy()
        expected_m[:, 0, :2] = 0.0
        np.testing.assert_array_equal(view.depth_m, expected_m)
        np.testing.assert_array_equal(view.object_index, expected_m > 0)
        assert view.jpeg == tuple(b"jpeg %d of try 0" % frame for frame in range(FRAMES))


def test_finished_frames_are_kept_after_a_crash(tmp_path: Path, config: RenderConfig) -> None:
    seen: list[tuple[int, int, float]] = []
    script = _worker(tmp_path, "if frame == 2 and tries == 0: sys.exit('broken pipe of luck')")
    views = _render(tmp_path / "work", script, config, seen)
    assert [jpeg[-1:] for jpeg in views[0].jpeg] == [b"0", b"0", b"1", b"1"]
    assert [done for done, _, _ in seen] == [1, 2, 3, 4]


def test_a_hang_is_ended_and_the_frame_tried_again(tmp_path: Path, config: RenderConfig) -> None:
    # Shorter than the schema allows, to keep the test short.
    impatient = config.model_copy(update={"frame_timeout_s": 8.0})
    script = _worker(tmp_path, "if frame == 1 and tries == 0: time.sleep(60)")
    views = _render(tmp_path / "work", script, impatient, [])
    assert [jpeg[-1:] for jpeg in views[1].jpeg] == [b"0", b"1", b"1", b"1"]


def test_restarts_are_limited_and_the_error_says_why(tmp_path: Path, config: RenderConfig) -> None:
    script = _worker(tmp_path, "if frame == 1: sys.exit('device is on fire')")
    with pytest.raises(RenderError, match=r"frame 1 \(1 of 4 .* after 2 restarts: .*exit code 1") as error:
        _render(tmp_path / "work", script, config, [])
    assert "device is on fire" in str(error.value)
    assert len(list((tmp_path / "work").glob("try_*"))) == 3


def test_each_new_frame_renews_the_restarts(tmp_path: Path, config: RenderConfig) -> None:
    """Blender that dies once a frame gets through a job of more frames than restarts."""
    script = _worker(tmp_path, "if frame == tries: sys.exit('again')")
    views = _render(tmp_path / "work", script, config.model_copy(update={"max_restarts": 1}), [])
    assert len(views[0].jpeg) == FRAMES == 4
    assert len(list((tmp_path / "work").glob("try_*"))) == FRAMES + 1


def test_memory_that_runs_out_is_named_with_a_remedy(tmp_path: Path, config: RenderConfig) -> None:
    script = _worker(tmp_path, "raise MemoryError('of all memory')")
    with pytest.raises(RenderError, match=r"memory ran out; lower --workers, render\.width_px"):
        _render(tmp_path / "work", script, config, [])


def test_a_gpu_whose_memory_runs_out_gives_way_to_the_cpu(
    tmp_path: Path, config: RenderConfig, caplog: pytest.LogCaptureFixture
) -> None:
    fault = "if frame == 2 and job['device'] != 'cpu': sys.exit('Error: System is out of GPU and shared host memory')"
    with caplog.at_level(logging.WARNING):
        views = render_views(
            _room(), (), _cameras(), config, "cuda", tmp_path / "work", lambda *_: None, script=_worker(tmp_path, fault)
        )
    assert [jpeg[-1:] for jpeg in views[0].jpeg] == [b"0", b"0", b"1", b"1"]
    assert "going on with the CPU" in caplog.text


def test_each_worker_process_is_told_its_share(
    tmp_path: Path, config: RenderConfig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(SHARE_VARIABLE, "1/2")
    monkeypatch.setattr("perpetua.machine.devices.usable_cores", lambda: 6)
    _render(tmp_path / "work", _worker(tmp_path), config, [])
    job = json.loads((tmp_path / "work" / "job.json").read_text())
    assert (job["worker"], job["workers"], job["threads"]) == (1, 2, 3)


def test_a_worker_that_ends_well_without_its_frames_is_a_failure(tmp_path: Path, config: RenderConfig) -> None:
    with pytest.raises(RenderError, match="frames are missing"):
        _render(tmp_path / "work", _worker(tmp_path, "break"), config, [])


def test_a_second_call_renders_nothing(tmp_path: Path, config: RenderConfig) -> None:
    first = _render(tmp_path / "work", _worker(tmp_path), config, [])
    seen: list[tuple[int, int, float]] = []
    second = _render(tmp_path / "work", _worker(tmp_path, "sys.exit(1)"), config, seen)
    assert seen == []
    assert first[0].jpeg == second[0].jpeg


@pytest.mark.parametrize("damage", ["truncate", "flip", "delete", "manifest", "list"])
def test_damaged_frames_are_found_and_removed(tmp_path: Path, config: RenderConfig, damage: str) -> None:
    _render(tmp_path / "work", _worker(tmp_path), config, [])
    frames = tmp_path / "work" / "frames"
    folder = frame_folder(frames, 2)
    exr = folder / "view_01.exr"
    content = bytearray(exr.read_bytes())
    match damage:
        case "truncate":
            exr.write_bytes(content[:-5])
        case "flip":
            content[-3] ^= 1
            exr.write_bytes(content)
        case "delete":
            (folder / "view_00.jpg").unlink()
        case "manifest":
            (folder / "frame.json").write_text('{"files": {')
        case "list":
            (folder / "frame.json").write_text("[]")
    assert drop_damaged(frames, _cameras(), FRAMES) == [2]
    assert not folder.exists()
    views = _render(tmp_path / "work", _worker(tmp_path), config, [])
    assert [jpeg[-1:] for jpeg in views[0].jpeg] == [b"0", b"0", b"1", b"0"]


GARBAGE = """
    made = write
    def write(frame):
        made(frame)
        if frame == 1 and tries < BAD_TRIES:
            path = folder / "frames" / f"{frame:06d}" / "view_00.exr"
            path.write_bytes(CONTENT)
            record = json.loads((path.parent / "frame.json").read_text())
            digest = hashlib.sha256(path.read_bytes()).hexdigest()
            record["files"][path.name] = {"bytes": path.stat().st_size, "sha256": digest}
            (path.parent / "frame.json").write_text(json.dumps(record))
"""


def _garbage_worker(tmp_path: Path, content: str, bad_tries: int) -> Path:
    """Writes a file that matches its fingerprint and still is no picture: a fault of Blender's, not of the disk."""
    script = _worker(tmp_path)
    garbage = textwrap.dedent(GARBAGE).replace("CONTENT", content).replace("BAD_TRIES", str(bad_tries))
    before, loop, after = script.read_text().rpartition("for frame in json")
    script.write_text(before + garbage + loop + after)
    return script


@pytest.mark.parametrize("content", ["b''", "b'\\x76\\x2f\\x31\\x01' + bytes(50)", "path.read_bytes()[:-40]"])
def test_garbage_is_rendered_again(tmp_path: Path, config: RenderConfig, content: str) -> None:
    views = _render(tmp_path / "work", _garbage_worker(tmp_path, content, 1), config, [])
    assert [jpeg[-1:] for jpeg in views[0].jpeg] == [b"0", b"1", b"0", b"0"]


def test_garbage_without_end_is_an_error_that_leaves_the_other_frames(tmp_path: Path, config: RenderConfig) -> None:
    with pytest.raises(RenderError, match=r"view_00\.exr' must be an EXR"):
        _render(tmp_path / "work", _garbage_worker(tmp_path, "b''", 99), config, [])
    assert len(list((tmp_path / "work").glob("try_*"))) == config.max_restarts + 1
    views = _render(tmp_path / "work", _worker(tmp_path), config, [])
    assert [jpeg[-1:] for jpeg in views[0].jpeg] == [b"0", b"3", b"0", b"0"]


def test_another_job_discards_frames_but_another_time_out_does_not(tmp_path: Path, config: RenderConfig) -> None:
    work_dir = tmp_path / "work"
    _render(work_dir, _worker(tmp_path), config, [])
    kept = _render(work_dir, _worker(tmp_path), config.model_copy(update={"frame_timeout_s": 99.0}), [])
    assert kept[0].jpeg[0] == b"jpeg 0 of try 0"
    changed = _render(work_dir, _worker(tmp_path), config.model_copy(update={"samples": 77}), [])
    assert changed[0].jpeg[0] == b"jpeg 0 of try 1"


def test_lengths_and_indices_are_checked(tmp_path: Path, config: RenderConfig) -> None:
    def actor(frames: int, object_index: int) -> ActorMesh:
        return ActorMesh(0, object_index, "nobody", (), np.zeros((frames, 3, 3), np.float32))

    def render(actors: tuple[ActorMesh, ...], device: str = "cpu") -> None:
        render_views(_room(), actors, _cameras(), config, device, tmp_path, lambda *_: None)

    with pytest.raises(RenderError, match="4 frames; actor 0 has 3"):
        render((actor(3, 2),))
    with pytest.raises(RenderError, match="unique"):
        render((actor(4, 1),))
    with pytest.raises(RenderError, match="65535"):
        render((actor(4, 65536),))
    with pytest.raises(RenderError, match=r"device must be one of .*not 'tpu'"):
        render((actor(4, 2),), "tpu")
