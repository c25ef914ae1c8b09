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


def apply_modifiers(things: list[bpy.types.Object]) -> None:
    """Gives every object the mesh it renders as, without modifiers; equal objects share one mesh."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    shared: dict[tuple, bpy.types.Mesh] = {}
    applied = []
    for thing in things:
        key = _sharing_key(thing)
        mesh = None if key is None else shared.get(key)
        if mesh is None:
            mesh = bpy.data.meshes.new_from_object(
                thing.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
            )
            if key is not None:
                shared[key] = mesh
        applied.append(mesh)
    for thing, mesh in zip(things, applied, strict=True):
        thing.modifiers.clear()
        thing.data = mesh


def _sharing_key(thing: bpy.types.Object) -> tuple | None:
    """Equal for objects that evaluate to the same mesh; None where that cannot be told."""
    if any(modifier.type != "SUBSURF" for modifier in thing.modifiers):
        return None
    materials = tuple(slot.material.name if slot.material is not None else "" for slot in thing.material_slots)
    levels = tuple(modifier.render_levels for modifier in thing.modifiers)
    return thing.data.name, materials, levels


def thin_out(thing: bpy.types.Object, max_triangles: int) -> None:
    """Collapses edges of a mesh that has more than ``max_triangles``; all objects that share it change alike."""
    mesh = thing.data
    triangles = sum(len(face.vertices) - 2 for face in mesh.polygons)
    if triangles <= max_triangles:
        return
    modifier = thing.modifiers.new("thin_out", "DECIMATE")
    modifier.ratio = max_triangles / triangles
    depsgraph = bpy.context.evaluated_depsgraph_get()
    thinner = bpy.data.meshes.new_from_object(
        thing.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
    )
    thing.modifiers.clear()
    mesh.user_remap(thinner)
    bpy.data.meshes.remove(mesh)


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
