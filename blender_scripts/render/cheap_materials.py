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
        fraction = PATTERNS[settings["pattern"]](tree, settings["scale_m"])
        mix = tree.nodes.new("ShaderNodeMixRGB")
        mix.inputs["Color1"].default_value = (*settings["base_color"], 1.0)
        mix.inputs["Color2"].default_value = (*settings["second_color"], 1.0)
        tree.links.new(fraction, mix.inputs["Fac"])
        tree.links.new(mix.outputs["Color"], node.inputs["Base Color"])
        node.inputs["Sheen Weight"].default_value = SHEEN.get(settings["pattern"], 0.0)
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


def _mix(
    tree: bpy.types.NodeTree,
    fraction: bpy.types.NodeSocket | float,
    first: bpy.types.NodeSocket,
    second: bpy.types.NodeSocket,
) -> bpy.types.NodeSocket:
    """``first`` where the share is 0, ``second`` where it is 1; values, not colours."""
    node = tree.nodes.new("ShaderNodeMix")
    if isinstance(fraction, float):
        node.inputs[0].default_value = fraction
    else:
        tree.links.new(fraction, node.inputs[0])
    tree.links.new(first, node.inputs[2])
    tree.links.new(second, node.inputs[3])
    return node.outputs[0]


def _wood(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Grain along U: wide bent bands, and fine fibres."""
    bands = _ramp(tree, _noise(tree, (1.0 / (9.0 * scale_m), 1.0 / scale_m), 1.0, 1.2), 0.25, 0.75)
    rings = _math(tree, "PINGPONG", _math(tree, "MULTIPLY", bands, 4.0), 1.0)
    fibres = _ramp(tree, _noise(tree, (0.5 / scale_m, 22.0 / scale_m), 1.0), 0.3, 0.7)
    return _mix(tree, 0.45, rings, fibres)


def _planks(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Boards ``scale_m`` wide along U, each with a tint and grain of its own, and dark joints."""
    bricks = _bricks(tree, scale_m, 9.0, 0.37, 0.012)
    tint = bricks.outputs["Color"]
    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.uv_map = PATTERN_UV
    stretch = tree.nodes.new("ShaderNodeVectorMath")
    stretch.operation = "MULTIPLY_ADD"
    stretch.inputs[1].default_value = (0.9, 16.0, 1.0)
    tree.links.new(uv.outputs["UV"], stretch.inputs[0])
    shift = tree.nodes.new("ShaderNodeVectorMath")
    shift.operation = "SCALE"
    shift.inputs["Scale"].default_value = 57.0
    tree.links.new(tint, shift.inputs[0])
    tree.links.new(shift.outputs["Vector"], stretch.inputs[2])
    grain = tree.nodes.new("ShaderNodeTexNoise")
    grain.noise_dimensions = "2D"
    grain.inputs["Scale"].default_value = 1.0
    grain.inputs["Detail"].default_value = 2.0
    grain.inputs["Distortion"].default_value = 0.8
    tree.links.new(stretch.outputs["Vector"], grain.inputs["Vector"])
    grey = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tint, grey.inputs[0])
    board = _mix(tree, 0.5, grey.outputs["X"], _ramp(tree, grain.outputs[0], 0.3, 0.7))
    return _math(tree, "ADD", board, 0.0, _math(tree, "MULTIPLY", bricks.outputs["Fac"], 1.2))


def _bricks(
    tree: bpy.types.NodeTree, row_m: float, aspect: float, offset: float, mortar: float
) -> bpy.types.ShaderNodeTexBrick:
    """Rows ``row_m`` high of bricks ``aspect`` times as wide, in greys of their own; "Fac" is 1 on the joints."""
    node = _uv_node(tree, "ShaderNodeTexBrick", PATTERN_UV, 1.0 / row_m)
    node.offset = offset
    node.inputs["Color1"].default_value = (0.0, 0.0, 0.0, 1.0)
    node.inputs["Color2"].default_value = (1.0, 1.0, 1.0, 1.0)
    node.inputs["Mortar"].default_value = (0.5, 0.5, 0.5, 1.0)
    node.inputs["Scale"].default_value = 1.0
    node.inputs["Brick Width"].default_value = aspect
    node.inputs["Row Height"].default_value = 1.0
    node.inputs["Mortar Size"].default_value = mortar
    node.inputs["Mortar Smooth"].default_value = 0.1
    return node


