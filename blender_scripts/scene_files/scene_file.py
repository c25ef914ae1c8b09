# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a room of a scene file that anyone may have made: ``python scene_file.py job.json``.

The job holds ``path``, ``suffix``, ``root`` (images must lie under it), ``kind``, ``metres_per_unit`` (null: as the
file says), ``up_axis``, ``floor_z_m`` (null: found), ``max_triangles`` and ``folder``, where the files that
``infinigen_room.py`` describes go; ``room.json`` also has ``floor_cells``, the floor's plan. Nothing of the file is
run. Events: ``refused`` with a rule and a message when it cannot become a room, and ``note``.
"""

import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np
from mathutils import Matrix, Vector

from blender_scripts.scene_files.categories import guess_category
from blender_scripts.scene_files.floor import Floor, ceiling_height_m, find_floor
from blender_scripts.scene_files.glass import cut_glass
from blender_scripts.scene_files.importing import Piece, open_scene, settle_images, take_surfaces
from blender_scripts.scene_files.mesh_faces import delete_faces
from blender_scripts.scene_files.refusal import Refused
from blender_scripts.scene_files.room_output import (
    MAX_SUN_W_M2,
    MIN_LAMP_W_M2,
    PANEL_LAMP_W_M2,
    add_panel,
    write_meshes,
)
from blender_scripts.scene_files.scale import check_scale
from blender_scripts.worker.categories import LAMPS, WALKABLE
from blender_scripts.worker.link import Worker, read_job
from blender_scripts.worker.opaque_materials import make_opaque
from blender_scripts.worker.plain_meshes import thin_out, world_triangles

# So many times rooms.max_triangles can be thinned out to it; beyond that too little would be left.
MOST_THINNED = 10
MIN_TRIANGLES = 200
# An object is floor as a whole if this share of what it shows upwards is floor, and nothing of it rises above that.
FLOOR_FRACTION, FLOOR_RISE_M = 0.8, 0.1
# A smaller part of another object is left with it.
MIN_PART_M2 = 0.5
OPEN_SCENE_HEIGHT_M = 2.5


def main() -> None:
    """Makes the room of the job named on the command line."""
    worker = Worker()
    job = read_job(worker.job_path())
    try:
        _make(job, worker)
    except Refused as refusal:
        worker.emit("refused", rule=refusal.rule, message=str(refusal))


def _make(job: dict, worker: Worker) -> None:
    open_scene(Path(job["path"]), job["suffix"])
    metres_per_unit = _metres_per_unit(job)
    pieces, lamps = take_surfaces(metres_per_unit, job["suffix"], job["up_axis"])
    missing = settle_images(Path(job["root"]))
    if missing:
        worker.emit("note", text=f"images outside the file's folder or unreadable are grey: {', '.join(missing[:5])}")
    _thin_out(pieces, job["max_triangles"])
    categories = [guess_category(piece.obj.name, piece.around, _materials(piece.obj)) for piece in pieces]
    pieces, categories = _cut_glass(pieces, categories)
    objs = [piece.obj for piece in pieces]
    corners_m = [vertices_m[faces] for vertices_m, faces in map(world_triangles, objs)]
    floor, height_m = _measure(job, corners_m, categories, metres_per_unit)
    objs, categories = _part_floor(objs, categories, corners_m, floor)
    middle_m = 0.5 * (floor.low_m + floor.high_m)
    _move(objs + lamps, np.append(middle_m, floor.z_m))
    _light(lamps, floor, height_m)
    _tidy(objs, categories)
    _write(job, objs, categories, floor, middle_m, height_m)


def _metres_per_unit(job: dict) -> float:
    if job["metres_per_unit"] is not None:
        return job["metres_per_unit"]
    units = bpy.context.scene.unit_settings
    return units.scale_length if job["suffix"] == "blend" and units.system != "NONE" else 1.0


def _materials(obj: bpy.types.Object) -> list[str]:
    return [material.name for material in obj.data.materials if material is not None]


def _thin_out(pieces: list[Piece], max_triangles: int) -> None:
    counts = [sum(len(face.vertices) - 2 for face in piece.obj.data.polygons) for piece in pieces]
    total = sum(counts)
    if total > MOST_THINNED * max_triangles:
        raise Refused(
            "triangles",
            f"it has {total} triangles; at most {MOST_THINNED} x rooms.max_triangles = {MOST_THINNED * max_triangles} "
            "can be thinned out: simplify it, or raise rooms.max_triangles",
        )
    if total > max_triangles:
        fraction = 0.95 * max_triangles / total
        thin_out([piece.obj for piece in pieces], [max(MIN_TRIANGLES, int(fraction * count)) for count in counts])


def _cut_glass(pieces: list[Piece], categories: list[str]) -> tuple[list[Piece], list[str]]:
    """Panes that one looks through are cut out; other glass becomes opaque."""
    kept = []
    for piece, category in zip(pieces, categories, strict=True):
        if cut_glass(piece.obj, category):
            bpy.data.objects.remove(piece.obj)
        else:
            kept.append((piece, category))
    for material in bpy.data.materials:
        if material.use_nodes:
            make_opaque(material)
    if not kept:
        raise Refused("empty", "all that it shows is clear glass: export solid objects too")
    return [piece for piece, _ in kept], [category for _, category in kept]


def _measure(
    job: dict, corners_m: list[np.ndarray], categories: list[str], metres_per_unit: float
) -> tuple[Floor, float]:
    """The floor and the height above it, once both are known to be those of a room."""
    every_m = np.concatenate(corners_m)
    named = np.repeat([category == "floor" for category in categories], [len(part) for part in corners_m])
    floor = find_floor(every_m, named, job["floor_z_m"])
    if floor is None:
        place = "in its lower part" if job["floor_z_m"] is None else f"near rooms.file.floor_z_m = {job['floor_z_m']}"
        raise Refused(
            "floor",
            f"it has no floor: no level surface of some size lies {place}; check that the scene has one, and "
            "rooms.file.up_axis, or give its height with rooms.file.floor_z_m",
        )
    height_m, closed = ceiling_height_m(every_m, floor)
    doors_m = [
        float(np.ptp(part[:, :, 2])) for part, category in zip(corners_m, categories, strict=True) if category == "door"
    ]
    walled = closed or "wall" in categories or "ceiling" in categories
    check_scale(floor.high_m - floor.low_m, height_m if walled else None, doors_m, metres_per_unit)
    return floor, height_m if walled else max(height_m, OPEN_SCENE_HEIGHT_M)


def _part_floor(
    objs: list[bpy.types.Object], categories: list[str], corners_m: list[np.ndarray], floor: Floor
) -> tuple[list[bpy.types.Object], list[str]]:
    """Makes the floor an object, or some, of its own, with faces that look up."""
    parts, names = list(objs), list(categories)
    start = 0
    for index, (obj, corners) in enumerate(zip(objs, corners_m, strict=True)):
        mine = floor.faces[start : start + len(corners)]
        start += len(corners)
        area_m2 = _seen_from_above_m2(corners)
        if area_m2[mine].sum() < MIN_PART_M2 and categories[index] not in WALKABLE:
            continue
        facing = area_m2 * (_looks_up(corners) == floor.upward)
        low = corners[:, :, 2].max() <= floor.z_m + FLOOR_RISE_M
        if categories[index] in WALKABLE or (low and area_m2[mine].sum() >= FLOOR_FRACTION * facing.sum()):
            names[index] = categories[index] if categories[index] in WALKABLE else "floor"
            if mine.any() and not floor.upward:
                obj.data = obj.data.copy()
                obj.data.flip_normals()
        elif mine.any():
            parts.append(_split(obj, mine, flip=not floor.upward))
            names.append("floor")
    return parts, names


def _seen_from_above_m2(corners_m: np.ndarray) -> np.ndarray:
    sides = corners_m[:, 1:, :2] - corners_m[:, :1, :2]
    return 0.5 * np.abs(sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0])


def _looks_up(corners_m: np.ndarray) -> np.ndarray:
    sides = corners_m[:, 1:, :2] - corners_m[:, :1, :2]
    return sides[:, 0, 0] * sides[:, 1, 1] > sides[:, 0, 1] * sides[:, 1, 0]


def _split(obj: bpy.types.Object, triangles: np.ndarray, flip: bool) -> bpy.types.Object:
    """Moves the faces behind some of an object's triangles into a new object."""
    owner = np.empty(len(obj.data.loop_triangles), np.int32)
    obj.data.loop_triangles.foreach_get("polygon_index", owner)
    chosen = set(owner[triangles].tolist())
    part = bpy.data.objects.new(f"{obj.name}_floor", obj.data.copy())
    part.matrix_world = obj.matrix_world
    bpy.context.scene.collection.objects.link(part)
    obj.data = obj.data.copy()
    delete_faces(obj.data, lambda index: index in chosen)
    delete_faces(part.data, lambda index: index not in chosen)
    if flip:
        part.data.flip_normals()
    return part


