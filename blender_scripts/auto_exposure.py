# SPDX-License-Identifier: GPL-3.0-or-later
"""Automatic exposure: metered on small test renders like a camera's meter, then constant over the sequence."""

import json
import math
from pathlib import Path

import bpy
import numpy as np
from worker_link import write_atomically

TEST_SIDE_PX = 64
TEST_SAMPLES = 16
# Log-average luminance of the picture after exposure: between mid grey (0.18) and the light walls of a room.
KEY = 0.22
# The brightest hundredth stays under this, where the view transform still tells tones apart.
MAX_HIGHLIGHT = 6.0
LIMIT_EV = 14.0
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


def read_stored(path: Path) -> float | None:
    """The exposure that an earlier run of this job settled on, stops."""
    if not path.is_file():
        return None
    return float(json.loads(path.read_text(encoding="utf-8"))["exposure_ev"])


def store(path: Path, stops: float) -> None:
    """Keeps the exposure for a run that resumes this job."""
    write_atomically(path, json.dumps({"exposure_ev": stops}).encode())


class TestRender:
    """Renders small linear pictures; restores the scene's settings afterwards."""

    def __init__(self, scratch: Path) -> None:
        self._path = scratch / "metering.exr"

    def pixels(self) -> np.ndarray:
        """Linear RGB f32[N, 3] of the scene's camera at low resolution."""
        scene = bpy.context.scene
        render, image = scene.render, scene.render.image_settings
        kept = (render.resolution_percentage, scene.cycles.samples, render.use_compositing, image.file_format)
        longer_px = max(render.resolution_x, render.resolution_y)
        render.resolution_percentage = max(1, min(100, round(100 * TEST_SIDE_PX / longer_px)))
        scene.cycles.samples = TEST_SAMPLES
        render.use_compositing = False
        image.file_format = "OPEN_EXR"
        try:
            bpy.ops.render.render(write_still=False)
            bpy.data.images["Render Result"].save_render(str(self._path))
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
