# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render leaves: a JPEG with the view transform, and exact depth and object index as 32-bit floats."""

from pathlib import Path

import bpy

# JPEG markers (ITU-T T.81, table B.1).
APPLICATION_1, APPLICATION_15, COMMENT, START_OF_SCAN = 0xE1, 0xEF, 0xFE, 0xDA
GROUND_TRUTH_PREFIX = "ground_truth_"


class FrameOutput:
    """Routes Depth and Object Index to an EXR file and encodes the picture."""

    def __init__(self, jpeg_quality: int) -> None:
        scene = bpy.context.scene
        layer = scene.view_layers[0]
        layer.use_pass_z = layer.use_pass_object_index = True
        scene.use_nodes = True
        scene.render.use_compositing = True
        tree = scene.node_tree
        tree.nodes.clear()
        layers = tree.nodes.new("CompositorNodeRLayers")
        picture = tree.nodes.new("CompositorNodeComposite")
        self._gains = tree.nodes.new("CompositorNodeMixRGB")
        self._gains.blend_type = "MULTIPLY"
        tree.links.new(layers.outputs["Image"], self._gains.inputs[1])
        tree.links.new(self._gains.outputs["Image"], picture.inputs["Image"])
        self._file = _exr_node(tree)
        tree.links.new(layers.outputs["Depth"], self._file.inputs["depth"])
        tree.links.new(layers.outputs["IndexOB"], self._file.inputs["index"])
        image = scene.render.image_settings
        image.file_format = "JPEG"
        image.color_mode = "RGB"
        image.quality = jpeg_quality

    def set_gains(self, gains: tuple[float, float, float]) -> None:
        """Factors of red, green and blue in linear light (white balance)."""
        self._gains.inputs[2].default_value = (*gains, 1.0)

    def render(self, folder: Path, stem: str) -> tuple[Path, Path]:
        """Renders the scene's camera to ``stem``.jpg and ``stem``.exr in a folder."""
        self._file.base_path = str(folder / GROUND_TRUTH_PREFIX)
        bpy.ops.render.render(write_still=False)
        jpeg, exr = folder / f"{stem}.jpg", folder / f"{stem}.exr"
        bpy.data.images["Render Result"].save_render(str(jpeg))
        # The node adds Blender's frame number to the name it was given.
        written = folder / f"{GROUND_TRUTH_PREFIX}{bpy.context.scene.frame_current:04d}.exr"
        written.replace(exr)
        jpeg.write_bytes(without_metadata(jpeg.read_bytes()))
        return jpeg, exr


def without_metadata(jpeg: bytes) -> bytes:
    """A JPEG less its comments and application data (but JFIF): Blender stamps the date and render time into them."""
    kept = [jpeg[:2]]
    position = 2
    while jpeg[position] == 0xFF and jpeg[position + 1] != START_OF_SCAN:
        marker, length = jpeg[position + 1], int.from_bytes(jpeg[position + 2 : position + 4], "big")
        if marker != COMMENT and not APPLICATION_1 <= marker <= APPLICATION_15:
            kept.append(jpeg[position : position + 2 + length])
        position += 2 + length
    return b"".join([*kept, jpeg[position:]])


def _exr_node(tree: bpy.types.NodeTree) -> bpy.types.Node:
    node = tree.nodes.new("CompositorNodeOutputFile")
    node.format.file_format = "OPEN_EXR_MULTILAYER"
    node.format.color_depth = "32"
    node.format.exr_codec = "ZIP"
    node.file_slots.clear()
    node.file_slots.new("depth")
    node.file_slots.new("index")
    return node
