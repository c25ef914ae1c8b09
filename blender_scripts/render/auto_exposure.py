# SPDX-License-Identifier: GPL-3.0-or-later
"""Automatic exposure and white balance: metered on small test renders, then constant over the sequence."""

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path

import bpy
import numpy as np

from blender_scripts.worker.link import write_atomically

TEST_SIDE_PX = 64
TEST_SAMPLES = 16
# Log-average luminance of the picture after exposure: between mid grey (0.18) and the light walls of a room.
KEY = 0.22
# The brightest hundredth stays under this, where the view transform still tells tones apart.
MAX_HIGHLIGHT = 6.0
LIMIT_EV = 14.0
MAX_GAIN = 2.0
# Shades of Grey: 1 would be a grey world, which takes green walls for green light; infinity the brightest spot alone.
MINKOWSKI_NORM = 6
# Lamps themselves, brighter than this share of the picture, do not count more than what they light.
LAMP_QUANTILE = 0.95
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def exposure_ev(linear_rgb: np.ndarray) -> float:
    """Stops of exposure for linear pixels f[N, 3]; 0 where nothing is lit."""
    luminance = linear_rgb @ LUMINANCE
    lit = luminance[luminance > 1e-6]
    if len(lit) == 0:
        return 0.0
    stops = math.log2(KEY) - float(np.mean(np.log2(lit)))
    stops = min(stops, math.log2(MAX_HIGHLIGHT / float(np.quantile(lit, 0.99))))
    return max(-LIMIT_EV, min(LIMIT_EV, stops))


def white_balance(linear_rgb: np.ndarray, strength: float) -> tuple[float, float, float]:
    """Gains for red, green and blue that take a share (0 to 1) of the picture's colour cast out of it.

    The cast is estimated by Shades of Grey (Finlayson and Trezzi 2004), in which bright surfaces count most: they tell
    the light's colour best. The gains keep the luminance of the cast's colour.
    """
    lit = linear_rgb[(linear_rgb > 1e-6).all(axis=1)].astype(np.float64)
    if len(lit) == 0:
        return (1.0, 1.0, 1.0)
    luminance = lit @ LUMINANCE
    limit = np.quantile(luminance, LAMP_QUANTILE)
    lit *= np.minimum(1.0, limit / luminance)[:, None] / limit
    average = (lit**MINKOWSKI_NORM).mean(axis=0) ** (1.0 / MINKOWSKI_NORM)
    gains = (float(average @ LUMINANCE) / average) ** strength
    gains = np.clip(gains, 1.0 / MAX_GAIN, MAX_GAIN)
    gains *= float(average @ LUMINANCE) / float((gains * average) @ LUMINANCE)
    return (float(gains[0]), float(gains[1]), float(gains[2]))


@dataclass(frozen=True)
class Development:
    """How linear light becomes a picture: stops of exposure, and gains of red, green and blue."""

    exposure_ev: float
    gains: tuple[float, float, float]


def develop(linear_rgb: np.ndarray, balance_strength: float) -> Development:
    """The development that suits metered pixels f[N, 3]."""
    return Development(exposure_ev(linear_rgb), white_balance(linear_rgb, balance_strength))


def read_stored(path: Path) -> Development | None:
    """What an earlier run of this job settled on."""
    if not path.is_file():
        return None
    stored = json.loads(path.read_text(encoding="utf-8"))
    return Development(stored["exposure_ev"], tuple(stored["gains"]))


def store(path: Path, development: Development) -> None:
    """Keeps the development for a run that resumes this job."""
    write_atomically(path, json.dumps(asdict(development)).encode())


class TestRender:
    """Renders small linear pictures; restores the scene's settings afterwards."""

    def __init__(self, scene: bpy.types.Scene, scratch: Path) -> None:
        self._scene = scene
        self._path = scratch / "metering.exr"

    def pixels(self) -> np.ndarray:
        """Linear RGB f32[N, 3] of the scene's camera at low resolution."""
        scene = self._scene
        render, image = scene.render, scene.render.image_settings
        kept = (render.resolution_percentage, scene.cycles.samples, render.use_compositing, image.file_format)
        longer_px = max(render.resolution_x, render.resolution_y)
        render.resolution_percentage = max(1, min(100, round(100 * TEST_SIDE_PX / longer_px)))
        scene.cycles.samples = TEST_SAMPLES
        render.use_compositing = False
        image.file_format = "OPEN_EXR"
        try:
            bpy.ops.render.render(write_still=False, scene=scene.name)
            bpy.data.images["Render Result"].save_render(str(self._path), scene=scene)
        finally:
            render.resolution_percentage, scene.cycles.samples, render.use_compositing, image.file_format = kept
        return self._read()

    def _read(self) -> np.ndarray:
        picture = bpy.data.images.load(str(self._path))
        values = np.empty(len(picture.pixels), np.float32)
        picture.pixels.foreach_get(values)
        channels = picture.channels
        bpy.data.images.remove(picture)
        self._path.unlink()
        return values.reshape(-1, channels)[:, :3]
