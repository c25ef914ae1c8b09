# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets objects that hang a little in the air down on what is below them, and leaves out small objects that cannot be.

Infinigen places objects by their unsubdivided meshes, so on a sofa whose seat is rounded in the picture a cushion may
hang some centimetres above it. Ceiling lamps that touch nothing are lifted, with their light, to the ceiling instead.
"""

import bpy
import numpy as np
from mathutils import Vector

from blender_scripts.worker.categories import SMALL, STANDING
from blender_scripts.worker.plain_meshes import world_triangles

# What is closer than this to its support stays; what would fall further is not where it was meant to be.
CLOSE_M, FURTHEST_M = 0.01, 0.15
FURTHEST_LAMP_M = 0.6
CEILING_LAMP = "ceiling_lamp"
# A lamp in a shaft is held by the shaft's sides, where they are this close.
TOUCH_M = 0.03
# A lamp's light lies in it or this close to it.
LIGHT_REACH_M = 0.1
PLACES_PER_SIDE = 16
MIN_SPACING_M = 0.01
MAX_SURFACES = 8
# Rays start this much beside a mesh's corners: along its own edges they would meet nothing else.
_ASIDE_M = np.array([0.0007, 0.0004, 0.0])
_PAST_SURFACE_M = 1e-4


def settle(
    objs: list[bpy.types.Object], categories: list[str], lights: list[bpy.types.Object]
) -> list[bpy.types.Object]:
    """Moves objects down to their supports, the lowest first; returns those that should be left out."""
    loose = [
        (world_triangles(obj)[0], obj, category)
        for obj, category in zip(objs, categories, strict=True)
        if category in SMALL | STANDING
    ]
    loose = [entry for entry in loose if len(entry[0])]
    _lift_lamps([obj for obj, category in zip(objs, categories, strict=True) if category == CEILING_LAMP], lights)
    gone = []
    for vertices_m, obj, category in sorted(loose, key=lambda entry: (entry[0][:, 2].min(), entry[1].name)):
        gap_m = _gap_m(obj, vertices_m)
        if CLOSE_M < gap_m <= FURTHEST_M:
            obj.location.z -= gap_m
            bpy.context.view_layer.update()
        elif gap_m > FURTHEST_M and category in SMALL:
            gone.append(obj)
            # Nothing shall settle on it.
            obj.hide_viewport = True
            bpy.context.view_layer.update()
    return gone


def _lift_lamps(lamps: list[bpy.types.Object], lights: list[bpy.types.Object]) -> None:
    for lamp in lamps:
        vertices_m = world_triangles(lamp)[0]
        gap_m = _gap_m(lamp, vertices_m, up=True)
        if CLOSE_M < gap_m <= FURTHEST_LAMP_M and not _held_aside(lamp, vertices_m):
            low_m, high_m = vertices_m.min(axis=0), vertices_m.max(axis=0)
            low_m, high_m = low_m - LIGHT_REACH_M, high_m + LIGHT_REACH_M
            places_m = [np.array(light.location) for light in lights]
            inside = [bool(((low_m <= place_m) & (place_m <= high_m)).all()) for place_m in places_m]
            for obj in [lamp, *(light for light, own in zip(lights, inside, strict=True) if own)]:
                obj.location.z += gap_m
    bpy.context.view_layer.update()


def _held_aside(lamp: bpy.types.Object, vertices_m: np.ndarray) -> bool:
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for place_m in _underside_m(vertices_m):
        for along in (Vector((1, 0, 0)), Vector((-1, 0, 0)), Vector((0, 1, 0)), Vector((0, -1, 0))):
            start = Vector(place_m) - TOUCH_M * along
            hit = bpy.context.scene.ray_cast(depsgraph, start, along, distance=2.0 * TOUCH_M)
            if hit[0] and hit[4].name != lamp.name:
                return True
    return False


def _gap_m(obj: bpy.types.Object, vertices_m: np.ndarray, up: bool = False) -> float:
    """How far the object would fall (or rise); 0 where something crosses that side of it within reach."""
    mirror = np.array([1.0, 1.0, -1.0 if up else 1.0])
    places_m = _underside_m(vertices_m * mirror) * mirror + _ASIDE_M
    along = Vector((0.0, 0.0, 1.0 if up else -1.0))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return min(_way_m(depsgraph, obj, Vector(place_m), along) for place_m in places_m)


def _way_m(depsgraph: bpy.types.Depsgraph, obj: bpy.types.Object, place_m: Vector, along: Vector) -> float:
    # From a little before, so that what the object is sunk into or exactly rests on is met.
    start = place_m - CLOSE_M * along
    travelled_m = 0.0
    for _ in range(MAX_SURFACES):
        hit, where, _, _, other, _ = bpy.context.scene.ray_cast(depsgraph, start, along)
        if not hit:
            return float("inf")
        travelled_m += (where - start).length
        if other.name != obj.name:
            return max(0.0, travelled_m - CLOSE_M)
        start = where + _PAST_SURFACE_M * along
        travelled_m += _PAST_SURFACE_M
    return float("inf")


def _underside_m(vertices_m: np.ndarray) -> np.ndarray:
    """The lowest vertex of each cell of a grid over the ground."""
    low_m, size_m = vertices_m.min(axis=0), np.ptp(vertices_m, axis=0)
    spacing_m = max(float(size_m[:2].max()) / PLACES_PER_SIDE, MIN_SPACING_M)
    vertices_m = vertices_m[np.argsort(vertices_m[:, 2], kind="stable")]
    cell = np.floor((vertices_m - low_m)[:, :2] / spacing_m).astype(np.int64)
    _, first = np.unique(cell[:, 0] * (PLACES_PER_SIDE + 2) + cell[:, 1], return_index=True)
    return vertices_m[np.sort(first)]
