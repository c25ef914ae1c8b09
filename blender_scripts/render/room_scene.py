# SPDX-License-Identifier: GPL-3.0-or-later
"""The room of a render job: opened from its .blend, or built from meshes, materials and lights."""

from pathlib import Path

import bpy
from mathutils import Vector

from blender_scripts.render.cheap_materials import build_material
from blender_scripts.render.mesh_arrays import (
    SHARP_ANGLE_RAD,
    add_image_uv,
    add_object,
    box_projection,
    build_mesh,
    set_pattern_uv,
    shade_smooth,
)
from blender_scripts.render.room_uv import along_the_grain, over_the_whole
from blender_scripts.worker.job_arrays import JobArrays

# The sky of a room that names none: a bright day, as it comes through a window.
PLAIN_SKY = {
    "zenith_color": (0.72, 0.85, 1.0),
    "horizon_color": (0.72, 0.85, 1.0),
    "ground_color": (0.72, 0.85, 1.0),
    "radiance_w_m2_sr": 1.5,
}
# Elevations, as the sine of the angle, between which ground goes over into horizon and horizon into zenith.
GROUND_SINE, HORIZON_SINE, ZENITH_SINE = -0.03, 0.02, 0.5
# Patterns that run along the longest side of each board, rather than the same way everywhere.
GRAINED = frozenset({"wood", "brushed"})


def load_room(room: dict, blend_path: str | None, arrays: JobArrays) -> None:
    """Makes the scene hold the room and nothing else."""
    if blend_path is None:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        for obj in room["objects"]:
            _add_room_object(obj, arrays)
        for light in room["lights"]:
            _add_light(light)
        _add_sky(room["sky"] or PLAIN_SKY)
    else:
        _open_blend(Path(blend_path))
        if bpy.context.scene.world is None:
            _add_sky(PLAIN_SKY)
    for obj in bpy.context.scene.objects:
        if obj.type == "LIGHT":
            # A lamp that a camera ray meets would be in the picture but not in depth and object index.
            obj.visible_camera = False


def _open_blend(path: Path) -> None:
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)
    for camera in [obj for obj in bpy.data.objects if obj.type == "CAMERA"]:
        bpy.data.objects.remove(camera)


def _add_room_object(obj: dict, arrays: JobArrays) -> None:
    vertices_m, faces = arrays.load(obj["vertices_m"]), arrays.load(obj["faces"])
    mesh = build_mesh(obj["name"], vertices_m, faces)
    shade_smooth(mesh, SHARP_ANGLE_RAD)
    grained = obj["material"]["pattern"] in GRAINED
    set_pattern_uv(mesh, along_the_grain(vertices_m, faces) if grained else box_projection(vertices_m, faces))
    image = arrays.load_optional(obj["material"]["image"])
    if image is not None:
        # A room object has no UVs of its own: its picture repeats, or covers it once.
        scale_m = obj["material"]["scale_m"]
        uv = box_projection(vertices_m, faces) / scale_m if scale_m > 0.0 else over_the_whole(vertices_m, faces)
        add_image_uv(mesh, uv)
    mesh.materials.append(build_material(obj["material"], image))
    add_object(obj["name"], mesh, obj["object_index"])


def _add_light(settings: dict) -> None:
    lamp = bpy.data.lights.new("lamp", "AREA")
    lamp.shape = "RECTANGLE"
    lamp.size, lamp.size_y = settings["size_m"]
    lamp.energy = settings["power_w"]
    lamp.color = settings["color"]
    obj = bpy.data.objects.new("lamp", lamp)
    obj.location = settings["position_m"]
    obj.rotation_mode = "QUATERNION"
    obj.rotation_quaternion = Vector(settings["direction"]).to_track_quat("-Z", "Y")
    bpy.context.scene.collection.objects.link(obj)


def _add_sky(settings: dict) -> None:
    """A gradient from the ground over the horizon to the zenith, far away."""
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    tree = world.node_tree
    background = tree.nodes["Background"]
    background.inputs["Strength"].default_value = settings["radiance_w_m2_sr"]
    direction = tree.nodes.new("ShaderNodeTexCoord")
    parts = tree.nodes.new("ShaderNodeSeparateXYZ")
    # The window lights stand for the sky's light; the map range turns the sine of the elevation into a place.
    place = tree.nodes.new("ShaderNodeMapRange")
    place.inputs["From Min"].default_value = -1.0
    ramp = tree.nodes.new("ShaderNodeValToRGB")
    stops = (
        (GROUND_SINE, settings["ground_color"]),
        (HORIZON_SINE, settings["horizon_color"]),
        (ZENITH_SINE, settings["zenith_color"]),
    )
    while len(ramp.color_ramp.elements) < len(stops):
        ramp.color_ramp.elements.new(0.5)
    for element, (sine, color) in zip(ramp.color_ramp.elements, stops, strict=True):
        element.position = 0.5 + 0.5 * sine
        element.color = (*color, 1.0)
    tree.links.new(direction.outputs["Generated"], parts.inputs[0])
    tree.links.new(parts.outputs["Z"], place.inputs["Value"])
    tree.links.new(place.outputs["Result"], ramp.inputs["Fac"])
    tree.links.new(ramp.outputs["Color"], background.inputs["Color"])
    # Looking for light in every direction of the sky costs much and finds little: walls hide nearly all of it.
    world.cycles.sampling_method = "NONE"
    bpy.context.scene.world = world
