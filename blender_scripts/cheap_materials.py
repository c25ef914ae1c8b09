# SPDX-License-Identifier: GPL-3.0-or-later
"""Cheap Cycles materials: a colour, a two-colour pattern in the UV layer ``pattern_m``, or an image.

Patterns are two-dimensional on purpose: they cost a fraction of 3D noise, and Cycles evaluates them at every bounce.
"""

import math
from collections.abc import Callable

import bpy
import numpy as np

PATTERN_UV = "pattern_m"
IMAGE_UV = "image_uv"


def build_material(settings: dict, image: np.ndarray | None) -> bpy.types.Material:
    """The material of a job's settings; ``image`` is u8[H, W, 3] in sRGB with row 0 on top."""
    material = bpy.data.materials.new(settings["name"])
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    shader = _emission(tree, settings) if settings["emission_w_m2"] > 0.0 else _surface(tree, settings, image)
    tree.links.new(shader, output.inputs["Surface"])
    return material


def _emission(tree: bpy.types.NodeTree, settings: dict) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeEmission")
    node.inputs["Color"].default_value = (*settings["base_color"], 1.0)
    # Cycles takes radiance; a Lambertian emitter's exitance is pi times that.
    node.inputs["Strength"].default_value = settings["emission_w_m2"] / math.pi
    return node.outputs["Emission"]


def _surface(tree: bpy.types.NodeTree, settings: dict, image: np.ndarray | None) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    node.inputs["Base Color"].default_value = (*settings["base_color"], 1.0)
    node.inputs["Roughness"].default_value = settings["roughness"]
    node.inputs["Metallic"].default_value = settings["metallic"]
    if image is not None:
        texture = _uv_node(tree, "ShaderNodeTexImage", IMAGE_UV, 1.0)
        texture.image = image_from_array(settings["name"], image)
        tree.links.new(texture.outputs["Color"], node.inputs["Base Color"])
    elif settings["pattern"] != "plain":
        share = PATTERNS[settings["pattern"]](tree, settings["scale_m"])
        mix = tree.nodes.new("ShaderNodeMixRGB")
        mix.inputs["Color1"].default_value = (*settings["base_color"], 1.0)
        mix.inputs["Color2"].default_value = (*settings["second_color"], 1.0)
        tree.links.new(share, mix.inputs["Fac"])
        tree.links.new(mix.outputs["Color"], node.inputs["Base Color"])
    return node.outputs["BSDF"]


def image_from_array(name: str, pixels: np.ndarray) -> bpy.types.Image:
    """An sRGB image of Blender from u8[H, W, 3] with row 0 on top (Blender's row 0 is at the bottom)."""
    height, width = pixels.shape[:2]
    image = bpy.data.images.new(name, width, height, alpha=False)
    rgba = np.ones((height, width, 4), np.float32)
    rgba[..., :3] = pixels[::-1].astype(np.float32) / 255.0
    image.pixels.foreach_set(rgba.ravel())
    image.pack()
    return image


def _uv_node(tree: bpy.types.NodeTree, kind: str, layer: str, scale: float | tuple[float, float]) -> bpy.types.Node:
    """A texture node fed by a UV layer times ``scale``."""
    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = layer
    node = tree.nodes.new(kind)
    scale_u, scale_v = scale if isinstance(scale, tuple) else (scale, scale)
    if (scale_u, scale_v) == (1.0, 1.0):
        tree.links.new(uv.outputs["UV"], node.inputs["Vector"])
        return node
    multiply = tree.nodes.new("ShaderNodeVectorMath")
    multiply.operation = "MULTIPLY"
    multiply.inputs[1].default_value = (scale_u, scale_v, 1.0)
    tree.links.new(uv.outputs["UV"], multiply.inputs[0])
    tree.links.new(multiply.outputs["Vector"], node.inputs["Vector"])
    return node


def _ramp(tree: bpy.types.NodeTree, value: bpy.types.NodeSocket, low: float, high: float) -> bpy.types.NodeSocket:
    """``value`` mapped so that ``low`` becomes 0 and ``high`` becomes 1."""
    node = tree.nodes.new("ShaderNodeMapRange")
    node.inputs["From Min"].default_value = low
    node.inputs["From Max"].default_value = high
    tree.links.new(value, node.inputs["Value"])
    return node.outputs["Result"]


def _noise(
    tree: bpy.types.NodeTree, scale: float | tuple[float, float], detail: float, distortion: float = 0.0
) -> bpy.types.NodeSocket:
    node = _uv_node(tree, "ShaderNodeTexNoise", PATTERN_UV, scale)
    node.noise_dimensions = "2D"
    node.inputs["Scale"].default_value = 1.0
    node.inputs["Detail"].default_value = detail
    node.inputs["Distortion"].default_value = distortion
    return node.outputs[0]


def _wood(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Grain along U, ten times as long as wide."""
    return _ramp(tree, _noise(tree, (1.0 / scale_m, 10.0 / scale_m), 3.0, 0.6), 0.3, 0.75)


def _fabric(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    return _ramp(tree, _noise(tree, 4.0 / scale_m, 4.0), 0.1, 1.3)


def _plaster(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    return _ramp(tree, _noise(tree, 1.0 / scale_m, 5.0), 0.3, 1.3)


def _marble(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Thin veins where distorted noise crosses its middle."""
    noise = _noise(tree, 1.0 / scale_m, 5.0, 1.5)
    centred = _math(tree, "SUBTRACT", noise, 0.5)
    return _ramp(tree, _math(tree, "ABSOLUTE", centred), 0.035, 0.0)


def _tile(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Square tiles with joints of the second colour."""
    node = _uv_node(tree, "ShaderNodeTexBrick", PATTERN_UV, 1.0 / scale_m)
    node.offset = 0.0
    node.inputs["Scale"].default_value = 1.0
    node.inputs["Brick Width"].default_value = 1.0
    node.inputs["Row Height"].default_value = 1.0
    node.inputs["Mortar Size"].default_value = 0.012
    node.inputs["Mortar Smooth"].default_value = 0.0
    return node.outputs["Fac"]


def _checks(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    node = _uv_node(tree, "ShaderNodeTexChecker", PATTERN_UV, 2.0 / scale_m)
    node.inputs["Scale"].default_value = 1.0
    return node.outputs["Fac"]


def _stripes(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Bands across V: one of each colour per ``scale_m``."""
    node = _uv_node(tree, "ShaderNodeSeparateXYZ", PATTERN_UV, 1.0 / scale_m)
    return _math(tree, "GREATER_THAN", _math(tree, "FRACT", node.outputs["Y"]), 0.5)


def _math(
    tree: bpy.types.NodeTree, operation: str, value: bpy.types.NodeSocket, other: float = 0.0
) -> bpy.types.NodeSocket:
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    node.inputs[1].default_value = other
    tree.links.new(value, node.inputs[0])
    return node.outputs["Value"]


PATTERNS: dict[str, Callable[[bpy.types.NodeTree, float], bpy.types.NodeSocket]] = {
    "wood": _wood,
    "fabric": _fabric,
    "tile": _tile,
    "plaster": _plaster,
    "marble": _marble,
    "checks": _checks,
    "stripes": _stripes,
}
