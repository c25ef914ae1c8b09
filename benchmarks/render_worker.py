"""What the render worker costs beside Cycles' own sampling, how cost grows, and what kills do to a job.

    perpetua generate --preset quick --seed 3 --until cameras --out plans
    python benchmarks/render_worker.py overhead plans/.work/seed3-room0000 --width 192 --samples 24
    python benchmarks/render_worker.py growth plans/.work/seed3-room0000
    python benchmarks/render_worker.py threads plans/.work/seed3-room0000
    python benchmarks/render_worker.py kills plans/.work/seed3-room0000 --width 64 --samples 4 --frames 12

``overhead`` and ``growth`` count CPU seconds, which other work on the machine hardly changes; ``threads`` needs the
machine to itself. A baked room is kept in the scratch folder (``--scratch``) for the next call.
"""

import argparse
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import threading
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from perpetua.io.files import write_json
from perpetua.machine.blender import script_command, script_environment
from perpetua.pipeline.codec import load
from perpetua.rendering.bake import bake_room
from perpetua.rendering.config import RenderConfig
from perpetua.rendering.job import EXPOSURE_FILE, PENDING_FILE, RENDER_SCRIPT, write_job
from perpetua.rendering.render import render_views
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room
from perpetua.scene.scene import RenderedView

# A sequence's length, over which starting Blender and metering are spread.
SEQUENCE_FRAMES = 240
KILLS = 10


@dataclass(frozen=True)
class Scene:
    """What is rendered."""

    room: Room
    actors: tuple[ActorMesh, ...]
    cameras: tuple[CameraPath, ...]

    def cut(self, frames: int, views: int) -> "Scene":
        """The first frames and views; a sequence that is shorter starts again."""
        chosen = np.arange(frames) % len(self.cameras[0].world_from_camera)
        return Scene(
            self.room,
            tuple(replace(actor, vertices_m=actor.vertices_m[chosen]) for actor in self.actors),
            tuple(replace(one, world_from_camera=one.world_from_camera[chosen]) for one in self.cameras[:views]),
        )


def main() -> None:
    """Runs one measurement and prints its table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("overhead", "growth", "threads", "kills"))
    parser.add_argument("work", type=Path, help="work area of one room, finished up to its cameras")
    parser.add_argument("--width", type=int, default=192)
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--frames", type=int, default=2)
    parser.add_argument("--blend", type=Path, default=None, help="a room that is baked already")
    parser.add_argument("--scratch", type=Path, default=Path("render_worker"))
    given = parser.parse_args()
    config = RenderConfig(width_px=given.width, height_px=given.width, samples=given.samples)
    given.scratch.mkdir(parents=True, exist_ok=True)
    scene = load_scene(given.work, config, given.blend, given.scratch)
    {"overhead": overhead, "growth": growth, "threads": threads, "kills": kills}[given.what](scene, config, given)


def load_scene(work: Path, config: RenderConfig, blend: Path | None, scratch: Path) -> Scene:
    """The room, baked, with actors and with cameras for square images of the config's width."""
    room, actors, cameras = (load(work / name) for name in ("10_room", "50_actors", "60_cameras"))
    cameras = tuple(_resized(camera, config.width_px) for camera in cameras)
    if blend is None and room.blend_path is not None:
        blend = bake_room(room, cameras, config, 4 * SEQUENCE_FRAMES, scratch)
    if blend is not None:
        room = replace(room, blend_path=blend)
    return Scene(room, actors, cameras)


def _resized(camera: CameraPath, width_px: int) -> CameraPath:
    old = camera.intrinsics
    fraction = width_px / old.width_px
    middle_px = 0.5 * (width_px - 1)
    new = replace(
        old,
        fx_px=old.fx_px * fraction,
        fy_px=old.fy_px * fraction,
        cx_px=middle_px,
        cy_px=middle_px,
        width_px=width_px,
        height_px=width_px,
    )
    return replace(camera, intrinsics=new)


@dataclass(frozen=True)
class Moment:
    """A line that Blender wrote, and the worker's CPU seconds and the clock when it came."""

    cpu_s: float
    wall_s: float
    text: str


