# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the images of a render job one by one, each for itself, and says what each costs: for benchmarks.

    python plain_loop.py job.json

This is the plain way: open the room, loop over frames and views, move the actors, render. The job holds

- ``render_job``: a job.json as the render worker gets it, for actors, cameras and settings;
- ``blend_path``: the room;
- ``persistent``: whether Cycles keeps its scene between images;
- ``sampling``: "blender" for Blender's own settings, "every" for those without adaptive sampling, "ours" for the render
  worker's;
- ``denoise``, and ``exposure_ev`` (None: metered);
- ``images``: a list of ``frame``, ``camera``, ``samples``, ``seed``, ``border_px`` (left, top, right, bottom; None: the
  whole image) and ``stem`` of the files written beside the job: .png as displayed, and .exr with all passes, linear:
  with ``denoise`` also what it was before denoising.

Events: ``opened``, ``exposure``; ``image`` with CPU and wall seconds; ``done`` with the peak of memory.
"""

import resource
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np

from blender_scripts.render import auto_exposure, cycles_settings, opencv_cameras
from blender_scripts.render.actor_scene import add_actors, pose_all
from blender_scripts.render.room_scene import load_room
from blender_scripts.worker.job_arrays import JobArrays
from blender_scripts.worker.link import Worker, read_job


class PlainLoop:
    """The open scene of a job."""

    def __init__(self, worker: Worker, job: dict, folder: Path) -> None:
        self._worker, self._job, self._folder = worker, job, folder
        source = Path(job["render_job"])
        settings = read_job(source)
        arrays = JobArrays(source.parent)
        load_room(settings["room"], job["blend_path"], arrays)
        self._actors = add_actors(settings["actors"], arrays)
        self._camera = opencv_cameras.add_camera("camera")
        self._views = {
            view["camera"]: (view["intrinsics"], arrays.load(view["world_from_camera"])) for view in settings["cameras"]
        }
        self._configure(settings)

    def _configure(self, settings: dict) -> None:
        scene = bpy.context.scene
        if self._job["sampling"] == "ours":
            cycles_settings.configure(scene, "cpu", settings["settings"])
        else:
            scene.render.engine = "CYCLES"
            scene.cycles.device = "CPU"
            use_blenders_sampling(scene.cycles)
            scene.cycles.use_adaptive_sampling = self._job["sampling"] == "blender"
        scene.cycles.use_denoising = self._job["denoise"]
        scene.view_layers[0].cycles.denoising_store_passes = self._job["denoise"]
        scene.render.use_persistent_data = self._job["persistent"]
        view = scene.view_settings
        view.view_transform, view.look = settings["settings"]["view_transform"], settings["settings"]["look"]
        layer = scene.view_layers[0]
        layer.use_pass_z = layer.use_pass_object_index = True
        scene.render.use_compositing = False

    def set_exposure(self) -> None:
        """The job's exposure, or one metered on its first image."""
        exposure_ev = self._job["exposure_ev"]
        if exposure_ev is None:
            image = self._job["images"][0]
            self._aim(image["frame"], image["camera"])
            exposure_ev = auto_exposure.exposure_ev(auto_exposure.TestRender(bpy.context.scene, self._folder).pixels())
        bpy.context.scene.view_settings.exposure = exposure_ev
        self._worker.emit("exposure", exposure_ev=exposure_ev)

    def render(self, image: dict) -> None:
        """Renders and writes one image."""
        wall_s, cpu_s = time.monotonic(), used_cpu_s()
        scene = bpy.context.scene
        pose_all(self._actors, image["frame"])
        self._aim(image["frame"], image["camera"])
        set_border(image["border_px"])
        scene.cycles.samples = image["samples"]
        scene.cycles.seed = image["seed"]
        bpy.ops.render.render(write_still=False)
        result, output = bpy.data.images["Render Result"], scene.render.image_settings
        output.file_format, output.color_mode = "PNG", "RGB"
        result.save_render(str(self._folder / f"{image['stem']}.png"))
        wall_s, cpu_s = time.monotonic() - wall_s, used_cpu_s() - cpu_s
        output.file_format, output.color_depth = "OPEN_EXR_MULTILAYER", "32"
        result.save_render(str(self._folder / f"{image['stem']}.exr"))
        self._worker.emit("image", stem=image["stem"], cpu_s=cpu_s, wall_s=wall_s)

    def _aim(self, frame: int, camera: int) -> None:
        intrinsics, world_from_camera = self._views[camera]
        opencv_cameras.set_intrinsics(bpy.context.scene, self._camera, intrinsics)
        opencv_cameras.place(self._camera, np.asarray(world_from_camera[frame]))


def use_blenders_sampling(cycles: bpy.types.bpy_struct) -> None:
    """Every setting of Cycles that its panel has, as Blender would have it in a new file."""
    for name, setting in cycles.bl_rna.properties.items():
        if not setting.is_readonly and name != "device":
            cycles.property_unset(name)


def set_border(border_px: list[int] | None) -> None:
    """Limits the next render to pixels left, top, right, bottom (the last two exclusive), and crops to them."""
    render = bpy.context.scene.render
    render.use_border = render.use_crop_to_border = border_px is not None
    if border_px is not None:
        left, top, right, bottom = border_px
        render.border_min_x, render.border_max_x = left / render.resolution_x, right / render.resolution_x
        render.border_min_y = 1.0 - bottom / render.resolution_y
        render.border_max_y = 1.0 - top / render.resolution_y


def used_cpu_s() -> float:
    """CPU seconds of this process so far."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Renders what the job names."""
    worker = Worker()
    path = worker.job_path()
    loop = PlainLoop(worker, read_job(path), path.parent)
    worker.emit("opened", cpu_s=used_cpu_s())
    loop.set_exposure()
    for image in read_job(path)["images"]:
        worker.check_parent()
        loop.render(image)
    worker.emit("done", peak_mb=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)


if __name__ == "__main__":
    main()
