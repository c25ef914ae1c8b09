# SPDX-License-Identifier: GPL-3.0-or-later
"""The room of a render job: opened from its .blend, or built from meshes, materials and lights."""

from pathlib import Path

import bpy
import numpy as np
from cheap_materials import build_material
from job_arrays import JobArrays
from mathutils import Vector
from mesh_arrays import SHARP_ANGLE_RAD, add_image_uv, add_object, add_pattern_uv, build_mesh, shade_smooth

# A clear sky's colour and radiance (W/m2/sr) as it comes through a window on a bright day.
SKY_COLOR = (0.72, 0.85, 1.0)
SKY_RADIANCE = 1.5


def load_room(room: dict, blend_path: str | None, arrays: JobArrays) -> None:
    """Makes the scene hold the room and nothing else."""
    if blend_path is None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        for thing in room["objects"]:
            _add_room_object(thing, arrays)
        for light in room["lights"]:
            _add_light(light)
    else:
        _open_blend(Path(blend_path))
    if bpy.context.scene.world is None:
        _add_sky()
    for thing in bpy.context.scene.objects:
        if thing.type == "LIGHT":
            # A lamp that a camera ray meets would be in the picture but not in depth and object index.
            thing.visible_camera = False


def _open_blend(path: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)
    for camera in [thing for thing in bpy.data.objects if thing.type == "CAMERA"]:
        bpy.data.objects.remove(camera)


def _add_room_object(thing: dict, arrays: JobArrays) -> None:
    vertices_m, faces = arrays.load(thing["vertices_m"]), arrays.load(thing["faces"])
    mesh = build_mesh(thing["name"], vertices_m, faces)
    shade_smooth(mesh, SHARP_ANGLE_RAD)
    add_pattern_uv(mesh, vertices_m, faces)
    image = arrays.load_optional(thing["material"]["image"])
    if image is not None:
        # A room object has no UVs of its own: its picture repeats every scale_m.
        uv = mesh.uv_layers[0].uv
        flat = np.empty(2 * len(uv), np.float32)
        uv.foreach_get("vector", flat)
        add_image_uv(mesh, flat / thing["material"]["scale_m"])
    mesh.materials.append(build_material(thing["material"], image))
    add_object(thing["name"], mesh, thing["object_index"])


def _add_light(settings: dict) -> None:
    lamp = bpy.data.lights.new("lamp", "AREA")
    lamp.shape = "RECTANGLE"
    lamp.size, lamp.size_y = settings["size_m"]
    lamp.energy = settings["power_w"]
    lamp.color = settings["color"]
    thing = bpy.data.objects.new("lamp", lamp)
    thing.location = settings["position_m"]
    thing.rotation_mode = "QUATERNION"
    thing.rotation_quaternion = Vector(settings["direction"]).to_track_quat("-Z", "Y")
    bpy.context.scene.collection.objects.link(thing)


def _add_sky() -> None:
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*SKY_COLOR, 1.0)
    background.inputs["Strength"].default_value = SKY_RADIANCE
    bpy.context.scene.world = world
