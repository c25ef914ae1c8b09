# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the frames of a job that are not there yet: all views of a frame, then the next frame.

    python render_frames.py job.json            with the bpy package
    blender -b --factory-startup --disable-autoexec -P render_frames.py -- job.json

The job's folder holds job.json and its arrays; ``frames/000012/`` appears by rename once all views of frame 12 are
on disk: ``view_00.jpg``, ``view_00.exr`` (depth along Z in metres and object index, 32-bit floats), and
``frame.json`` with the size and SHA-256 of each file. Events: ``device``, ``ready``, ``frame``.
"""

import hashlib
import json
import shutil
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import auto_exposure
import bpy
import cycles_settings
import numpy as np
import opencv_cameras
from actor_scene import Actor, add_actors, pose_all
from frame_output import FrameOutput
from job_arrays import JobArrays
from room_scene import load_room
from worker_link import Worker, read_job, write_atomically

METERED_FRAMES = 3


class View:
    """One camera of the job."""

    def __init__(self, settings: dict, arrays: JobArrays) -> None:
        self.number: int = settings["camera"]
        self.near_m: float | None = settings["near_m"]
        self._intrinsics = settings["intrinsics"]
        self._world_from_camera = arrays.load(settings["world_from_camera"])
        self._object = opencv_cameras.add_camera(f"camera_{self.number}", self.near_m)

    def aim(self, frame: int) -> None:
        """Makes the next render one of this view at a frame."""
        opencv_cameras.set_intrinsics(self._object, self._intrinsics)
        opencv_cameras.place(self._object, np.asarray(self._world_from_camera[frame]))


class FrameRenderer:
    """The loaded scene of a job."""

    def __init__(self, worker: Worker, job: dict, folder: Path) -> None:
        self._worker, self._job, self._folder = worker, job, folder
        arrays = JobArrays(folder)
        load_room(job["room"], job["blend_path"], arrays)
        self._actors: list[Actor] = add_actors(job["actors"], arrays)
        self._views = [View(settings, arrays) for settings in job["cameras"]]
        backend, device, warning = cycles_settings.choose_device(job["device"])
        cycles_settings.configure(job["settings"], job["threads"])
        self._output = FrameOutput(job["settings"]["jpeg_quality"])
        worker.emit("device", backend=backend, device=device, warning=warning)

    def set_exposure(self) -> None:
        """The view transform, with the exposure and white balance of this job (metered once)."""
        view = bpy.context.scene.view_settings
        view.view_transform = self._job["settings"]["view_transform"]
        view.look = self._job["settings"]["look"]
        view.gamma = 1.0
        view.use_curve_mapping = False
        path = self._folder / "exposure.json"
        development = auto_exposure.read_stored(path)
        if development is None:
            development = auto_exposure.develop(self._meter(), self._job["settings"]["white_balance"])
            auto_exposure.store(path, development)
        view.exposure = development.exposure_ev
        self._output.set_gains(development.gains)
        self._worker.emit("ready", exposure_ev=development.exposure_ev, gains=development.gains)

    def _meter(self) -> np.ndarray:
        """Linear pixels f32[N, 3] of all views at a few frames; cutaways do not count beside whole views."""
        frames = self._job["frames"]
        views = [view for view in self._views if view.near_m is None] or self._views
        test = auto_exposure.TestRender(self._folder)
        pixels = []
        for frame in sorted({round(k * (frames - 1) / (METERED_FRAMES - 1)) for k in range(METERED_FRAMES)}):
            pose_all(self._actors, frame)
            for view in views:
                view.aim(frame)
                pixels.append(test.pixels())
                self._worker.emit("metered", frame=frame)
        return np.concatenate(pixels)

    def render(self, frame: int) -> None:
        """Renders all views of a frame and puts its folder in place."""
        started = time.monotonic()
        final = self._folder / "frames" / f"{frame:06d}"
        temporary = self._folder / "frames" / f".{frame:06d}.tmp"
        for stale in (temporary, final):
            shutil.rmtree(stale, ignore_errors=True)
        temporary.mkdir(parents=True)
        pose_all(self._actors, frame)
        bpy.context.scene.cycles.seed = frame
        files: dict[str, dict] = {}
        for view in self._views:
            self._worker.check_parent()
            view.aim(frame)
            for path in self._output.render(temporary, f"view_{view.number:02d}"):
                files[path.name] = _fingerprint(path)
            self._worker.emit("view", frame=frame, camera=view.number)
        seconds = time.monotonic() - started
        content = {"frame": frame, "seconds": seconds, "files": files}
        write_atomically(temporary / "frame.json", json.dumps(content).encode())
        temporary.rename(final)
        self._worker.emit("frame", frame=frame, seconds=seconds)


def _fingerprint(path: Path) -> dict:
    content = path.read_bytes()
    return {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}


def main() -> None:
    """Renders what the job names in ``pending``."""
    worker = Worker()
    path = worker.job_path()
    job = read_job(path)
    pending = read_job(path.parent / "pending.json")
    renderer = FrameRenderer(worker, job, path.parent)
    renderer.set_exposure()
    for frame in pending["frames"]:
        renderer.render(frame)
    worker.emit("done")


if __name__ == "__main__":
    main()
