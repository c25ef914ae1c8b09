# SPDX-License-Identifier: GPL-3.0-or-later
"""What a render leaves: a JPEG with the view transform, and exact depth and object index as 32-bit floats."""

from pathlib import Path

import bpy
import numpy as np

# JPEG markers (ITU-T T.81, table B.1).
APPLICATION_1, APPLICATION_15, COMMENT, START_OF_SCAN = 0xE1, 0xEF, 0xFE, 0xDA
GROUND_TRUTH_PREFIX = "ground_truth_"


class Picture:
    """Develops a scene's renders: exposure and white balance, the sensor's noise, the view transform, JPEG.

    Exposure is a factor in linear light rather than the view's own, so that noise can come after it.
    """

    def __init__(self, scene: bpy.types.Scene, settings: dict) -> None:
        self._scene = scene
        self._sensor = settings["sensor"]
        tree = scene.node_tree
        self._gains = tree.nodes.new("CompositorNodeMixRGB")
        self._gains.blend_type = "MULTIPLY"
        tree.links.new(_layers_of(tree).outputs["Image"], self._gains.inputs[1])
        developed = self._gains.outputs["Image"]
        self._noise: list[bpy.types.Image] = []
        if self._sensor["shot_noise"] > 0.0 or self._sensor["read_noise"] > 0.0:
            developed = self._add_noise(tree, developed)
        tree.links.new(developed, tree.nodes.new("CompositorNodeComposite").inputs["Image"])
        self._set_up_file(settings)

    def _set_up_file(self, settings: dict) -> None:
        view = self._scene.view_settings
        view.view_transform, view.look = settings["view_transform"], settings["look"]
        view.exposure, view.gamma = 0.0, 1.0
        view.use_curve_mapping = False
        image = self._scene.render.image_settings
        image.file_format = "JPEG"
        image.color_mode = "RGB"
        image.quality = settings["jpeg_quality"]

    def _add_noise(self, tree: bpy.types.NodeTree, light: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        """Noise whose variance is a constant (reading) and a part that grows with the light (photons are counted)."""
        self._noise = [
            bpy.data.images.new(f"{kind}_noise", 1, 1, float_buffer=True, is_data=True) for kind in ("shot", "read")
        ]
        shot, read = tree.nodes.new("CompositorNodeImage"), tree.nodes.new("CompositorNodeImage")
        shot.image, read.image = self._noise
        root = tree.nodes.new("CompositorNodeGamma")
        root.inputs["Gamma"].default_value = 0.5
        scaled, first, second = (tree.nodes.new("CompositorNodeMixRGB") for _ in range(3))
        scaled.blend_type = "MULTIPLY"
        first.blend_type = second.blend_type = "ADD"
        for node, one, other in (
            (scaled, root.outputs["Image"], shot.outputs["Image"]),
            (first, light, scaled.outputs["Image"]),
            (second, first.outputs["Image"], read.outputs["Image"]),
        ):
            tree.links.new(one, node.inputs[1])
            tree.links.new(other, node.inputs[2])
        tree.links.new(light, root.inputs["Image"])
        return second.outputs["Image"]

    def develop_with(self, gains: tuple[float, float, float], noise: np.random.Generator) -> None:
        """Sets the factors of red, green and blue in linear light (1 becomes white) and draws the sensor's noise."""
        self._gains.inputs[2].default_value = (*gains, 1.0)
        render = self._scene.render
        for image, sigma in zip(self._noise, (self._sensor["shot_noise"], self._sensor["read_noise"]), strict=False):
            if tuple(image.size) != (render.resolution_x, render.resolution_y):
                image.scale(render.resolution_x, render.resolution_y)
            values = np.zeros((render.resolution_y, render.resolution_x, 4), np.float32)
            values[..., :3] = sigma * noise.standard_normal((*values.shape[:2], 3), np.float32)
            image.pixels.foreach_set(values.ravel())
            image.update()

    def save(self, path: Path) -> None:
        """Encodes what was rendered last, once, without PNG or other files on the way."""
        bpy.data.images["Render Result"].save_render(str(path), scene=self._scene)
        path.write_bytes(without_metadata(path.read_bytes()))


class GroundTruth:
    """Routes a scene's depth and object index to an EXR file."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self._scene = scene
        layer = scene.view_layers[0]
        layer.use_pass_z = layer.use_pass_object_index = True
        tree = scene.node_tree
        self._file = _exr_node(tree)
        tree.links.new(_layers_of(tree).outputs["Depth"], self._file.inputs["depth"])
        tree.links.new(_layers_of(tree).outputs["IndexOB"], self._file.inputs["index"])

    def write_to(self, folder: Path) -> None:
        """Where the scene's next render leaves its file."""
        self._file.base_path = str(folder / GROUND_TRUTH_PREFIX)

    def finish(self, folder: Path, name: str) -> None:
        """Gives the file of the last render, in the folder it was written to, its name."""
        # The node adds Blender's frame number to the name it was given.
        (folder / f"{GROUND_TRUTH_PREFIX}{self._scene.frame_current:04d}.exr").replace(folder / name)


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


def empty_tree(scene: bpy.types.Scene) -> None:
    """Takes what a file brought with it out of a scene's compositor, and leaves the render alone."""
    scene.use_nodes = True
    scene.render.use_compositing = True
    scene.node_tree.nodes.clear()
    scene.node_tree.nodes.new("CompositorNodeRLayers").scene = scene


def _layers_of(tree: bpy.types.NodeTree) -> bpy.types.Node:
    return next(node for node in tree.nodes if node.type == "R_LAYERS")


def _exr_node(tree: bpy.types.NodeTree) -> bpy.types.Node:
    node = tree.nodes.new("CompositorNodeOutputFile")
    node.format.file_format = "OPEN_EXR_MULTILAYER"
    node.format.color_depth = "32"
    node.format.exr_codec = "ZIP"
    node.file_slots.clear()
    node.file_slots.new("depth")
    node.file_slots.new("index")
    return node
