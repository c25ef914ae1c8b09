# SPDX-License-Identifier: GPL-3.0-or-later
"""What scripts that make rooms share: how much light a room needs, and how its triangles are written."""

from pathlib import Path

import bpy
import numpy as np

from blender_scripts.worker.plain_meshes import world_triangles

# Direct sun beyond this (W/m2) leaves white patches in a picture that shows the room.
MAX_SUN_W_M2 = 8.0
# Lamp power per square metre of floor: below the first a room is dim; a ceiling panel then brings it to the second.
MIN_LAMP_W_M2, PANEL_LAMP_W_M2 = 1.2, 2.2


def add_panel(power_w: float, dimensions_m: list[float]) -> None:
    """Light from under the ceiling of a room with sides x, y and height in metres, around the origin."""
    panel = bpy.data.lights.new("ceiling_panel", "AREA")
    panel.shape = "RECTANGLE"
    panel.size, panel.size_y = 0.5 * dimensions_m[0], 0.5 * dimensions_m[1]
    panel.energy = power_w
    obj = bpy.data.objects.new("ceiling_panel", panel)
    obj.location = (0.0, 0.0, dimensions_m[2] - 0.1)
    # It stands for light from nowhere in particular, so it must not mirror in a polished floor.
    obj.visible_glossy = obj.visible_camera = False
    bpy.context.scene.collection.objects.link(obj)


def write_meshes(path: Path, objs: list[bpy.types.Object]) -> None:
    """One array of all vertices and one of all triangles; ``*_start`` holds where each object's begin, and the end."""
    meshes = [world_triangles(obj) for obj in objs]
    np.savez(
        path,
        vertices_m=np.concatenate([vertices_m for vertices_m, _ in meshes]),
        faces=np.concatenate([faces for _, faces in meshes]),
        vertex_start=np.cumsum([0] + [len(vertices_m) for vertices_m, _ in meshes]),
        face_start=np.cumsum([0] + [len(faces) for _, faces in meshes]),
    )
