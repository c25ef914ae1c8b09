# SPDX-License-Identifier: GPL-3.0-or-later
"""Turns modified, parented objects into plain meshes that Cycles loads fast, and reads their triangles."""

import bmesh
import bpy
import numpy as np

# Levels beyond this serve true displacement alone, which is not rendered.
MAX_SUBDIVISION = 3
# Flat structure keeps its look with less.
MAX_STRUCTURE_SUBDIVISION = 2
# A connected part of a plant with less than this share of its triangles is a leaf, or a bunch of them.
LEAF_FRACTION = 0.03


def cap_subdivision(obj: bpy.types.Object, max_level: int, max_triangles: int) -> None:
    """Lowers subdivision so that the object stays below a number of triangles where its base mesh allows."""
    faces = max(1, len(obj.data.polygons))
    for modifier in obj.modifiers:
        if modifier.type == "SUBSURF":
            level = min(modifier.render_levels, max_level)
            while level > 0 and 2 * faces * 4**level > max_triangles:
                level -= 1
            modifier.levels = modifier.render_levels = level
        # Applying evaluates what the viewport shows, and it shall see what is rendered.
        modifier.show_viewport = modifier.show_render


def apply_modifiers(objs: list[bpy.types.Object]) -> None:
    """Gives every object the mesh it renders as, without modifiers; equal objects share one mesh."""
    keys = [_sharing_key(obj) for obj in objs]
    first = dict(zip(reversed(keys), reversed(objs), strict=True))
    for key, obj in zip(keys, objs, strict=True):
        if first[key] is not obj:
            # Evaluating each copy would take memory for all of them at once.
            obj.modifiers.clear()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    meshes = {
        key: bpy.data.meshes.new_from_object(
            obj.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
        )
        for key, obj in first.items()
    }
    for key, obj in zip(keys, objs, strict=True):
        obj.modifiers.clear()
        obj.data = meshes[key]


def _sharing_key(obj: bpy.types.Object) -> tuple:
    """Equal for objects that evaluate to the same mesh, as far as can be told."""
    if any(modifier.type != "SUBSURF" for modifier in obj.modifiers):
        return (obj.name,)
    materials = tuple(slot.material.name if slot.material is not None else "" for slot in obj.material_slots)
    levels = tuple(modifier.render_levels for modifier in obj.modifiers)
    return obj.data.name, materials, levels


def triangle_count(mesh: bpy.types.Mesh) -> int:
    """Triangles that the mesh renders as."""
    return len(mesh.loops) - 2 * len(mesh.polygons)


def thin_out(objs: list[bpy.types.Object], max_triangles: list[int]) -> None:
    """Collapses edges of meshes that have more triangles than allowed; objects that share a mesh change alike."""
    for obj, limit in _too_heavy(objs, max_triangles):
        obj.modifiers.new("thin_out", "DECIMATE").ratio = limit / triangle_count(obj.data)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        mesh = bpy.data.meshes.new_from_object(
            obj.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
        )
        obj.modifiers.clear()
        _replace_mesh(obj.data, mesh)


def thin_leaves(objs: list[bpy.types.Object], max_triangles: list[int]) -> None:
    """Takes leaves, evenly chosen, from plants that have more triangles than allowed.

    A leaf may be a single face, which collapsing edges would take away before anything else.
    """
    for obj, limit in _too_heavy(objs, max_triangles):
        editable = bmesh.new()
        editable.from_mesh(obj.data)
        parts = _connected_faces(editable)
        total = triangle_count(obj.data)
        leaves = [faces for faces in parts if len(faces) < LEAF_FRACTION * len(editable.faces)]
        in_leaves = sum(len(face.verts) - 2 for faces in leaves for face in faces)
        kept = min(1.0, max(0.0, (limit - (total - in_leaves)) / max(in_leaves, 1)))
        gone = [faces for k, faces in enumerate(leaves) if int((k + 1) * kept) == int(k * kept)]
        bmesh.ops.delete(editable, geom=[face for faces in gone for face in faces], context="FACES")
        editable.to_mesh(obj.data)
        editable.free()


def _too_heavy(objs: list[bpy.types.Object], max_triangles: list[int]) -> list[tuple[bpy.types.Object, int]]:
    """One object of each mesh that has more triangles than its first user may have, and that number."""
    first = {obj.data.name: (obj, limit) for obj, limit in zip(objs[::-1], max_triangles[::-1], strict=True)}
    return [(obj, limit) for obj, limit in first.values() if triangle_count(obj.data) > limit]


def _connected_faces(editable: bmesh.types.BMesh) -> list[list[bmesh.types.BMFace]]:
    parts, seen = [], set()
    for start in editable.faces:
        if start in seen:
            continue
        seen.add(start)
        part, waiting = [start], [start]
        while waiting:
            for edge in waiting.pop().edges:
                for face in edge.link_faces:
                    if face not in seen:
                        seen.add(face)
                        part.append(face)
                        waiting.append(face)
        parts.append(part)
    return parts


def _replace_mesh(old: bpy.types.Mesh, new: bpy.types.Mesh) -> None:
    old.user_remap(new)
    bpy.data.meshes.remove(old)


def unparent(objs: list[bpy.types.Object]) -> None:
    """Takes objects out of their hierarchy and leaves them where they are."""
    placed = [(obj, obj.matrix_world.copy()) for obj in objs]
    for obj, _ in placed:
        obj.parent = None
        obj.constraints.clear()
        obj.animation_data_clear()
    for obj, matrix in placed:
        obj.matrix_world = matrix


def world_triangles(obj: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """World vertices f64[P, 3] in metres and triangles i32[F, 3] as Cycles renders them, outside kept outside."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    local = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", local)
    faces = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("vertices", faces)
    matrix = np.array(obj.matrix_world, np.float64)
    vertices_m = local.reshape(-1, 3).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    faces = faces.reshape(-1, 3)
    if np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1]
    return vertices_m, np.ascontiguousarray(faces)
