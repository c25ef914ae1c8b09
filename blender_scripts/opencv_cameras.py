# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenCV cameras in Blender. The only place that knows Blender's camera axes, lens model and half pixel.

A job's camera has OpenCV axes (X right, Y down, Z forward) and pixel (0, 0) at the centre of the top-left pixel.
Blender's camera looks along -Z with Y up, and its lens shift is a share of the longer image side.
"""

import bpy
import numpy as np
from mathutils import Matrix

SENSOR_WIDTH_MM = 36.0
CLIP_START_M = 0.01
CLIP_END_M = 1000.0
BLENDER_FROM_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])


def add_camera(name: str, near_m: float | None) -> bpy.types.Object:
    """A camera without depth of field, not yet placed; it sees nothing that is nearer along its axis."""
    lens = bpy.data.cameras.new(name)
    lens.type = "PERSP"
    lens.sensor_fit = "HORIZONTAL"
    lens.sensor_width = SENSOR_WIDTH_MM
    lens.clip_start, lens.clip_end = CLIP_START_M if near_m is None else near_m, CLIP_END_M
    lens.dof.use_dof = False
    camera = bpy.data.objects.new(name, lens)
    bpy.context.scene.collection.objects.link(camera)
    return camera


def set_intrinsics(camera: bpy.types.Object, intrinsics: dict) -> None:
    """Makes the scene's next render one of this camera with these intrinsics (pixels)."""
    scene = bpy.context.scene
    width, height = intrinsics["width_px"], intrinsics["height_px"]
    fx, fy = intrinsics["fx_px"], intrinsics["fy_px"]
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = width, height
    # Blender accepts no aspect below 1.
    scene.render.pixel_aspect_x = max(1.0, fy / fx)
    scene.render.pixel_aspect_y = max(1.0, fx / fy)
    camera.data.lens = fx * SENSOR_WIDTH_MM / width
    # With a horizontal fit a shift of 1 moves the image by its width, whatever its height.
    camera.data.shift_x = -(intrinsics["cx_px"] - 0.5 * (width - 1)) / width
    camera.data.shift_y = (intrinsics["cy_px"] - 0.5 * (height - 1)) * (fx / fy) / width


def place(camera: bpy.types.Object, world_from_camera: np.ndarray) -> None:
    """Moves a camera to an OpenCV pose f64[4, 4]."""
    camera.matrix_world = Matrix((world_from_camera @ BLENDER_FROM_OPENCV).tolist())
