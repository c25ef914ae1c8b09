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

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np

from blender_scripts.render import auto_exposure, cycles_settings, eevee_settings, opencv_cameras
from blender_scripts.render.actor_scene import Actor, add_actors, pose_all
from blender_scripts.render.frame_output import GroundTruth, Picture, empty_tree
from blender_scripts.render.room_scene import load_room
from blender_scripts.worker.job_arrays import JobArrays
from blender_scripts.worker.link import Worker, read_job, write_atomically

METERED_FRAMES = 3
# Blender's frame at which everything is where it belongs; only motion blur looks at its neighbours.
MOMENT = 1


class Cameras:
    """The scene's cameras, which all views share: one that stands still, and one that moves for motion blur."""

    def __init__(self) -> None:
        self.still = opencv_cameras.add_camera("camera")
        self.moving = opencv_cameras.add_camera("moving camera")


class View:
    """One camera of the job."""

    def __init__(self, settings: dict, arrays: JobArrays, cameras: Cameras) -> None:
        self.number: int = settings["camera"]
        self.near_m: float | None = settings["near_m"]
        self._cameras = cameras
        self._intrinsics = settings["intrinsics"]
        self._world_from_camera = arrays.load(settings["world_from_camera"])
        self._gains = arrays.load_optional(settings["gains"])

    @property
    def stem(self) -> str:
        """What the view's files are called."""
        return f"view_{self.number:02d}"

    def aim(self, scene: bpy.types.Scene, frame: int) -> None:
        """Makes the scene's next render one of this view at a frame, at the very pose that the job gives."""
        opencv_cameras.place(self._cameras.still, np.asarray(self._world_from_camera[frame]))
        opencv_cameras.set_intrinsics(scene, self._cameras.still, self._intrinsics, self.near_m)

    def aim_moving(self, scene: bpy.types.Scene, frame: int) -> None:
        """Makes the scene's next render one of this view as it moves past a frame."""
        poses = opencv_cameras.with_neighbours(self._world_from_camera, frame)
        opencv_cameras.move_through(self._cameras.moving, poses, MOMENT)
        opencv_cameras.set_intrinsics(scene, self._cameras.moving, self._intrinsics, self.near_m)

    def gains(self, frame: int, development: auto_exposure.Development) -> tuple[float, float, float]:
        """Factors of red, green and blue from linear light to the picture, the camera's own deviation included."""
        own = 1.0 if self._gains is None else np.asarray(self._gains[frame], np.float64)
        red, green, blue = 2.0**development.exposure_ev * np.array(development.gains) * own
        return float(red), float(green), float(blue)


