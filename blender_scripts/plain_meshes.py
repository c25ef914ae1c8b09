# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns modified, parented objects into plain meshes that Cycles loads fast, and reads their triangles."""

import bpy
import numpy as np

# Levels beyond this serve true displacement alone, which is not rendered.
MAX_SUBDIVISION = 3
# Flat structure keeps its look with less.
MAX_STRUCTURE_SUBDIVISION = 2


def cap_subdivision(thing: bpy.types.Object, max_level: int, max_triangles: int) -> None:
    """Lowers subdivision so that the object stays below a number of triangles where its base mesh allows."""
    faces = max(1, len(thing.data.polygons))
    for modifier in thing.modifiers:
        if modifier.type == "SUBSURF":
            level = min(modifier.render_levels, max_level)
            while level > 0 and 2 * faces * 4**level > max_triangles:
                level -= 1
            modifier.levels = modifier.render_levels = level
        # Applying evaluates what the viewport shows, and it shall see what is rendered.
        modifier.show_viewport = modifier.show_render


def apply_modifiers(things: list[bpy.types.Object]) -> None:
    """Gives every object the mesh it renders as, without modifiers; equal objects share one mesh."""
    keys = [_sharing_key(thing) for thing in things]
    first = dict(zip(reversed(keys), reversed(things), strict=True))
    for key, thing in zip(keys, things, strict=True):
        if first[key] is not thing:
            # Evaluating each copy would take memory for all of them at once.
            thing.modifiers.clear()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    meshes = {
        key: bpy.data.meshes.new_from_object(
            thing.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
        )
        for key, thing in first.items()
    }
    for key, thing in zip(keys, things, strict=True):
        thing.modifiers.clear()
        thing.data = meshes[key]


def _sharing_key(thing: bpy.types.Object) -> tuple:
    """Equal for objects that evaluate to the same mesh, as far as can be told."""
    if any(modifier.type != "SUBSURF" for modifier in thing.modifiers):
        return (thing.name,)
    materials = tuple(slot.material.name if slot.material is not None else "" for slot in thing.material_slots)
    levels = tuple(modifier.render_levels for modifier in thing.modifiers)
    return thing.data.name, materials, levels


def thin_out(things: list[bpy.types.Object], max_triangles: list[int]) -> None:
    """Collapses edges of meshes that have more triangles than allowed; objects that share a mesh change alike."""
    heavy: dict[str, bpy.types.Object] = {}
    for thing, limit in zip(things, max_triangles, strict=True):
        triangles = sum(len(face.vertices) - 2 for face in thing.data.polygons)
        if triangles > limit and thing.data.name not in heavy:
            thing.modifiers.new("thin_out", "DECIMATE").ratio = limit / triangles
            heavy[thing.data.name] = thing
    depsgraph = bpy.context.evaluated_depsgraph_get()
    thinner = [
        bpy.data.meshes.new_from_object(
            thing.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
        )
        for thing in heavy.values()
    ]
    for thing, mesh in zip(heavy.values(), thinner, strict=True):
        thing.modifiers.clear()
        thing.data.user_remap(mesh)


def unparent(things: list[bpy.types.Object]) -> None:
    """Takes objects out of their hierarchy and leaves them where they are."""
    placed = [(thing, thing.matrix_world.copy()) for thing in things]
    for thing, _ in placed:
        thing.parent = None
        thing.constraints.clear()
        thing.animation_data_clear()
    for thing, matrix in placed:
        thing.matrix_world = matrix


def world_triangles(thing: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """World vertices f64[P, 3] in metres and triangles i32[F, 3] as Cycles renders them, outside kept outside."""
    mesh = thing.data
    mesh.calc_loop_triangles()
    local = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", local)
    faces = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", faces)
    matrix = np.array(thing.matrix_world, np.float64)
    vertices_m = local.reshape(-1, 3).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    faces = faces.reshape(-1, 3)
    if np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1]
    return vertices_m, np.ascontiguousarray(faces)
