# SPDX-License-Identifier: GPL-3.0-or-later
"""Time of day and lamps of an Infinigen room: what shines in, what shines inside, and what windows look out on.

The world has three layers by height above the horizon: sky, a line of trees, and ground. Infinigen's own sky ends at
the horizon, and a window that shows it looks out on a void. By day the sky and the sun are Infinigen's; in the
evening a low red sun and an afterglow replace them, at night a dark sky.
"""

import math

import bpy
from mathutils import Vector

from blender_scripts.worker.opaque_materials import shader_trees

Color = tuple[float, float, float]

# Direct sun beyond this (W/m2) leaves white patches in a picture that shows the room.
MAX_SUN_W_M2 = 8.0
EVENING_SUN_W_M2 = 0.8
EVENING_SUN_COLOR: Color = (1.0, 0.46, 0.2)
EVENING_SUN_ELEVATION_RAD = math.radians(9.0)
# Infinigen's lamps go from candle red to welding blue; bulbs that one can buy lie between these (kelvins).
MIN_LAMP_K, MAX_LAMP_K = 2900.0, 5500.0
# Lamp power per square metre of floor: below the first a room is dim; a ceiling panel then brings it to the second.
MIN_LAMP_W_M2, PANEL_LAMP_W_M2 = 1.2, 2.2
# Lamps at full power would outshine the day that comes in at the windows.
DAY_LAMP_FRACTION = 0.35
# What a room without lamps gets from its open doors and light surfaces, so that a picture shows more than noise.
FILL_W_M2 = 0.35
FILL_COLOR: Color = (0.85, 0.92, 1.0)
# Radiance of trees and ground by day; and what of it is left later.
TREES_DAY: Color = (0.10, 0.14, 0.06)
GROUND_DAY: Color = (0.34, 0.34, 0.24)
OUTDOORS_LEVEL = {"day": 1.0, "evening": 0.12, "night": 0.008}
# Radiance at the horizon and overhead.
SKIES: dict[str, tuple[Color, Color]] = {
    "evening": ((0.75, 0.36, 0.2), (0.10, 0.14, 0.30)),
    "night": ((0.016, 0.018, 0.028), (0.003, 0.005, 0.012)),
}
# Sine of the angle above the horizon up to which trees stand, on average and more or less.
TREE_TOP, TREE_ROUGHNESS = 0.03, 0.12


def set_light(
    lamps: list[bpy.types.Object], dimensions_m: list[float], daytime: str, lamps_on: bool, has_windows: bool
) -> None:
    """Gives the room the light of a time of day; without windows lamps are left on by day."""
    floor_m2 = dimensions_m[0] * dimensions_m[1]
    inside = [lamp for lamp in lamps if lamp.data.type != "SUN" and not _is_portal(lamp)]
    _set_sun([lamp for lamp in lamps if lamp.data.type == "SUN"], daytime)
    _set_outdoors(daytime)
    for lamp in inside:
        _limit_temperature(lamp.data)
    daylight = daytime == "day" and has_windows
    if lamps_on and daylight:
        for lamp in inside:
            lamp.data.energy *= DAY_LAMP_FRACTION
    if lamps_on or (daytime == "day" and not has_windows):
        power_w = sum(lamp.data.energy for lamp in inside)
        least, wanted = (FILL_W_M2, FILL_W_M2) if daylight else (MIN_LAMP_W_M2, PANEL_LAMP_W_M2)
        if power_w < least * floor_m2:
            _add_panel(wanted * floor_m2 - power_w, (1.0, 1.0, 1.0), dimensions_m)
        return
    bpy.data.batch_remove(inside)
    _add_panel(FILL_W_M2 * floor_m2, FILL_COLOR, dimensions_m)


def _is_portal(lamp: bpy.types.Object) -> bool:
    return lamp.data.type == "AREA" and lamp.data.cycles.is_portal


def _limit_temperature(lamp: bpy.types.Light) -> None:
    for tree in shader_trees(lamp.node_tree) if lamp.use_nodes else ():
        for node in tree.nodes:
            if node.type == "BLACKBODY":
                kelvins = node.inputs["Temperature"]
                kelvins.default_value = min(max(kelvins.default_value, MIN_LAMP_K), MAX_LAMP_K)


