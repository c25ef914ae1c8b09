# SPDX-License-Identifier: GPL-3.0-or-later
"""A room as Infinigen leaves it: modifiers, displacement, glass and procedural materials untouched.

It has the same objects in the same places, colours and light as the room that is rendered otherwise, so that the
benchmark of rendering compares two ways to render one room.
"""

from pathlib import Path

import bpy
from mathutils import Matrix

from blender_scripts.infinigen.colors import tame_colors
from blender_scripts.infinigen.light import set_light

RAW_FILE, AS_MADE_FILE = "raw.blend", "as_made.blend"


def write_as_made(folder: Path, job: dict, objs: list[bpy.types.Object], categories: list[str]) -> None:
    """Turns the file saved right after Infinigen into ``as_made.blend``; the open file is left."""
    table = {
        obj.name: (category, obj.matrix_world.copy(), obj.pass_index, obj.visible_shadow)
        for obj, category in zip(objs, categories, strict=True)
    }
    lights = {obj.name: obj.matrix_world.copy() for obj in bpy.data.objects if obj.type == "LIGHT"}
    bpy.ops.wm.open_mainfile(filepath=str(folder / RAW_FILE), load_ui=False, use_scripts=False)
    kept = [bpy.data.objects[name] for name in table]
    lamps = [obj for obj in bpy.data.objects if obj.type == "LIGHT"]
    bpy.data.batch_remove([obj for obj in bpy.data.objects if obj not in kept + lamps])
    for obj in kept:
        _, matrix, obj.pass_index, obj.visible_shadow = table[obj.name]
        obj.matrix_world = matrix
    shift = Matrix.Translation((-0.5 * job["dimensions_m"][0], -0.5 * job["dimensions_m"][1], 0.0))
    for lamp in lamps:
        lamp.matrix_world = lights.get(lamp.name, shift @ lamp.matrix_world)
    bpy.context.view_layer.update()
    kept_categories = [table[obj.name][0] for obj in kept]
    tame_colors(kept, kept_categories)
    has_windows = "window" in kept_categories
    set_light(lamps, job["dimensions_m"], job["daytime"], job["lamps_on"], has_windows)
    bpy.data.orphans_purge(do_recursive=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / AS_MADE_FILE), compress=True, relative_remap=False)
    (folder / RAW_FILE).unlink()