def _move(objs: list[bpy.types.Object], origin_m: np.ndarray) -> None:
    shift = Matrix.Translation(Vector((-origin_m).tolist()))
    for obj in objs:
        obj.matrix_world = shift @ obj.matrix_world
    bpy.context.view_layer.update()


def _light(lamps: list[bpy.types.Object], floor: Floor, height_m: float) -> None:
    """Keeps the file's lamps, tames its sun, and adds light from the ceiling where they are too weak."""
    power_w = 0.0
    for lamp in lamps:
        if lamp.data.type == "SUN":
            lamp.data.energy = min(lamp.data.energy, MAX_SUN_W_M2)
        else:
            power_w += lamp.data.energy
    if power_w < MIN_LAMP_W_M2 * floor.area_m2:
        size_m = [*(floor.high_m - floor.low_m).tolist(), height_m]
        add_panel(PANEL_LAMP_W_M2 * floor.area_m2 - power_w, size_m)


def _tidy(objs: list[bpy.types.Object], categories: list[str]) -> None:
    for index, (obj, category) in enumerate(zip(objs, categories, strict=True), start=1):
        obj.pass_index = index
        obj.visible_shadow = category not in LAMPS
    bpy.data.orphans_purge(do_recursive=True)


def _write(
    job: dict,
    objs: list[bpy.types.Object],
    categories: list[str],
    floor: Floor,
    middle_m: np.ndarray,
    height_m: float,
) -> None:
    folder = Path(job["folder"])
    write_meshes(folder / "meshes.npz", objs)
    table = [
        {
            "object_index": obj.pass_index,
            "name": obj.name,
            "category": category,
            "walkable": category in WALKABLE,
            "opaque": True,
        }
        for obj, category in zip(objs, categories, strict=True)
    ]
    (low_x, low_y), (high_x, high_y) = floor.low_m - middle_m, floor.high_m - middle_m
    room = {
        "kind": job["kind"],
        "floor_polygon_m": [(low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)],
        "floor_cells": {
            "corner_m": (floor.corner_m - middle_m).tolist(),
            "cell_m": floor.cell_m,
            "rows": ["".join("#" if cell else "." for cell in row) for row in floor.cells],
        },
        "height_m": height_m,
        "objects": table,
    }
    (folder / "room.json").write_text(json.dumps(room), encoding="utf-8")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "room.blend"), compress=True, relative_remap=False)


if __name__ == "__main__":
    main()
    # After its glTF importer has run, bpy 4.2 crashes as Python ends; all files and events are out by now.
    os._exit(0)
