# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the colours of surfaces within what rooms are painted and furnished in.

Infinigen draws the hue and saturation of paint freely, so some walls come out in neon green and some cupboards black
as a hole. Every base colour is limited in its shader: saturation (of linear RGB, as in HSV) up to a cap, and
reflectance between coal and fresh plaster. The caps are tight on what covers a room (walls, ceiling, floor) and wide
on furniture. They follow the hue: brick, clay and wood are saturated oranges and stay as they are; paints of other
hues are pastels. Patterns keep their contrast, as each shaded point is limited alone.
"""

import bpy

from blender_scripts.worker.opaque_materials import shader_trees

# Hue of clay and wood, and the distance from it (turns of the colour wheel) where the cap begins and ends to fall.
WARM_HUE, WARM_REACH, COLD_REACH = 0.07, 0.07, 0.16
# Largest saturation of warm and of other hues, by what the surface is.
CAPS = {"wall": (0.62, 0.32), "ceiling": (0.35, 0.15), "floor": (0.75, 0.4), "furniture": (0.95, 0.75)}
# Least and largest value: even black paint reflects some light, and no wall all of it.
MIN_VALUE = {"wall": 0.08, "ceiling": 0.45, "floor": 0.06, "furniture": 0.035}
MAX_VALUE = 0.86
LIMIT = "limit_color"


def tame_colors(objs: list[bpy.types.Object], categories: list[str]) -> None:
    """Limits the colours of all materials; one that several kinds of surface share follows the largest."""
    kinds: dict[str, str] = {}
    by_size = sorted(zip(categories, objs, strict=True), key=lambda entry: entry[0] not in CAPS)
    for category, obj in by_size:
        for material in obj.data.materials:
            if material is not None and material.use_nodes:
                kinds.setdefault(material.name, category if category in CAPS else "furniture")
    groups: set[str] = set()
    for name, kind in kinds.items():
        root, *inner = shader_trees(bpy.data.materials[name].node_tree)
        _tame_tree(root, kind)
        for tree in inner:
            if tree.name not in groups and not tree.name.startswith(LIMIT):
                groups.add(tree.name)
                _tame_tree(tree, kind)


def _tame_tree(tree: bpy.types.NodeTree, kind: str) -> None:
    for node in list(tree.nodes):
        color = node.inputs.get("Base Color") or (node.inputs.get("Color") if node.type == "BSDF_DIFFUSE" else None)
        if color is None or not node.type.startswith("BSDF"):
            continue
        limit = tree.nodes.new("ShaderNodeGroup")
        limit.node_tree = _limit_group(kind)
        if color.is_linked:
            tree.links.new(color.links[0].from_socket, limit.inputs[0])
        else:
            limit.inputs[0].default_value = color.default_value
        tree.links.new(limit.outputs[0], color)


def _limit_group(kind: str) -> bpy.types.NodeTree:
    name = f"{LIMIT}_{kind}"
    if name in bpy.data.node_groups:
        return bpy.data.node_groups[name]
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Color", in_out=direction, socket_type="NodeSocketColor")
    nodes, link = group.nodes, group.links.new
    start, end = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    apart, together = nodes.new("ShaderNodeSeparateColor"), nodes.new("ShaderNodeCombineColor")
    apart.mode = together.mode = "HSV"
    link(start.outputs[0], apart.inputs[0])
    link(apart.outputs[0], together.inputs[0])
    link(_math(group, "MINIMUM", apart.outputs[1], _cap(group, apart.outputs[0], kind)), together.inputs[1])
    least = _math(group, "MAXIMUM", apart.outputs[2], MIN_VALUE[kind])
    link(_math(group, "MINIMUM", least, MAX_VALUE), together.inputs[2])
    link(together.outputs[0], end.inputs[0])
    return group


def _cap(group: bpy.types.NodeTree, hue: bpy.types.NodeSocket, kind: str) -> bpy.types.NodeSocket:
    warm, cold = CAPS[kind]
    distance = _math(group, "ABSOLUTE", _math(group, "SUBTRACT", hue, WARM_HUE), 0.0)
    fall = group.nodes.new("ShaderNodeMapRange")
    group.links.new(distance, fall.inputs["Value"])
    for name, value in (("From Min", WARM_REACH), ("From Max", COLD_REACH), ("To Min", warm), ("To Max", cold)):
        fall.inputs[name].default_value = value
    return fall.outputs["Result"]


def _math(
    group: bpy.types.NodeTree, operation: str, first: bpy.types.NodeSocket, second: bpy.types.NodeSocket | float
) -> bpy.types.NodeSocket:
    node = group.nodes.new("ShaderNodeMath")
    node.operation = operation
    group.links.new(first, node.inputs[0])
    if isinstance(second, float):
        node.inputs[1].default_value = second
    else:
        group.links.new(second, node.inputs[1])
    return node.outputs[0]
