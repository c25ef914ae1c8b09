# SPDX-License-Identifier: GPL-3.0-or-later
"""The material that shows baked images."""

import bpy
import numpy as np

from blender_scripts.bake.shader_channels import COLOR, DEFAULT, GLOSS, GLOSS_INPUTS, NORMAL, SURFACE
from blender_scripts.bake.shader_constants import Constants

BAKED_UV = "baked"
# Less translucency than this is not worth a second shader.
MIN_TRANSLUCENCY = 0.02


def build_baked_material(name: str, images: dict[str, bpy.types.Image], constants: Constants) -> bpy.types.Material:
    """A material of the images of COLOR, SURFACE and, if there are bumps, NORMAL; GLOSS is an image or constant."""
    material = bpy.data.materials.new(f"{name}_baked")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = BAKED_UV
    shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
    color = _image(tree, uv, images[COLOR])
    surface = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(_image(tree, uv, images[SURFACE]), surface.inputs[0])
    tree.links.new(color, shader.inputs["Base Color"])
    tree.links.new(surface.outputs[0], shader.inputs["Roughness"])
    tree.links.new(surface.outputs[1], shader.inputs["Metallic"])
    gloss = DEFAULT[GLOSS] if constants.gloss is None else constants.gloss
    for socket, value in zip(GLOSS_INPUTS, gloss, strict=True):
        shader.inputs[socket].default_value = value
    for socket, kept in constants.kept.items():
        shader.inputs[socket].default_value = kept if len(kept) > 1 else kept[0]
    if GLOSS in images:
        parts = tree.nodes.new("ShaderNodeSeparateXYZ")
        tree.links.new(_image(tree, uv, images[GLOSS]), parts.inputs[0])
        for socket, value in zip(GLOSS_INPUTS, parts.outputs, strict=True):
            tree.links.new(value, shader.inputs[socket])
    if NORMAL in images:
        normal = _normal(tree, uv, images[NORMAL])
        for socket in ("Normal", "Coat Normal"):
            tree.links.new(normal, shader.inputs[socket])
    result = shader.outputs[0]
    if _brightest(images[SURFACE], 2) > MIN_TRANSLUCENCY:
        result = _translucent(tree, color, surface.outputs[2], result)
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(result, output.inputs["Surface"])
    return material


def _image(tree: bpy.types.NodeTree, uv: bpy.types.Node, image: bpy.types.Image) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    node.extension = "EXTEND"
    tree.links.new(uv.outputs["UV"], node.inputs["Vector"])
    return node.outputs["Color"]


def _normal(tree: bpy.types.NodeTree, uv: bpy.types.Node, image: bpy.types.Image) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeNormalMap")
    node.space = "OBJECT"
    tree.links.new(_image(tree, uv, image), node.inputs["Color"])
    return node.outputs["Normal"]


def _translucent(
    tree: bpy.types.NodeTree, color: bpy.types.NodeSocket, fraction: bpy.types.NodeSocket, opaque: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    translucent = tree.nodes.new("ShaderNodeBsdfTranslucent")
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(color, translucent.inputs["Color"])
    tree.links.new(fraction, mix.inputs[0])
    tree.links.new(opaque, mix.inputs[1])
    tree.links.new(translucent.outputs[0], mix.inputs[2])
    return mix.outputs[0]


def _brightest(image: bpy.types.Image, channel: int) -> float:
    values = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(values)
    # What is in the file need not be held in memory too.
    image.buffers_free()
    return float(values[channel::4].max())
