# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked images as files named by what they show, so that what was baked once is found again.

Cycles reads the files by itself when it renders: Blender holds no copy of them, and normals stay at half precision.
"""

import hashlib
from pathlib import Path

import bpy
import numpy as np

from blender_scripts.bake.bake_work import Work
from blender_scripts.bake.shader_channels import COLOR, NORMAL

SUFFIX = {COLOR: ".png", NORMAL: ".exr"}


class ImageFiles:
    """The images of one room's meshes in a folder; ``content`` stands for the room and the code that bakes it."""

    def __init__(self, folder: Path, content: str) -> None:
        self._folder, self._content = folder, content

    def name(self, work: Work, channel: str) -> str:
        """The file's name: equal for equal images."""
        digest = hashlib.sha256(f"{self._content} {work.obj.name} {sorted(work.slots)}".encode())
        for values in (work.texels_per_m, *([work.texels_per_pixel] if channel == NORMAL else [])):
            digest.update(np.ascontiguousarray(values).tobytes())
        return f"{digest.hexdigest()[:24]}_{channel}{SUFFIX.get(channel, '.png')}"

    def has(self, work: Work, channel: str) -> bool:
        """Whether the image was baked before."""
        return (self._folder / self.name(work, channel)).is_file()

    def load(self, work: Work, channel: str) -> bpy.types.Image:
        """The image of a mesh."""
        image = bpy.data.images.load(str(self._folder / self.name(work, channel)))
        image.colorspace_settings.name = "sRGB" if channel == COLOR else "Non-Color"
        return image

    def store(self, work: Work, channel: str, image: bpy.types.Image) -> None:
        """Writes a baked image; it appears by rename."""
        path = self._folder / self.name(work, channel)
        temporary = path.with_name(f".{path.name}")
        if channel == NORMAL:
            settings = bpy.context.scene.render.image_settings
            settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "16"
            settings.exr_codec = "ZIP"
            image.save_render(str(temporary))
        else:
            image.file_format = "PNG"
            image.save(filepath=str(temporary))
        temporary.replace(path)


def refer_relatively() -> None:
    """Makes the open file name images by their place beside it."""
    for image in bpy.data.images:
        if image.source == "FILE" and image.packed_file is None and image.filepath:
            image.filepath = f"//{Path(image.filepath).name}"