class FrameRenderer:
    """The loaded scene of a job.

    Pictures and ground truth come from one render, unless the pictures are blurred or drawn by EEVEE: then a second
    scene of the same objects, with a Cycles of its own that keeps its data, renders the ground truth at one sample.
    """

    def __init__(self, worker: Worker, job: dict, folder: Path) -> None:
        self._worker, self._job, self._folder = worker, job, folder
        settings = job["settings"]
        self._blurred: bool = settings["motion_blur"]
        arrays = JobArrays(folder)
        load_room(job["room"], job["blend_path"], arrays)
        self._actors: list[Actor] = add_actors(job["actors"], arrays)
        cameras = Cameras()
        self._views = [View(view, arrays, cameras) for view in job["cameras"]]
        self._scene = bpy.context.scene
        self._scene.frame_set(MOMENT)
        cycles_settings.set_threads(self._scene, job["threads"])
        backend, device, warning = cycles_settings.choose_device(job["device"], job["worker"], job["workers"])
        worker.emit("device", backend=backend, device=device, warning=warning)
        empty_tree(self._scene)
        self._truth_scene = self._set_up_scenes(backend, settings)
        self._truth = GroundTruth(self._truth_scene)
        self._picture = Picture(self._scene, settings)
        self._development: auto_exposure.Development | None = None

    def _set_up_scenes(self, backend: str, settings: dict) -> bpy.types.Scene:
        """Configures the picture's scene and returns the one that renders the ground truth."""
        if settings["engine"] == "cycles" and not self._blurred:
            cycles_settings.configure(self._scene, backend, settings)
            return self._scene
        truth = self._scene.copy()
        empty_tree(truth)
        cycles_settings.configure_truth(truth, backend, settings)
        if settings["engine"] == "eevee":
            eevee_settings.configure(self._scene, settings)
        else:
            cycles_settings.configure(self._scene, backend, settings)
        if self._blurred:
            cycles_settings.blur_motion(self._scene, settings["shutter"])
        return truth

    def set_exposure(self) -> None:
        """The exposure and white balance of this job (metered once)."""
        path = self._folder / "exposure.json"
        development = auto_exposure.read_stored(path)
        if development is None:
            development = auto_exposure.develop(self._meter(), self._job["settings"]["white_balance"])
            auto_exposure.store(path, development)
        self._development = development
        self._worker.emit("ready", exposure_ev=development.exposure_ev, gains=development.gains)

    def _meter(self) -> np.ndarray:
        """Linear pixels f32[N, 3] of all views at a few frames; cutaways do not count beside whole views."""
        frames = self._job["frames"]
        views = [view for view in self._views if view.near_m is None] or self._views
        test = auto_exposure.TestRender(self._scene, self._folder)
        pixels = []
        for frame in sorted({round(k * (frames - 1) / (METERED_FRAMES - 1)) for k in range(METERED_FRAMES)}):
            pose_all(self._actors, frame, self._blurred)
            for view in views:
                self._aim(view, frame)
                pixels.append(test.pixels())
                self._worker.emit("metered", frame=frame)
        return np.concatenate(pixels)

    def _aim(self, view: View, frame: int) -> None:
        if self._blurred:
            view.aim_moving(self._scene, frame)
        else:
            view.aim(self._scene, frame)

    def render(self, frame: int) -> None:
        """Renders all views of a frame and puts its folder in place."""
        started = time.monotonic()
        final = self._folder / "frames" / f"{frame:06d}"
        temporary = self._folder / "frames" / f".{frame:06d}.tmp"
        for stale in (temporary, final):
            shutil.rmtree(stale, ignore_errors=True)
        temporary.mkdir(parents=True)
        pose_all(self._actors, frame, self._blurred)
        self._render_pictures(frame, temporary)
        if self._truth_scene != self._scene:
            self._render_truth(frame, temporary)
        files = {path.name: _fingerprint(path) for path in sorted(temporary.iterdir())}
        seconds = time.monotonic() - started
        content = {"frame": frame, "seconds": seconds, "files": files}
        write_atomically(temporary / "frame.json", json.dumps(content).encode())
        temporary.rename(final)
        self._worker.emit("frame", frame=frame, seconds=seconds)

    def _render_pictures(self, frame: int, folder: Path) -> None:
        """The JPEG of each view, and its EXR where one render makes both."""
        assert self._development is not None
        self._scene.cycles.seed = frame
        for view in self._views:
            self._worker.check_parent()
            self._aim(view, frame)
            noise = np.random.default_rng([self._job["noise_seed"], view.number, frame])
            self._picture.develop_with(view.gains(frame, self._development), noise)
            self._truth.write_to(folder)
            bpy.ops.render.render(write_still=False, scene=self._scene.name)
            self._picture.save(folder / f"{view.stem}.jpg")
            if self._truth_scene == self._scene:
                self._truth.finish(folder, f"{view.stem}.exr")
            self._worker.emit("view", frame=frame, camera=view.number)

    def _render_truth(self, frame: int, folder: Path) -> None:
        """The EXR of each view, after all pictures: from scene to scene Cycles loads everything again."""
        for view in self._views:
            view.aim(self._truth_scene, frame)
            self._truth.write_to(folder)
            bpy.ops.render.render(write_still=False, scene=self._truth_scene.name)
            self._truth.finish(folder, f"{view.stem}.exr")
            self._worker.emit("truth", frame=frame, camera=view.number)


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
