# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' settings and its device."""

import bpy

from blender_scripts.render.gpu_choice import enable_gpus

# Above this radiance a sample is cut: one lucky path to a lamp must not leave a white dot. 0: never.
CLAMP_DIRECT = 0.0


def choose_device(wanted: str, worker: int, workers: int) -> tuple[str, str, str | None]:
    """What Cycles shall render on: a backend's name, what it is, and a warning where the wish was not met."""
    if wanted == "cpu":
        return "cpu", _threads(), None
    enabled = enable_gpus(bpy.context.preferences.addons["cycles"].preferences, wanted, worker, workers)
    if enabled is not None:
        backend, names = enabled
        return backend, ", ".join(names), None
    warning = None if wanted == "auto" else f"no {wanted} device that Cycles can use was found: rendering on the CPU"
    return "cpu", _threads(), warning


def _threads() -> str:
    return f"{bpy.context.scene.render.threads} threads"


def set_threads(scene: bpy.types.Scene, threads: int) -> None:
    """Threads on the CPU; 0: all."""
    scene.render.threads_mode = "FIXED" if threads else "AUTO"
    if threads:
        scene.render.threads = threads


def configure(scene: bpy.types.Scene, backend: str, settings: dict) -> None:
    """Cycles with the job's sampling and denoising, and without motion blur and depth of field."""
    render = scene.render
    render.engine = "CYCLES"
    scene.cycles.device = "CPU" if backend == "cpu" else "GPU"
    render.use_persistent_data = True
    render.use_motion_blur = False
    render.film_transparent = False
    render.resolution_percentage = 100
    render.use_border = render.use_multiview = render.use_sequencer = False
    render.use_simplify = False
    _configure_sampling(scene.cycles, settings)
    _configure_denoiser(scene.cycles, settings)


def blur_motion(scene: bpy.types.Scene, shutter: float) -> None:
    """Exposes for a share of a frame's time, around the frame."""
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = shutter
    scene.render.motion_blur_position = "CENTER"
    scene.cycles.rolling_shutter_type = "NONE"


def configure_truth(scene: bpy.types.Scene, backend: str, settings: dict) -> None:
    """Cycles for depth and object index alone: both come from the first sample, at the centre of the pixel."""
    configure(scene, backend, settings)
    scene.cycles.samples = 1
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = 0


def _configure_sampling(cycles: bpy.types.bpy_struct, settings: dict) -> None:
    bounces = settings["max_bounces"]
    cycles.samples = settings["samples"]
    cycles.use_adaptive_sampling = settings["noise_threshold"] > 0.0
    cycles.adaptive_threshold = settings["noise_threshold"]
    # The first samples tell how noisy a pixel is; with fewer, some noise would go unseen.
    cycles.adaptive_min_samples = max(4, settings["samples"] // 4)
    cycles.use_animated_seed = False
    cycles.time_limit = 0.0
    cycles.use_light_tree = settings["light_tree"]
    cycles.use_auto_tile = False
    cycles.max_bounces = bounces
    cycles.diffuse_bounces = bounces
    cycles.glossy_bounces = min(bounces, 4)
    cycles.transmission_bounces = bounces
    cycles.transparent_max_bounces = 8
    cycles.volume_bounces = 0
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.blur_glossy = 1.0
    cycles.sample_clamp_direct, cycles.sample_clamp_indirect = CLAMP_DIRECT, settings["clamp_indirect"]


def _configure_denoiser(cycles: bpy.types.bpy_struct, settings: dict) -> None:
    cycles.use_denoising = settings["denoise"]
    cycles.denoiser = "OPENIMAGEDENOISE"
    cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL"
    cycles.denoising_prefilter = settings["denoise_guides"].upper()
    if hasattr(cycles, "denoising_use_gpu"):
        cycles.denoising_use_gpu = cycles.device == "GPU"
