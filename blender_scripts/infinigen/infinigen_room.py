# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes one furnished room with Infinigen 2: ``python infinigen_room.py job.json``.

The job holds ``kind``, ``seed``, ``dimensions_m`` (x, y, height), ``daytime``, ``lamps_on``, ``max_memory_mb`` and
``folder``, where these files go:

- ``room.blend``: plain meshes with materials, lamps and sky; each object's pass index is its object index.
- ``meshes.npz``: the triangles of all objects as rendered, one after the other (see ``_write_meshes``), and those of
  Infinigen's colliders.
- ``room.json``: kind, size, the table of objects, and the floor's outline;
- ``as_made.blend``, only where the job has ``as_made``: the same room with the modifiers and materials as Infinigen
  leaves them, for the benchmark of rendering.

World: Z up, metres, origin on the floor under the middle of the room.
"""

import gc
import json
import sys
from collections import defaultdict
from dataclasses import dataclass
from itertools import count
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np
import procfunc
from infinigen2.scenes import room as infinigen_rooms
from mathutils import Matrix, Vector

from blender_scripts.infinigen.as_made import RAW_FILE, write_as_made
from blender_scripts.infinigen.colors import tame_colors
from blender_scripts.infinigen.light import set_light
from blender_scripts.infinigen.patches import joined_colliders, patch, placed_colliders
from blender_scripts.infinigen.settle import settle
from blender_scripts.infinigen.watchdog import Watchdog
from blender_scripts.worker.categories import GLAZED, LAMPS, WALKABLE, category_of
from blender_scripts.worker.link import Worker, read_job
from blender_scripts.worker.opaque_materials import cut_panes, make_opaque
from blender_scripts.worker.plain_meshes import (
    MAX_STRUCTURE_SUBDIVISION,
    MAX_SUBDIVISION,
    apply_modifiers,
    cap_subdivision,
    thin_leaves,
    thin_out,
    triangle_count,
    unparent,
    world_triangles,
)

STRUCTURE = frozenset({"floor", "wall", "ceiling"})
# Detail an object keeps: triangles per metre of its diagonal, within limits.
TRIANGLES_PER_M = 10_000
MIN_TRIANGLES, MAX_TRIANGLES = 1_000, 40_000
# What all objects together may have; above it each gives up the same share.
ROOM_TRIANGLES = 800_000


@dataclass
class Made:
    """A room between Infinigen and our files: its objects, their categories, its lamps, outline and colliders."""

    objs: list[bpy.types.Object]
    categories: list[str]
    lamps: list[bpy.types.Object]
    floor_polygon_m: np.ndarray
    collider_vertices_m: np.ndarray
    collider_faces: np.ndarray


def main() -> None:
    """Makes the room of the job named on the command line."""
    worker = Worker()
    job = read_job(worker.job_path())
    Watchdog(worker, job["max_memory_mb"]).start()
    made = _generate(job["kind"], job["seed"], job["dimensions_m"])
    # Infinigen's collision trees and node graphs take as much memory as the room.
    gc.collect()
    folder, as_made = Path(job["folder"]), job.get("as_made", False)
    if as_made:
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / RAW_FILE), copy=True)
    _make_plain(made)
    unparent(made.objs + made.lamps)
    _move_origin(made, job["dimensions_m"])
    _settle(made)
    tame_colors(made.objs, made.categories)
    has_windows = "window" in made.categories
    set_light(made.lamps, job["dimensions_m"], job["daytime"], job["lamps_on"], has_windows)
    _tidy(made)
    _write(folder, job, made)
    if as_made:
        write_as_made(folder, job, made.objs, made.categories)


def _generate(kind: str, seed: int, dimensions_m: list[float]) -> Made:
    procfunc.ops.object.clear_scene()
    shapes = patch(kind)
    make_room = getattr(infinigen_rooms, f"room_{kind}_rand")
    result = make_room(np.random.default_rng(seed), dimensions=procfunc.Vector(dimensions_m))
    colliders = joined_colliders(placed_colliders(result.colliders))
    objs, lamps = _keep_only(result)
    return Made(
        objs,
        [category_of(obj.name) for obj in objs],
        lamps,
        np.array(shapes.floor_polygon_m),
        np.array(colliders.vertices, np.float64),
        np.array(colliders.faces, np.int32),
    )


def _keep_only(result: infinigen_rooms.RoomResult) -> tuple[list[bpy.types.Object], list[bpy.types.Object]]:
    """Deletes templates and helpers; returns the room's objects in the order they were made, and its lamps."""
    objs = list({handle.item().name: handle.item() for handle in result.all_objects}.values())
    kept = {obj.name for obj in objs} | {lamp.item().name for lamp in result.lights}
    bpy.context.view_layer.update()
    unparent([obj for obj in bpy.data.objects if obj.name in kept])
    bpy.data.batch_remove([obj for obj in bpy.data.objects if obj.name not in kept])
    for obj in objs:
        obj.hide_render = obj.hide_viewport = False
    bpy.context.view_layer.update()
    bpy.data.orphans_purge(do_recursive=True)
    return objs, [obj for obj in bpy.data.objects if obj.type == "LIGHT"]


