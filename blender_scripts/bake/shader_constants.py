# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads which values of a surface shader are the same everywhere, through groups and their inputs."""

from collections.abc import Iterator
from dataclasses import dataclass

import bpy

from blender_scripts.bake.shader_channels import GLOSS_INPUTS, plain_gloss

# Of the Principled BSDF: what no image holds. Sheen of little roughness shines at the rim alone, for instance.
KEPT_INPUTS = (
    "IOR",
    "Specular Tint",
    "Coat Roughness",
    "Coat IOR",
    "Coat Tint",
    "Sheen Roughness",
    "Sheen Tint",
)

Value = tuple[float, ...]
# The instances of groups around a node, outermost first.
Path = tuple[bpy.types.Node, ...]


@dataclass(frozen=True)
class Constants:
    """``gloss``: GLOSS, or None where it differs from place to place. ``kept``: values of KEPT_INPUTS by name."""

    gloss: Value | None
    kept: dict[str, Value]


def read_constants(material: bpy.types.Material) -> Constants:
    """What is constant in the shader of a material."""
    surface = material.node_tree.get_output_node("CYCLES").inputs["Surface"]
    shaders = list(_shaders(surface, ()))
    found = {_gloss(node, path) for node, path in shaders}
    return Constants(found.pop() if len(found) == 1 else None, _kept(shaders))


def _shaders(socket: bpy.types.NodeSocket, path: Path) -> Iterator[tuple[bpy.types.Node, Path]]:
    """The BSDFs that a shader is mixed of."""
    if not socket.is_linked:
        return
    node, output = socket.links[0].from_node, socket.links[0].from_socket
    match node.type:
        case "REROUTE":
            yield from _shaders(node.inputs[0], path)
        case "MIX_SHADER":
            factor = _value(node.inputs[0], path)
            if factor is None or factor[0] < 1.0:
                yield from _shaders(node.inputs[1], path)
            if factor is None or factor[0] > 0.0:
                yield from _shaders(node.inputs[2], path)
        case "ADD_SHADER":
            yield from _shaders(node.inputs[0], path)
            yield from _shaders(node.inputs[1], path)
        case "GROUP":
            yield from _shaders(_inside(node, output), (*path, node))
        case "GROUP_INPUT":
            yield from _shaders(_outside(path[-1], output), path[:-1])
        case _:
            yield node, path


def _value(socket: bpy.types.NodeSocket, path: Path) -> Value | None:
    """What arrives at a socket; None where it is computed."""
    if not socket.is_linked:
        return _plain(socket)
    node, output = socket.links[0].from_node, socket.links[0].from_socket
    match node.type:
        case "REROUTE":
            return _value(node.inputs[0], path)
        case "GROUP":
            return _value(_inside(node, output), (*path, node))
        case "GROUP_INPUT":
            return _value(_outside(path[-1], output), path[:-1])
        case "VALUE" | "RGB":
            return _plain(output)
    return None


def _inside(group: bpy.types.Node, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    nodes = group.node_tree.nodes
    end = next(node for node in nodes if node.type == "GROUP_OUTPUT" and node.is_active_output)
    return next(socket for socket in end.inputs if socket.identifier == output.identifier)


def _outside(group: bpy.types.Node, output: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
    return next(socket for socket in group.inputs if socket.identifier == output.identifier)


def _plain(socket: bpy.types.NodeSocket) -> Value:
    value = socket.default_value
    return tuple(value) if hasattr(value, "__len__") else (float(value),)


def _gloss(node: bpy.types.Node, path: Path) -> Value | None:
    values = []
    for name, value in zip(GLOSS_INPUTS, plain_gloss(node), strict=True):
        found = _value(node.inputs[name], path) if name in node.inputs else (value,)
        if found is None:
            return None
        values.append(round(found[0], 4))
    return tuple(values)


def _kept(shaders: list[tuple[bpy.types.Node, Path]]) -> dict[str, Value]:
    """Of several Principled BSDFs the first that has such a layer counts: a baked material is but one."""
    kept: dict[str, Value] = {}
    for node, path in shaders:
        if node.type == "BSDF_PRINCIPLED":
            for name in KEPT_INPUTS:
                value = _value(node.inputs[name], path)
                if value is not None and _has_layer(node, path, name):
                    kept.setdefault(name, value)
    return kept


def _has_layer(node: bpy.types.Node, path: Path, name: str) -> bool:
    """Whether the layer that an input describes, coat or sheen, is there; all else is."""
    weight = node.inputs.get(f"{name.split()[0]} Weight")
    return weight is None or _value(weight, path) != (0.0,)
