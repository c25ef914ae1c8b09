# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of the machine's GPUs a worker renders on. Takes Cycles' preferences as they are, or a stand-in for them."""

from typing import Any

# The first that has a device is taken: OptiX before CUDA, as both drive the same cards and OptiX traces faster.
GPU_BACKENDS = ("OPTIX", "CUDA", "HIP", "ONEAPI", "METAL")


def enable_gpus(preferences: Any, wanted: str, worker: int, workers: int) -> tuple[str, list[str]] | None:
    """Switches on this worker's share of the GPUs of the wanted backend, or of the first that has any.

    Args:
        preferences: ``bpy.context.preferences.addons["cycles"].preferences``.
        wanted: "auto", or a backend's name.
        worker: this worker's number, from 0.
        workers: how many workers share the machine.

    Returns:
        The backend's name and the names of the devices; None where there is no such device.
    """
    for backend in GPU_BACKENDS if wanted == "auto" else (wanted.upper(),):
        found = _devices_of(preferences, backend)
        if found:
            chosen = fraction_of(range(len(found)), worker, workers)
            for device in preferences.devices:
                device.use = False
            for number in chosen:
                found[number].use = True
            return backend.lower(), [found[number].name for number in chosen]
    return None


def fraction_of(numbers: range, worker: int, workers: int) -> list[int]:
    """What one worker gets of numbered devices: all different ones while they last, else one that others use too."""
    own = list(numbers[worker::workers])
    return own or [numbers[worker % len(numbers)]]


def _devices_of(preferences: Any, backend: str) -> list[Any]:
    try:
        preferences.compute_device_type = backend
    except TypeError:
        # This build of Blender does not know the backend.
        return []
    preferences.refresh_devices()
    return [device for device in preferences.devices if device.type == backend]
