# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' settings and its device."""

import bpy

# From fast to slow; the first that has a device is taken.
GPU_BACKENDS = ("OPTIX", "CUDA", "HIP", "METAL", "ONEAPI")
# Above this radiance a sample is cut: one lucky path to a lamp must not leave a white dot.
CLAMP_DIRECT = 0.0
CLAMP_INDIRECT = 4.0


def choose_device(wanted: str) -> tuple[str, str, str | None]:
    """Points Cycles at a device: its backend's name, what it is, and a warning where the wish was not met."""
    if wanted == "cpu":
        return _use_cpu(None)
    backends = GPU_BACKENDS if wanted == "auto" else (wanted.upper(),)
    for backend in backends:
        names = _enable_gpu(backend)
        if names:
            bpy.context.scene.cycles.device = "GPU"
            return backend.lower(), ", ".join(names), None
    if wanted == "auto":
        return _use_cpu("no GPU that Cycles can use was found: rendering on the CPU")
    return _use_cpu(f"no {wanted} device that Cycles can use was found: rendering on the CPU")


def _use_cpu(warning: str | None) -> tuple[str, str, str | None]:
    bpy.context.scene.cycles.device = "CPU"
    return "cpu", f"{bpy.context.scene.render.threads} threads", warning


def _enable_gpu(backend: str) -> list[str]:
    """Enables all devices of a backend; none where this build or machine has none."""
    preferences = bpy.context.preferences.addons["cycles"].preferences
    try:
        preferences.compute_device_type = backend
    except TypeError:
        return []
    preferences.refresh_devices()
    for device in preferences.devices:
        device.use = device.type == backend
    return [device.name for device in preferences.devices if device.use]


def configure(settings: dict, threads: int) -> None:
    """Sampling, denoising and speed. Nothing here may blur the ground truth: no motion blur, no depth of field."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.use_persistent_data = True
    scene.render.use_motion_blur = False
    scene.render.film_transparent = False
    scene.render.resolution_percentage = 100
    scene.render.use_border = scene.render.use_multiview = scene.render.use_sequencer = False
    scene.render.use_simplify = False
    scene.render.threads_mode = "FIXED" if threads else "AUTO"
    if threads:
        scene.render.threads = threads
    _configure_sampling(scene.cycles, settings)
    _configure_denoiser(scene.cycles, settings["denoise"])


def _configure_sampling(cycles: bpy.types.bpy_struct, settings: dict) -> None:
    bounces = settings["max_bounces"]
    cycles.samples = settings["samples"]
    cycles.use_adaptive_sampling = settings["noise_threshold"] > 0.0
    cycles.adaptive_threshold = settings["noise_threshold"]
    # The first samples tell how noisy a pixel is; with fewer, some noise would go unseen.
    cycles.adaptive_min_samples = max(4, settings["samples"] // 4)
    cycles.use_animated_seed = False
    cycles.time_limit = 0.0
    # Picking lamps by a tree costs a quarter more here, and looks the same once denoised.
    cycles.use_light_tree = False
    cycles.use_auto_tile = False
    cycles.max_bounces = bounces
    cycles.diffuse_bounces = bounces
    cycles.glossy_bounces = min(bounces, 4)
    cycles.transmission_bounces = bounces
    cycles.transparent_max_bounces = 8
    cycles.volume_bounces = 0
    cycles.caustics_reflective = cycles.caustics_refractive = False
    cycles.blur_glossy = 1.0
    cycles.sample_clamp_direct, cycles.sample_clamp_indirect = CLAMP_DIRECT, CLAMP_INDIRECT


def _configure_denoiser(cycles: bpy.types.bpy_struct, denoise: bool) -> None:
    cycles.use_denoising = denoise
    cycles.denoiser = "OPENIMAGEDENOISE"
    cycles.denoising_input_passes = "RGB_ALBEDO_NORMAL"
    cycles.denoising_prefilter = "ACCURATE"
    if hasattr(cycles, "denoising_use_gpu"):
        cycles.denoising_use_gpu = cycles.device == "GPU"