def watch_worker(
    scene: Scene, config: RenderConfig, folder: Path, device: str = "cpu", meter: bool = True
) -> tuple[list[Moment], float]:
    """Runs the worker on a whole job: every line it writes, with time stamps, and its peak memory in MB.

    ``meter`` False: with an exposure that is given, as metering looks at up to three frames.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    job = write_job(folder, scene.room, scene.actors, scene.cameras, config, device, {})
    write_json(folder / PENDING_FILE, {"frames": list(range(len(scene.cameras[0].world_from_camera)))})
    if not meter:
        write_json(folder / EXPOSURE_FILE, {"exposure_ev": 0.0, "gains": [1.0, 1.0, 1.0]})
    pipe = subprocess.PIPE
    command, environment = script_command(RENDER_SCRIPT, job, None), script_environment(folder)
    process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, env=environment)
    assert process.stdout is not None
    moments, peak_mb = [], 0.0
    for line in process.stdout:
        moments.append(Moment(_cpu_s(process.pid), time.monotonic(), line.decode("utf-8", "replace").strip()))
        if '"event"' in moments[-1].text:
            peak_mb = max(peak_mb, _peak_mb(process.pid))
    if process.wait() != 0:
        raise SystemExit("\n".join(moment.text for moment in moments[-12:]))
    return moments, peak_mb


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _peak_mb(pid: int) -> float:
    found = re.search(r"VmHWM:\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text(encoding="utf-8"))
    return int(found[1]) / 1024.0 if found else 0.0


def phase_of(text: str) -> str:
    """What Blender does after it wrote a line."""
    rules = (
        (r"\| Sample \d+/\d+", "sampling, denoising"),
        (r"Synchronizing|Initializing|Updating|Waiting|Loading render", "loading into Cycles"),
        (r"Compositing|\| Finished|^Saved", "compositing, files"),
        (r'"event": "(view|frame|ready|metered|device)"', "Blender and Python before"),
    )
    return next((name for pattern, name in rules if re.search(pattern, text)), "compositing, files")


def overhead(scene: Scene, config: RenderConfig, given: argparse.Namespace) -> None:
    """CPU seconds outside Cycles' sampling and denoising, by kind."""
    moments, peak_mb = watch_worker(scene.cut(given.frames, 4), config, given.scratch / "overhead")
    ready = next(number for number, moment in enumerate(moments) if '"ready"' in moment.text)
    start_s = moments[ready].cpu_s
    spent: dict[str, float] = defaultdict(float)
    for one, following in zip(moments[ready:], moments[ready + 1 :], strict=False):
        spent[phase_of(one.text)] += following.cpu_s - one.cpu_s
    frame_s = sum(spent.values()) / given.frames
    print(f"load {os.getloadavg()[0]:.1f}; {config.width_px} px, {config.samples} samples, 4 views a frame")
    for name, seconds in sorted(spent.items(), key=lambda item: -item[1]):
        print(f"{name:<28}{seconds / given.frames:9.2f} CPU s per frame {100 * seconds / given.frames / frame_s:6.1f}%")
    outside_s = frame_s - spent["sampling, denoising"] / given.frames
    whole_s = frame_s + start_s / SEQUENCE_FRAMES
    print(f"{'start and metering, once':<28}{start_s:9.2f} CPU s")
    print(f"outside of sampling and denoising: {100 * outside_s / frame_s:.1f}% of a frame,")
    print(f"{100 * (outside_s + start_s / SEQUENCE_FRAMES) / whole_s:.1f}% of {SEQUENCE_FRAMES} frames with the start")
    print(f"peak memory {peak_mb:.0f} MB")


def growth(scene: Scene, config: RenderConfig, given: argparse.Namespace) -> None:
    """CPU seconds against frames and views, each in a process of its own."""
    costs: dict[tuple[int, int], float] = {}
    for frames, views in ((1, 1), (1, 2), (1, 4), (2, 4), (4, 4)):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        watch_worker(scene.cut(frames, views), config, given.scratch / "growth", meter=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        costs[frames, views] = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        print(f"{frames} frames x {views} views: {costs[frames, views]:8.2f} CPU s", flush=True)
    print(f"the second frame of 4 views: {costs[2, 4] - costs[1, 4]:.2f} CPU s")
    print(f"the third and fourth, each: {(costs[4, 4] - costs[2, 4]) / 2:.2f} CPU s")
    print(f"4 views of a frame against one view in its own process: {costs[1, 4] / costs[1, 1]:.2f} times")


def threads(scene: Scene, config: RenderConfig, given: argparse.Namespace) -> None:
    """Frames per second of the whole machine: one worker with all cores against workers with fewer each."""
    cores = len(os.sched_getaffinity(0))
    workers = 1
    while workers <= cores:
        one = config.model_copy(update={"threads": max(1, cores // workers)})
        started, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
        running = [
            threading.Thread(target=watch_worker, args=(scene.cut(given.frames, 4), one, given.scratch / f"worker_{k}"))
            for k in range(workers)
        ]
        for thread in running:
            thread.start()
        for thread in running:
            thread.join()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        wall_s = time.monotonic() - started
        cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        frames = workers * given.frames
        print(
            f"{workers} workers x {one.threads} threads: {3600 * frames / wall_s:8.1f} frames an hour, "
            f"{cpu_s / frames:.2f} CPU s a frame (load {os.getloadavg()[0]:.1f})",
            flush=True,
        )
        workers *= 2


def kills(scene: Scene, config: RenderConfig, given: argparse.Namespace) -> None:
    """Kills Blender ten times at random moments of one job; the result must be the undisturbed one bit for bit.

    ``--frames`` above 10: each kill but the last falls into the time of another frame.
    """
    scene = scene.cut(given.frames, 4)
    calm = _render(scene, config, given.scratch / "calm", iter(()))
    draw = random.Random(7)
    delays = iter([draw.uniform(0.0, 1.0) for _ in range(KILLS)])
    killed = _render(scene, config, given.scratch / "killed", delays)
    left = len(list(delays))
    same = all(
        one.jpeg == other.jpeg
        and np.array_equal(one.depth_m, other.depth_m)
        and np.array_equal(one.object_index, other.object_index)
        for one, other in zip(calm, killed, strict=True)
    )
    print(f"{KILLS - left} kills in a job of {given.frames} frames: {'identical' if same else 'DIFFERENT'}")


def _render(scene: Scene, config: RenderConfig, folder: Path, delays: Iterator[float]) -> tuple[RenderedView, ...]:
    """Renders a job; after each frame Blender is killed once more, the next delay (as a share of the frame) later."""
    shutil.rmtree(folder, ignore_errors=True)

    def on_frame(done: int, total: int, seconds: float) -> None:
        fraction = next(delays, None)
        if fraction is not None:
            threading.Timer(fraction * seconds, _kill_children).start()

    unbaked = config.model_copy(update={"bake": False})
    return render_views(scene.room, scene.actors, scene.cameras, unbaked, "cpu", folder, on_frame)


def _kill_children() -> None:
    for task in Path("/proc/self/task").glob("*/children"):
        for pid in task.read_text(encoding="utf-8").split():
            os.kill(int(pid), signal.SIGKILL)


if __name__ == "__main__":
    main()