def _make_plain(made: Made) -> None:
    for obj, category in zip(made.objs, made.categories, strict=True):
        level = MAX_STRUCTURE_SUBDIVISION if category in STRUCTURE else MAX_SUBDIVISION
        cap_subdivision(obj, level, _triangle_budget(obj))
    apply_modifiers(made.objs)
    bpy.data.orphans_purge(do_recursive=True)
    for obj, category in zip(made.objs, made.categories, strict=True):
        if category in GLAZED:
            cut_panes(obj.data)
    _thin(made)
    for material in bpy.data.materials:
        if material.use_nodes:
            make_opaque(material)


def _thin(made: Made) -> None:
    budgets = [_triangle_budget(obj) for obj in made.objs]
    wanted = sum(min(budget, triangle_count(obj.data)) for budget, obj in zip(budgets, made.objs, strict=True))
    fraction = min(1.0, ROOM_TRIANGLES / max(wanted, 1))
    for thin, plants in ((thin_out, False), (thin_leaves, True)):
        some = [k for k, category in enumerate(made.categories) if (category == "plant") == plants]
        thin([made.objs[k] for k in some], [int(fraction * budgets[k]) for k in some])


def _triangle_budget(obj: bpy.types.Object) -> int:
    return int(np.clip(TRIANGLES_PER_M * obj.dimensions.length, MIN_TRIANGLES, MAX_TRIANGLES))


def _move_origin(made: Made, dimensions_m: list[float]) -> None:
    """Infinigen's origin is a corner, and its floor lies a little below zero."""
    half_m = np.array([0.5 * dimensions_m[0], 0.5 * dimensions_m[1], 0.0])
    shift = Matrix.Translation(-Vector(half_m))
    for obj in made.objs + made.lamps:
        obj.matrix_world = shift @ obj.matrix_world
    made.floor_polygon_m -= half_m[:2]
    made.collider_vertices_m -= half_m
    bpy.context.view_layer.update()
    for obj, category in zip(made.objs, made.categories, strict=True):
        if category == "floor":
            top_m = world_triangles(obj)[0][:, 2].max()
            obj.matrix_world = Matrix.Translation(Vector((0.0, 0.0, -top_m))) @ obj.matrix_world
    bpy.context.view_layer.update()


def _settle(made: Made) -> None:
    gone = {obj.name for obj in settle(made.objs, made.categories, made.lamps)}
    kept = [k for k, obj in enumerate(made.objs) if obj.name not in gone]
    left_out = [obj for obj in made.objs if obj.name in gone]
    made.objs, made.categories = [made.objs[k] for k in kept], [made.categories[k] for k in kept]
    bpy.data.batch_remove(left_out)


def _tidy(made: Made) -> None:
    for index, (obj, category) in enumerate(zip(made.objs, made.categories, strict=True), start=1):
        obj.pass_index = index
        obj.visible_shadow = category not in LAMPS
    for image in bpy.data.images:
        if image.has_data and image.source in {"FILE", "GENERATED"} and image.packed_file is None:
            image.pack()
    bpy.data.orphans_purge(do_recursive=True)


def _write(folder: Path, job: dict, made: Made) -> None:
    _write_meshes(folder / "meshes.npz", made)
    numbers = defaultdict(count)
    table = [
        {
            "object_index": obj.pass_index,
            # Infinigen's own names ("_table_coffee_legged_rand", "storage_rand.003") say little to a reader.
            "name": f"{category}_{next(numbers[category])}",
            "category": category,
            "walkable": category in WALKABLE,
            "opaque": True,
        }
        for obj, category in zip(made.objs, made.categories, strict=True)
    ]
    room = {
        "kind": job["kind"],
        "floor_polygon_m": made.floor_polygon_m.tolist(),
        "height_m": job["dimensions_m"][2],
        "objects": table,
    }
    (folder / "room.json").write_text(json.dumps(room, indent=1), encoding="utf-8")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "room.blend"), compress=True, relative_remap=False)


def _write_meshes(path: Path, made: Made) -> None:
    """One array of all vertices and one of all triangles; ``*_start`` holds where each object's begin, and the end."""
    meshes = [world_triangles(obj) for obj in made.objs]
    np.savez(
        path,
        vertices_m=np.concatenate([vertices_m for vertices_m, _ in meshes]),
        faces=np.concatenate([faces for _, faces in meshes]),
        vertex_start=np.cumsum([0] + [len(vertices_m) for vertices_m, _ in meshes]),
        face_start=np.cumsum([0] + [len(faces) for _, faces in meshes]),
        collider_vertices_m=made.collider_vertices_m,
        collider_faces=made.collider_faces,
    )


if __name__ == "__main__":
    main()