def _set_sun(suns: list[bpy.types.Object], daytime: str) -> None:
    if daytime == "night":
        bpy.data.batch_remove(suns)
        return
    for sun in suns:
        if daytime == "day":
            sun.data.energy = min(sun.data.energy, MAX_SUN_W_M2)
            continue
        sun.data.energy, sun.data.color = EVENING_SUN_W_M2, EVENING_SUN_COLOR
        towards = sun.matrix_world.to_3x3() @ Vector((0.0, 0.0, 1.0))
        towards.z = math.tan(EVENING_SUN_ELEVATION_RAD) * max(towards.xy.length, 1e-3)
        sun.rotation_euler = towards.to_track_quat("Z", "Y").to_euler()


def _set_outdoors(daytime: str) -> None:
    tree = bpy.context.scene.world.node_tree
    end = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD" and node.is_active_output)
    direction = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], direction.inputs[0])
    height = direction.outputs["Z"]
    own_sky = end.inputs["Surface"].links[0].from_socket
    sky = own_sky if daytime == "day" else _gradient(tree, height, *SKIES[daytime])
    trees, ground = (
        _plain(tree, tuple(OUTDOORS_LEVEL[daytime] * part for part in color)) for color in (TREES_DAY, GROUND_DAY)
    )
    behind_trees = _mixed(tree, _step(tree, height, _tree_top(tree)), trees, sky)
    tree.links.new(_mixed(tree, _step(tree, height, None), ground, behind_trees), end.inputs["Surface"])


def _gradient(tree: bpy.types.NodeTree, height: bpy.types.NodeSocket, low: Color, high: Color) -> bpy.types.NodeSocket:
    mix = tree.nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    # A square root draws the glow together at the horizon.
    root = _math(tree, "POWER", height, 0.5)
    tree.links.new(root, mix.inputs[0])
    mix.inputs[6].default_value, mix.inputs[7].default_value = (*low, 1.0), (*high, 1.0)
    background = tree.nodes.new("ShaderNodeBackground")
    tree.links.new(mix.outputs[2], background.inputs["Color"])
    return background.outputs[0]


def _plain(tree: bpy.types.NodeTree, color: Color) -> bpy.types.NodeSocket:
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (*color, 1.0)
    return background.outputs[0]


def _tree_top(tree: bpy.types.NodeTree) -> bpy.types.NodeSocket:
    """The sine of the angle up to which trees stand, in each direction."""
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 9.0
    noise.inputs["Detail"].default_value = 3.0
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], noise.inputs["Vector"])
    swing = _math(tree, "MULTIPLY_ADD", noise.outputs[0], TREE_ROUGHNESS)
    swing.node.inputs[2].default_value = TREE_TOP - 0.5 * TREE_ROUGHNESS
    return swing


def _step(
    tree: bpy.types.NodeTree, height: bpy.types.NodeSocket, threshold: bpy.types.NodeSocket | None
) -> bpy.types.NodeSocket:
    above = _math(tree, "GREATER_THAN", height, 0.0)
    if threshold is not None:
        tree.links.new(threshold, above.node.inputs[1])
    return above


def _math(tree: bpy.types.NodeTree, operation: str, first: bpy.types.NodeSocket, second: float) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    tree.links.new(first, node.inputs[0])
    node.inputs[1].default_value = second
    return node.outputs[0]


def _mixed(
    tree: bpy.types.NodeTree, factor: bpy.types.NodeSocket, low: bpy.types.NodeSocket, high: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    mix = tree.nodes.new("ShaderNodeMixShader")
    for socket, target in zip((factor, low, high), mix.inputs, strict=True):
        tree.links.new(socket, target)
    return mix.outputs[0]


def _add_panel(power_w: float, color: Color, dimensions_m: list[float]) -> None:
    panel = bpy.data.lights.new("ceiling_panel", "AREA")
    panel.shape = "RECTANGLE"
    panel.size, panel.size_y = 0.5 * dimensions_m[0], 0.5 * dimensions_m[1]
    panel.energy, panel.color = power_w, color
    obj = bpy.data.objects.new("ceiling_panel", panel)
    obj.location = (0.0, 0.0, dimensions_m[2] - 0.1)
    # It stands for light from nowhere in particular, so it must not mirror in a polished floor.
    obj.visible_glossy = obj.visible_camera = False
    bpy.context.scene.collection.objects.link(obj)
