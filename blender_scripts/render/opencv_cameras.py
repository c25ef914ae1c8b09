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


def add_camera(name: str) -> bpy.types.Object:
    """A camera without depth of field, not yet placed."""
    lens = bpy.data.cameras.new(name)
    lens.type = "PERSP"
    lens.sensor_fit = "HORIZONTAL"
    lens.sensor_width = SENSOR_WIDTH_MM
    lens.clip_end = CLIP_END_M
    lens.dof.use_dof = False
    camera = bpy.data.objects.new(name, lens)
    camera.rotation_mode = "QUATERNION"
    bpy.context.scene.collection.objects.link(camera)
    return camera


def set_intrinsics(
    scene: bpy.types.Scene, camera: bpy.types.Object, intrinsics: dict, near_m: float | None = None
) -> None:
    """Makes the scene's next render one of this camera with these intrinsics (pixels).

    It sees nothing that is nearer along its axis than ``near_m``.
    """
    width, height = intrinsics["width_px"], intrinsics["height_px"]
    fx, fy = intrinsics["fx_px"], intrinsics["fy_px"]
    if scene.camera != camera:
        # Even setting the same camera makes Blender load the whole scene into Cycles again.
        scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = width, height
    # Blender accepts no aspect below 1.
    scene.render.pixel_aspect_x = max(1.0, fy / fx)
    scene.render.pixel_aspect_y = max(1.0, fx / fy)
    camera.data.clip_start = CLIP_START_M if near_m is None else near_m
    camera.data.lens = fx * SENSOR_WIDTH_MM / width
    # With a horizontal fit a shift of 1 moves the image by its width, whatever its height.
    camera.data.shift_x = -(intrinsics["cx_px"] - 0.5 * (width - 1)) / width
    camera.data.shift_y = (intrinsics["cy_px"] - 0.5 * (height - 1)) * (fx / fy) / width


def place(camera: bpy.types.Object, world_from_camera: np.ndarray) -> None:
    """Moves a camera to an OpenCV pose f64[4, 4]."""
    camera.matrix_world = _blender_pose(world_from_camera)


def move_through(camera: bpy.types.Object, world_from_camera: np.ndarray, moment: int) -> None:
    """Makes a camera pass through the OpenCV poses f64[3, 4, 4] of a frame and its neighbours.

    ``moment`` is Blender's frame at which it is in the middle pose.
    """
    values = np.empty((3, 7))
    for step, pose in enumerate(world_from_camera):
        location, rotation, _ = _blender_pose(pose).decompose()
        if step > 0 and np.dot(rotation, values[step - 1, 3:]) < 0.0:
            rotation.negate()
        values[step] = (*location, *rotation)
    # New curves would make Blender load the whole scene into Cycles again; new values do not.
    curves = _curves(camera, moment)
    for curve, column in zip(curves, values.T, strict=True):
        for key, value in zip(curve.keyframe_points, column, strict=True):
            key.co.y = value
        curve.update()
    camera.animation_data.action.update_tag()
    camera.update_tag()


def _curves(camera: bpy.types.Object, moment: int) -> list[bpy.types.FCurve]:
    """Seven curves, of location and rotation, with straight lines between keys before, at and after a moment."""
    moves = camera.animation_data is not None
    if not moves:
        for frame in (moment - 1, moment, moment + 1):
            for path in ("location", "rotation_quaternion"):
                camera.keyframe_insert(path, frame=frame)
        for curve in camera.animation_data.action.fcurves:
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
    return sorted(camera.animation_data.action.fcurves, key=lambda curve: (curve.data_path, curve.array_index))


def with_neighbours(poses: np.ndarray, frame: int) -> np.ndarray:
    """Poses f64[3, 4, 4] of the frame before, the frame and the one after; motion goes on beyond either end."""
    last = len(poses) - 1
    here = np.asarray(poses[frame])
    before = np.asarray(poses[frame - 1]) if frame > 0 else None
    after = np.asarray(poses[frame + 1]) if frame < last else None
    if before is None:
        before = here if after is None else here @ np.linalg.inv(after) @ here
    if after is None:
        after = here @ np.linalg.inv(before) @ here
    return np.stack([before, here, after])


def _blender_pose(world_from_camera: np.ndarray) -> Matrix:
    return Matrix((np.asarray(world_from_camera) @ BLENDER_FROM_OPENCV).tolist())
