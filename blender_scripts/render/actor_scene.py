# SPDX-License-Identifier: GPL-3.0-or-later
"""The actors of a render job: one object each, of which only vertex positions change from frame to frame."""

import bpy
import numpy as np

from blender_scripts.render.cheap_materials import build_material
from blender_scripts.render.mesh_arrays import (
    add_image_uv,
    add_object,
    add_pattern_uv,
    build_mesh,
    set_velocity,
    set_vertices,
    shade_smooth,
)
from blender_scripts.worker.job_arrays import JobArrays


class Actor:
    """An actor in the scene. Patterns stick to the first frame's pose; they do not swim through the cloth."""

    def __init__(self, settings: dict, arrays: JobArrays) -> None:
        self._vertices_m = arrays.load(settings["vertices_m"])
        parts = settings["parts"]
        part_faces = [arrays.load(part["faces"]) for part in parts]
        faces = np.concatenate(part_faces)
        self._mesh = build_mesh(settings["name"], self._vertices_m[0], faces)
        shade_smooth(self._mesh)
        add_pattern_uv(self._mesh, self._vertices_m[0], faces)
        add_image_uv(self._mesh, np.concatenate([arrays.load(part["uv"]) for part in parts]))
        slots = np.repeat(np.arange(len(parts), dtype=np.int32), [len(part) for part in part_faces])
        self._mesh.polygons.foreach_set("material_index", slots)
        for part in parts:
            self._mesh.materials.append(
                build_material(part["material"], arrays.load_optional(part["material"]["image"]))
            )
        add_object(settings["name"], self._mesh, settings["object_index"])

    def pose(self, frame: int, moving: bool = False) -> None:
        """Moves the actor to a frame (0-based); ``moving``: tells Cycles how each vertex moves, for motion blur."""
        set_vertices(self._mesh, self._vertices_m[frame])
        if moving:
            before, after = max(frame - 1, 0), min(frame + 1, len(self._vertices_m) - 1)
            moved_m = (self._vertices_m[after] - self._vertices_m[before]) / max(after - before, 1)
            set_velocity(self._mesh, moved_m)


def add_actors(actors: list[dict], arrays: JobArrays) -> list[Actor]:
    """All actors of a job."""
    return [Actor(settings, arrays) for settings in actors]


def pose_all(actors: list[Actor], frame: int, moving: bool = False) -> None:
    """Moves every actor to a frame and brings the scene up to date."""
    for actor in actors:
        actor.pose(frame, moving)
    bpy.context.view_layer.update()
