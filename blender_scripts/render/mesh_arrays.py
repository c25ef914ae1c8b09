# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender meshes from arrays, without Python work per vertex."""

import math

import bpy
import numpy as np

from blender_scripts.render.cheap_materials import IMAGE_UV, PATTERN_UV

SHARP_ANGLE_RAD = math.radians(30.0)


def build_mesh(name: str, vertices_m: np.ndarray, faces: np.ndarray) -> bpy.types.Mesh:
    """A triangle mesh from f32[P, 3] and i32[F, 3]."""
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices_m))
    mesh.loops.add(3 * len(faces))
    mesh.polygons.add(len(faces))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices_m, np.float32).ravel())
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(faces, np.int32).ravel())
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * len(faces), 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh


def set_vertices(mesh: bpy.types.Mesh, vertices_m: np.ndarray) -> None:
    """Moves all vertices of a mesh."""
    mesh.attributes["position"].data.foreach_set("vector", np.ascontiguousarray(vertices_m, np.float32).ravel())
    mesh.update()


def set_velocity(mesh: bpy.types.Mesh, moved_m: np.ndarray) -> None:
    """How far each vertex moves in a frame, f32[P, 3]; Cycles blurs by the attribute of this name, per second."""
    render = bpy.context.scene.render
    velocity = mesh.attributes.get("velocity") or mesh.attributes.new("velocity", "FLOAT_VECTOR", "POINT")
    velocity.data.foreach_set(
        "vector", np.ascontiguousarray(moved_m * (render.fps / render.fps_base), np.float32).ravel()
    )


def shade_smooth(mesh: bpy.types.Mesh, sharp_angle_rad: float | None = None) -> None:
    """Smooth shading everywhere, or except across edges sharper than an angle."""
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    if sharp_angle_rad is not None:
        mesh.set_sharp_from_angle(angle=sharp_angle_rad)


def add_image_uv(mesh: bpy.types.Mesh, uv: np.ndarray) -> None:
    """The UV layer that image textures use, f32[F, 3, 2]."""
    layer = mesh.uv_layers.new(name=IMAGE_UV)
    layer.uv.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())


def add_pattern_uv(mesh: bpy.types.Mesh, vertices_m: np.ndarray, faces: np.ndarray) -> None:
    """The UV layer that patterns use: metres in the plane that each triangle faces most, V up on walls."""
    set_pattern_uv(mesh, box_projection(vertices_m, faces))


def set_pattern_uv(mesh: bpy.types.Mesh, uv_m: np.ndarray) -> None:
    """The UV layer that patterns use, from metres f[F, 3, 2]."""
    layer = mesh.uv_layers.new(name=PATTERN_UV)
    layer.uv.foreach_set("vector", np.ascontiguousarray(uv_m, np.float32).ravel())


def box_projection(vertices_m: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Metres f64[F, 3, 2] of each triangle's corners in the axis plane that the triangle faces most."""
    corners = np.asarray(vertices_m, np.float64)[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.abs(normal).argmax(axis=1)
    plane = np.array([[1, 2], [0, 2], [0, 1]])[axis]
    return np.take_along_axis(corners, np.repeat(plane[:, None, :], 3, axis=1), axis=2)


def add_object(name: str, mesh: bpy.types.Mesh, object_index: int) -> bpy.types.Object:
    """An object in the scene whose object index pass is ``object_index``."""
    obj = bpy.data.objects.new(name, mesh)
    obj.pass_index = object_index
    bpy.context.scene.collection.objects.link(obj)
    return obj
