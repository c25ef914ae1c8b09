# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads what a surface shader is made of (colour, roughness, metal, gloss) as plain values of its node tree.

A shader cannot be baked, values can. So the tree of shaders (mixtures, groups, BSDFs) is followed from the output,
and a tree of the same shape is built beside it that mixes the BSDFs' values by the same factors.
"""

import bpy

COLOR, SURFACE, GLOSS, NORMAL = "color", "surface", "gloss", "normal"
# SURFACE is a vector of roughness, metalness and translucency; GLOSS one of specular level, coat and sheen.
DEFAULT = {COLOR: (0.0, 0.0, 0.0), SURFACE: (0.5, 0.0, 0.0), GLOSS: (0.5, 0.0, 0.0)}
GLOSS_INPUTS = ("Specular IOR Level", "Coat Weight", "Sheen Weight")
# Shaders without a mirror of their own.
MATT = frozenset({"BSDF_DIFFUSE", "BSDF_TRANSLUCENT", "EMISSION"})

Tree = bpy.types.NodeTree
Socket = bpy.types.NodeSocket


class ChannelReader:
    """Adds channel values to node trees; a group that several materials share is extended once."""

    def __init__(self) -> None:
        self._inputs: dict[tuple[str, str, str], str] = {}
        self._outputs: dict[tuple[str, str, str], str] = {}
        self._links_made: set[tuple[str, str, str]] = set()

    def channel(self, tree: Tree, shader: Socket, channel: str) -> Socket:
        """The value of a channel of the shader that arrives at the socket ``shader``."""
        if not shader.is_linked:
            return _constant(tree, DEFAULT[channel])
        link = shader.links[0]
        return self._of_node(tree, link.from_node, link.from_socket, channel)

    def _of_node(self, tree: Tree, node: bpy.types.Node, output: Socket, channel: str) -> Socket:
        match node.type:
            case "REROUTE":
                return self.channel(tree, node.inputs[0], channel)
            case "MIX_SHADER":
                return self._mixed(tree, node, channel)
            case "ADD_SHADER":
                return self._added(tree, node, channel)
            case "GROUP":
                return self._of_group(tree, node, output, channel)
            case "GROUP_INPUT":
                return self._of_group_input(tree, node, output, channel)
        return {COLOR: _bsdf_color, SURFACE: _bsdf_surface, GLOSS: _bsdf_gloss}[channel](tree, node)

    def _mixed(self, tree: Tree, node: bpy.types.Node, channel: str) -> Socket:
        mix = tree.nodes.new("ShaderNodeMix")
        mix.data_type = "VECTOR"
        mix.clamp_factor = True
        factor, first, second = mix.inputs[0], mix.inputs[4], mix.inputs[5]
        _copy(tree, node.inputs[0], factor)
        tree.links.new(self.channel(tree, node.inputs[1], channel), first)
        tree.links.new(self.channel(tree, node.inputs[2], channel), second)
        return mix.outputs[1]

    def _added(self, tree: Tree, node: bpy.types.Node, channel: str) -> Socket:
        """Colours add up; of the surface values the larger counts."""
        combine = tree.nodes.new("ShaderNodeVectorMath")
        combine.operation = "ADD" if channel == COLOR else "MAXIMUM"
        for k in (0, 1):
            tree.links.new(self.channel(tree, node.inputs[k], channel), combine.inputs[k])
        return combine.outputs[0]

    def _of_group(self, tree: Tree, node: bpy.types.Node, output: Socket, channel: str) -> Socket:
        group = node.node_tree
        key = (group.name_full, output.identifier, channel)
        if key not in self._outputs:
            end = next(inner for inner in group.nodes if inner.type == "GROUP_OUTPUT" and inner.is_active_output)
            shader = next(socket for socket in end.inputs if socket.identifier == output.identifier)
            value = self.channel(group, shader, channel)
            item = group.interface.new_socket(
                f"{channel} of {output.name}", in_out="OUTPUT", socket_type="NodeSocketVector"
            )
            self._outputs[key] = item.identifier
            group.links.new(value, next(socket for socket in end.inputs if socket.identifier == item.identifier))
        self._feed_group(tree, node, channel)
        return next(socket for socket in node.outputs if socket.identifier == self._outputs[key])

    def _feed_group(self, tree: Tree, node: bpy.types.Node, channel: str) -> None:
        """Gives an instance of a group the channels of the shaders that are plugged into it."""
        for socket in list(node.inputs):
            identifier = self._inputs.get((node.node_tree.name_full, socket.identifier, channel))
            if identifier is None:
                continue
            target = next(candidate for candidate in node.inputs if candidate.identifier == identifier)
            if not target.is_linked:
                tree.links.new(self.channel(tree, socket, channel), target)

    def _of_group_input(self, tree: Tree, node: bpy.types.Node, output: Socket, channel: str) -> Socket:
        key = (tree.name_full, output.identifier, channel)
        if key not in self._inputs:
            item = tree.interface.new_socket(
                f"{channel} of {output.name}", in_out="INPUT", socket_type="NodeSocketVector"
            )
            self._inputs[key] = item.identifier
        return next(socket for socket in node.outputs if socket.identifier == self._inputs[key])


def _bsdf_color(tree: Tree, node: bpy.types.Node) -> Socket:
    source = node.inputs.get("Base Color") or node.inputs.get("Color")
    if source is None or node.type == "EMISSION":
        return _constant(tree, (0.0, 0.0, 0.0))
    if source.is_linked:
        return source.links[0].from_socket
    return _constant(tree, tuple(source.default_value)[:3])


def _bsdf_surface(tree: Tree, node: bpy.types.Node) -> Socket:
    combine = tree.nodes.new("ShaderNodeCombineXYZ")
    fallback = {"BSDF_DIFFUSE": 1.0, "BSDF_TRANSLUCENT": 1.0}.get(node.type)
    if fallback is None and "Roughness" in node.inputs:
        _copy(tree, node.inputs["Roughness"], combine.inputs[0])
    else:
        combine.inputs[0].default_value = DEFAULT[SURFACE][0] if fallback is None else fallback
    if "Metallic" in node.inputs:
        _copy(tree, node.inputs["Metallic"], combine.inputs[1])
    else:
        combine.inputs[1].default_value = float(node.type in {"BSDF_GLOSSY", "BSDF_ANISOTROPIC"})
    combine.inputs[2].default_value = float(node.type == "BSDF_TRANSLUCENT")
    return combine.outputs[0]


def _bsdf_gloss(tree: Tree, node: bpy.types.Node) -> Socket:
    combine = tree.nodes.new("ShaderNodeCombineXYZ")
    for name, target, value in zip(GLOSS_INPUTS, combine.inputs, plain_gloss(node), strict=True):
        if name in node.inputs:
            _copy(tree, node.inputs[name], target)
        else:
            target.default_value = value
    return combine.outputs[0]


def plain_gloss(node: bpy.types.Node) -> tuple[float, ...]:
    """The GLOSS of a shader that has no inputs for it."""
    return (0.0, 0.0, 0.0) if node.type in MATT else DEFAULT[GLOSS]


def _copy(tree: Tree, source: Socket, target: Socket) -> None:
    """Makes ``target`` have the value of ``source``, linked or constant."""
    if source.is_linked:
        tree.links.new(source.links[0].from_socket, target)
    else:
        target.default_value = source.default_value


def _constant(tree: Tree, value: tuple[float, ...]) -> Socket:
    node = tree.nodes.new("ShaderNodeCombineXYZ")
    for k in range(3):
        node.inputs[k].default_value = value[k]
    return node.outputs[0]


def all_nodes(tree: Tree, seen: set[str] | None = None) -> list[bpy.types.Node]:
    """The nodes of a tree and of the groups in it."""
    seen = set() if seen is None else seen
    nodes = []
    for node in tree.nodes:
        nodes.append(node)
        if node.type == "GROUP" and node.node_tree is not None and node.node_tree.name_full not in seen:
            seen.add(node.node_tree.name_full)
            nodes.extend(all_nodes(node.node_tree, seen))
    return nodes
