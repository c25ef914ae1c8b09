"""Places worth a pause: before what there is to see, and at worktops.

An object is looked at from where its front is in sight from eye height, at a distance that suits its size; one stands
at a table or counter as close as the free floor allows, facing its top. What counts is shape first, and the
category's words only where shape cannot tell (a sofa's back is as high as a counter).
"""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from perpetua.geometry.raycast import RayHits
from perpetua.navigation.floor import WalkableFloor
from perpetua.navigation.types import Spot
from perpetua.scene.room import Room, SceneObject

# Words in categories of what nobody stops to look at, and of what is no worktop in spite of its height.
_SHELL = frozenset(
    [
        "wall",
        "floor",
        "ceiling",
        "skirting",
        "plinth",
        "door",
        "curtain",
        "rod",
        "frame",
        "rug",
        "lamp",
        "fittings",
        "tap",
        "towel",
        "towels",
    ]
)
_NO_WORKTOP = frozenset(
    [
        "sofa",
        "couch",
        "armchair",
        "chair",
        "stool",
        "bench",
        "bed",
        "mattress",
        "pillow",
        "cushion",
        "toilet",
        "bathtub",
        "shower",
        "plant",
        "books",
        "basket",
    ]
)
EYE_M = 1.55
# Objects whose size is at least this, at a height where people look.
MIN_SIZE_M = 0.25
SEEN_BAND_M = (0.6, 2.2)
WORKTOP_BAND_M = (0.68, 1.15)
MIN_WORKTOP_M = 0.3
# A worktop is stood at no farther from its edge than this; the target lies so far inside the edge.
ARM_REACH_M = 0.5
TARGET_INSIDE_M = 0.2
# Standing places are tried on this spacing, at most so many per object.
SPACING_M = 0.2
PLACES_PER_OBJECT = 10
# A front is seen well down to this cosine between the line of sight and the surface's normal.
MIN_FRONTAL = 0.5
ON_TARGET_M = 0.35


@dataclass(frozen=True)
class _View:
    """An object, seen from candidate places: ``wish_m`` is where each one looks."""

    obj: SceneObject
    purpose: str
    place_m: Float64[np.ndarray, "N 2"]
    wish_m: Float64[np.ndarray, "N 3"]


def find_spots(room: Room, floor: WalkableFloor) -> tuple[Spot, ...]:
    """Spots to look from and to stand at, in the order of the room's objects."""
    cell = np.round((floor.points_m - floor.grid.origin_m) / floor.grid.cell_m).astype(int)
    coarse = (cell % max(1, round(SPACING_M / floor.grid.cell_m)) == 0).all(axis=1)
    views = [view for obj in room.objects for view in _views(obj, floor, floor.points_m[coarse])]
    if not views:
        return ()
    caster = room.surfaces.caster
    owner, corners_m = room.surfaces.object_index, room.surfaces.corner_m
    spots: list[Spot] = []
    for view in views:
        eye_m = np.column_stack([view.place_m, np.full(len(view.place_m), EYE_M)])
        hits = caster.first_hit(eye_m, view.wish_m - eye_m)
        hit_m = (hits.barycentric[:, :, None] * corners_m[hits.face]).sum(1)
        for index in np.flatnonzero(_seen(view, hits, hit_m, eye_m, owner, corners_m)):
            spots.append(_spot(view, view.place_m[index], hit_m[index]))
    return tuple(spots)


def _words(category: str) -> frozenset[str]:
    return frozenset(re.findall(r"[a-z]+", category.lower()))


def _views(obj: SceneObject, floor: WalkableFloor, places_m: Float64[np.ndarray, "N 2"]) -> list[_View]:
    if obj.walkable or not len(obj.mesh.faces) or _words(obj.category) & _SHELL:
        return []
    views = []
    low, high = obj.mesh.vertices_m.min(0), obj.mesh.vertices_m.max(0)
    size_m = high - low
    outside_m = np.linalg.norm(np.maximum(np.maximum(low[:2] - places_m, places_m - high[:2]), 0.0), axis=1)
    is_worktop = WORKTOP_BAND_M[0] <= high[2] <= WORKTOP_BAND_M[1] and size_m[:2].min() >= MIN_WORKTOP_M
    if is_worktop and not _words(obj.category) & _NO_WORKTOP:
        chosen = _nearest_to(outside_m, 0.0, ARM_REACH_M)
        inset = np.minimum(TARGET_INSIDE_M, 0.5 * size_m[:2])
        wish_m = np.clip(places_m[chosen], low[:2] + inset, high[:2] - inset)
        heights_m = np.full((len(chosen), 1), high[2])
        views.append(_View(obj, "stand", places_m[chosen], np.hstack([wish_m, heights_m])))
    seen_low, seen_high = max(low[2], SEEN_BAND_M[0]), min(high[2], SEEN_BAND_M[1])
    if seen_low < seen_high and size_m.max() >= MIN_SIZE_M and not is_worktop:
        chosen = _nearest_to(outside_m, 0.6 + 0.5 * float(size_m.max()), 2.5)
        middle = np.append(0.5 * (low + high)[:2], np.clip(EYE_M - 0.1, seen_low, seen_high))
        views.append(_View(obj, "look", places_m[chosen], np.tile(middle, (len(chosen), 1))))
    return views


def _nearest_to(distance_m: Float64[np.ndarray, " N"], ideal_m: float, farthest_m: float) -> Int64[np.ndarray, " K"]:
    """The places whose distance suits best."""
    order = np.argsort(np.abs(distance_m - ideal_m), kind="stable")[:PLACES_PER_OBJECT]
    return order[distance_m[order] <= farthest_m]


def _seen(
    view: _View,
    hits: RayHits,
    hit_m: Float64[np.ndarray, "N 3"],
    eye_m: Float64[np.ndarray, "N 3"],
    owner: Int64[np.ndarray, " F"],
    corners_m: Float64[np.ndarray, "F 3 3"],
) -> np.ndarray:
    """From which places the line of sight ends on the object (or on what stands on it), and on its front."""
    near = np.linalg.norm(hit_m - view.wish_m, axis=1) < ON_TARGET_M
    if view.purpose == "stand":
        return np.asarray(hits.hit & near)
    hit_corners_m = corners_m[hits.face]
    normal = np.cross(hit_corners_m[:, 1] - hit_corners_m[:, 0], hit_corners_m[:, 2] - hit_corners_m[:, 0])
    sight = hit_m - eye_m
    frontal = np.abs((normal * sight).sum(1)) > MIN_FRONTAL * np.linalg.norm(normal, axis=1) * np.linalg.norm(
        sight, axis=1
    )
    return np.asarray(hits.hit & (owner[hits.face] == view.obj.object_index) & frontal)


def _spot(view: _View, place_m: Float64[np.ndarray, "2"], target_m: Float64[np.ndarray, "3"]) -> Spot:
    away_m = target_m[:2] - place_m
    x, y, z = (float(value) for value in target_m)
    facing_rad = float(np.arctan2(away_m[1], away_m[0]))
    place = (float(place_m[0]), float(place_m[1]))
    return Spot(place, facing_rad, view.purpose, view.obj.object_index, (x, y, z))