def _fabric(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Threads in both directions: what is seen of a weave from across a room."""
    warp = _noise(tree, (1.5 / scale_m, 9.0 / scale_m), 1.0)
    weft = _noise(tree, (9.0 / scale_m, 1.5 / scale_m), 1.0)
    return _ramp(tree, _math(tree, "ADD", warp, 0.0, weft), 0.6, 1.5)


def _velvet(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Large soft patches, as of a nap that is brushed this way and that."""
    return _ramp(tree, _noise(tree, 1.0 / scale_m, 1.0, 0.5), 0.3, 0.9)


def _plaster(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    return _ramp(tree, _noise(tree, 1.0 / scale_m, 4.0), 0.3, 1.0)


def _marble(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Thin veins where distorted noise crosses its middle, on clouds."""
    noise = _noise(tree, 1.0 / scale_m, 4.0, 1.2)
    veins = _ramp(tree, _math(tree, "ABSOLUTE", _math(tree, "SUBTRACT", noise, 0.5)), 0.04, 0.0)
    clouds = _ramp(tree, noise, 0.35, 1.6)
    return _math(tree, "MAXIMUM", veins, 0.0, clouds)


def _terrazzo(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Chips of many tones in a ground."""
    node = _uv_node(tree, "ShaderNodeTexVoronoi", PATTERN_UV, 1.0 / scale_m)
    node.voronoi_dimensions = "2D"
    node.inputs["Scale"].default_value = 1.0
    chip = _math(tree, "LESS_THAN", node.outputs["Distance"], 0.33)
    tone = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(node.outputs["Color"], tone.inputs[0])
    return _math(tree, "MULTIPLY", chip, 0.0, tone.outputs["X"])


def _brushed(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Fine scratches along U."""
    return _noise(tree, (1.0 / scale_m, 60.0 / scale_m), 1.0)


def _tile(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Square tiles of slightly different tones, with joints of the second colour."""
    return _tinted_bricks(tree, _bricks(tree, scale_m, 1.0, 0.0, 0.014))


def _brick_wall(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Tiles twice as wide as high, each row shifted by half of one."""
    return _tinted_bricks(tree, _bricks(tree, scale_m, 2.0, 0.5, 0.02))


def _tinted_bricks(tree: bpy.types.NodeTree, bricks: bpy.types.Node) -> bpy.types.NodeSocket:
    grey = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(bricks.outputs["Color"], grey.inputs[0])
    return _math(tree, "MAXIMUM", _math(tree, "MULTIPLY", grey.outputs["X"], 0.16), 0.0, bricks.outputs["Fac"])


def _wicker(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Canes over and under posts: bumps of light in staggered rows."""
    node = _uv_node(tree, "ShaderNodeSeparateXYZ", PATTERN_UV, 2.0 * math.pi / scale_m)
    row = _math(tree, "SINE", _math(tree, "MULTIPLY", node.outputs["Y"], 2.0))
    column = _math(tree, "SINE", node.outputs["X"])
    return _ramp(tree, _math(tree, "MULTIPLY", row, 0.0, column), -0.6, 0.9)


def _checks(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    node = _uv_node(tree, "ShaderNodeTexChecker", PATTERN_UV, 2.0 / scale_m)
    node.inputs["Scale"].default_value = 1.0
    return node.outputs["Fac"]


def _stripes(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Bands across V: one of each colour per ``scale_m``."""
    node = _uv_node(tree, "ShaderNodeSeparateXYZ", PATTERN_UV, 1.0 / scale_m)
    return _math(tree, "GREATER_THAN", _math(tree, "FRACT", node.outputs["Y"]), 0.5)


def _wallpaper(tree: bpy.types.NodeTree, scale_m: float) -> bpy.types.NodeSocket:
    """Upright stripes, each with a thin line beside it."""
    node = _uv_node(tree, "ShaderNodeSeparateXYZ", PATTERN_UV, 1.0 / scale_m)
    place = _math(tree, "FRACT", node.outputs["X"])
    stripe = _math(tree, "GREATER_THAN", place, 0.62)
    line = _math(tree, "LESS_THAN", _math(tree, "ABSOLUTE", _math(tree, "SUBTRACT", place, 0.55)), 0.012)
    return _math(tree, "MAXIMUM", stripe, 0.0, line)


def _math(
    tree: bpy.types.NodeTree,
    operation: str,
    value: bpy.types.NodeSocket,
    other: float = 0.0,
    second: bpy.types.NodeSocket | None = None,
) -> bpy.types.NodeSocket:
    """An operation on a value and a number, or on two values."""
    node = tree.nodes.new("ShaderNodeMath")
    node.operation = operation
    node.inputs[1].default_value = other
    tree.links.new(value, node.inputs[0])
    if second is not None:
        tree.links.new(second, node.inputs[1])
    return node.outputs["Value"]


PATTERNS: dict[str, Callable[[bpy.types.NodeTree, float], bpy.types.NodeSocket]] = {
    "wood": _wood,
    "planks": _planks,
    "fabric": _fabric,
    "velvet": _velvet,
    "tile": _tile,
    "bricks": _brick_wall,
    "plaster": _plaster,
    "marble": _marble,
    "terrazzo": _terrazzo,
    "brushed": _brushed,
    "wicker": _wicker,
    "checks": _checks,
    "stripes": _stripes,
    "wallpaper": _wallpaper,
}
# Cloth catches light at its edges.
SHEEN = {"fabric": 0.25, "velvet": 0.8}
