# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes one furnished room with Infinigen 2: ``python infinigen_room.py job.json``.

The job holds ``kind``, ``seed``, ``dimensions_m`` (x, y, height) and ``folder``, where these files go:

- ``room.blend``: plain meshes with materials, lamps and sky; each object's pass index is its object index.
- ``meshes.npz``: the triangles of all objects as rendered, one after the other (see ``write_meshes``).
- ``room.json``: kind, size, and the table of objects.

World: Z up, metres, origin on the floor under the middle of the room.
"""

import json
from pathlib import Path

import bpy
import numpy as np
import procfunc
from infinigen2.objects import boulder, random_primitives
from infinigen2.scenes import room as infinigen_rooms
from infinigen_categories import GLAZED, LAMPS, WALKABLE, category_of
from infinigen_small_things import small_thing_maker
from mathutils import Matrix, Vector
from opaque_materials import cut_panes, make_opaque
from plain_meshes import (
    MAX_STRUCTURE_SUBDIVISION,
    MAX_SUBDIVISION,
    apply_modifiers,
    cap_subdivision,
    thin_out,
    unparent,
    world_triangles,
)
from room_output import MAX_SUN_W_M2, MIN_LAMP_W_M2, PANEL_LAMP_W_M2, add_panel, write_meshes
from worker_link import Worker, read_job

STRUCTURE = frozenset({"floor", "wall", "ceiling"})
# Detail an object keeps: triangles per metre of its diagonal, within limits.
TRIANGLES_PER_M = 10_000
MIN_TRIANGLES, MAX_TRIANGLES = 1_000, 40_000


def main() -> None:
    """Makes the room of the job named on the command line."""
    job = read_job(Worker().job_path())
    folder = Path(job["folder"])
    result = _generate(job["kind"], job["seed"], job["dimensions_m"])
    things = _keep_only(result)
    categories = [category_of(thing.name) for thing in things]
    lamps = [thing for thing in bpy.data.objects if thing.type == "LIGHT"]
    _make_plain(things, categories)
    unparent(things + lamps)
    _move_origin(things, lamps, categories, job["dimensions_m"])
    _light(lamps, job["dimensions_m"])
    _tidy(things, categories)
    _write(folder, job, things, categories)


def _generate(kind: str, seed: int, dimensions_m: list[float]) -> infinigen_rooms.RoomResult:
    procfunc.ops.object.clear_scene()
    # Infinigen's rocks need an add-on that can only be had online, and its other small things are abstract solids.
    boulder.rock_rand = random_primitives.primitive_with_effect_rand = small_thing_maker(kind)
    make_room = getattr(infinigen_rooms, f"room_{kind}_rand")
    return make_room(np.random.default_rng(seed), dimensions=procfunc.Vector(dimensions_m))


def _keep_only(result: infinigen_rooms.RoomResult) -> list[bpy.types.Object]:
    """Deletes templates and helpers; returns the room's objects in the order they were made."""
    things = list({handle.item().name: handle.item() for handle in result.all_objects}.values())
    kept = {thing.name for thing in things} | {lamp.item().name for lamp in result.lights}
    bpy.context.view_layer.update()
    unparent([thing for thing in bpy.data.objects if thing.name in kept])
    bpy.data.batch_remove([thing for thing in bpy.data.objects if thing.name not in kept])
    for thing in things:
        thing.hide_render = thing.hide_viewport = False
    bpy.context.view_layer.update()
    return things


def _make_plain(things: list[bpy.types.Object], categories: list[str]) -> None:
    for thing, category in zip(things, categories, strict=True):
        level = MAX_STRUCTURE_SUBDIVISION if category in STRUCTURE else MAX_SUBDIVISION
        cap_subdivision(thing, level, _triangle_budget(thing))
    apply_modifiers(things)
    for thing, category in zip(things, categories, strict=True):
        if category in GLAZED:
            cut_panes(thing.data)
    # Leaves are single faces: collapsing them leaves bare stalks.
    solid = [thing for thing, category in zip(things, categories, strict=True) if category != "plant"]
    thin_out(solid, [_triangle_budget(thing) for thing in solid])
    for material in bpy.data.materials:
        if material.use_nodes:
            make_opaque(material)


def _triangle_budget(thing: bpy.types.Object) -> int:
    return int(np.clip(TRIANGLES_PER_M * thing.dimensions.length, MIN_TRIANGLES, MAX_TRIANGLES))


def _move_origin(
    things: list[bpy.types.Object], lamps: list[bpy.types.Object], categories: list[str], dimensions_m: list[float]
) -> None:
    """Infinigen's origin is a corner, and its floor lies a little below zero."""
    shift = Matrix.Translation(Vector((-0.5 * dimensions_m[0], -0.5 * dimensions_m[1], 0.0)))
    for thing in things + lamps:
        thing.matrix_world = shift @ thing.matrix_world
    bpy.context.view_layer.update()
    for thing, category in zip(things, categories, strict=True):
        if category == "floor":
            top_m = world_triangles(thing)[0][:, 2].max()
            thing.matrix_world = Matrix.Translation(Vector((0.0, 0.0, -top_m))) @ thing.matrix_world
    bpy.context.view_layer.update()


def _light(lamps: list[bpy.types.Object], dimensions_m: list[float]) -> None:
    """Tames the sun, and adds a ceiling panel where the lamps are too weak."""
    floor_m2 = dimensions_m[0] * dimensions_m[1]
    power_w = 0.0
    for lamp in lamps:
        if lamp.data.type == "SUN":
            lamp.data.energy = min(lamp.data.energy, MAX_SUN_W_M2)
        elif not (lamp.data.type == "AREA" and lamp.data.cycles.is_portal):
            power_w += lamp.data.energy
    if power_w < MIN_LAMP_W_M2 * floor_m2:
        add_panel(PANEL_LAMP_W_M2 * floor_m2 - power_w, dimensions_m)


def _tidy(things: list[bpy.types.Object], categories: list[str]) -> None:
    for index, (thing, category) in enumerate(zip(things, categories, strict=True), start=1):
        thing.pass_index = index
        thing.visible_shadow = category not in LAMPS
    for image in bpy.data.images:
        if image.has_data and image.source in {"FILE", "GENERATED"} and image.packed_file is None:
            image.pack()
    bpy.data.orphans_purge(do_recursive=True)


def _write(folder: Path, job: dict, things: list[bpy.types.Object], categories: list[str]) -> None:
    write_meshes(folder / "meshes.npz", things)
    table = [
        {
            "object_index": thing.pass_index,
            "name": thing.name,
            "category": category,
            "walkable": category in WALKABLE,
            "opaque": True,
        }
        for thing, category in zip(things, categories, strict=True)
    ]
    x_m, y_m, height_m = job["dimensions_m"]
    half_x_m, half_y_m = 0.5 * x_m, 0.5 * y_m
    corners = [(-half_x_m, -half_y_m), (half_x_m, -half_y_m), (half_x_m, half_y_m), (-half_x_m, half_y_m)]
    room = {"kind": job["kind"], "floor_polygon_m": corners, "height_m": height_m, "objects": table}
    (folder / "room.json").write_text(json.dumps(room, indent=1), encoding="utf-8")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "room.blend"), compress=True, relative_remap=False)


if __name__ == "__main__":
    main()
