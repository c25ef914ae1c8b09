"""Where people can sit: flat places at the height of a chair, free above, with free floor in front."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float64, Int64
from scipy.ndimage import maximum_filter

from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.raycast import Caster
from perpetua.navigation.seat_measure import measure_seat
from perpetua.scene.actor import Seat
from perpetua.scene.room import Room, SceneObject

# What people sit on; a mattress or a cushion may be the top of it.
SEAT_CATEGORIES = frozenset(
    [
        "sofa",
        "couch",
        "armchair",
        "chair",
        "desk_chair",
        "dining_chair",
        "office_chair",
        "stool",
        "pouf",
        "ottoman",
        "bench",
        "bed",
        "mattress",
    ]
)
LOWEST_M, HIGHEST_M = 0.38, 0.60
# A sitting person's head stays below this height above the floor.
_FREE_ABOVE_M = 1.4
# What hangs so far under the ceiling is a lamp.
_LAMP_M = 0.5
# Backs of chairs have slats as thin as this.
_CELL_M = 0.018
# Half of the width and depth that has to be flat to sit on, and how flat.
_HALF_WIDTH_M, _HALF_DEPTH_M = 0.165, 0.12
_FLATNESS_M, _FLAT_FRACTION = 0.045, 0.9
# Thighs are this wide together; free floor in front of the edge is so deep and so wide.
_THIGHS_M, _FRONT_DEPTH_M, _FRONT_WIDTH_M = 0.38, 0.42, 0.44
_FLOOR_M, _STEP_DOWN_M = 0.1, 0.2
# The best place to sit: so far behind the front edge, and so far before a backrest.
_TO_EDGE_M, _TO_BACK_M = 0.26, 0.20
_BACKREST_M, _ARM_REST_M = 0.15, 0.34
_NEAREST_BACK_M, _FARTHEST_BACK_M = 0.15, 0.6
_SPACING_M = 0.6
_PER_OBJECT = 3
# One cell in five is tried.
_EVERY = 5


@dataclass(frozen=True)
class _Relief:
    """Heights of what is first met from above, on cells around an object.

    ``low_m`` is met from above a sitter's head, ``peak_m`` is the highest of that in the neighbouring cells, ``tall_m``
    is met from under the ceiling.
    """

    origin_m: Float64[np.ndarray, "2"]
    low_m: Float64[np.ndarray, "X Y"]
    peak_m: Float64[np.ndarray, "X Y"]
    tall_m: Float64[np.ndarray, "X Y"]
    owner: Int64[np.ndarray, "X Y"]

    def cells(self, place_m: Float64[np.ndarray, "... 2"]) -> tuple[Int64[np.ndarray, "..."], Int64[np.ndarray, "..."]]:
        """The cell that holds each place."""
        cell = np.rint((place_m - self.origin_m) / _CELL_M).astype(np.int64)
        cell = np.clip(cell, 0, np.array(self.low_m.shape) - 1)
        return cell[..., 0], cell[..., 1]


@dataclass(frozen=True)
class _Candidates:
    """Places that could be sat on in one direction; lower ``cost`` is better."""

    middle_m: Float64[np.ndarray, "N 3"]
    facing_rad: float
    cost: Float64[np.ndarray, " N"]


def find_seats(room: Room) -> tuple[Seat, ...]:
    """Seats of a room, measured, in the order of its objects: at most three per object, at least 0.6 m apart."""
    sittable = [obj for obj in room.objects if obj.category in SEAT_CATEGORIES and len(obj.mesh.faces) > 0]
    if not sittable:
        return ()
    caster, owner_of_face = room.surfaces.caster, room.surfaces.object_index
    floor_m = float(np.median([_floor_m(obj.mesh) for obj in room.objects if obj.walkable] or [0.0]))
    seats: list[Seat] = []
    for obj in sittable:
        relief = _relief(obj, caster, owner_of_face, floor_m, room.height_m)
        seats += [
            measure_seat(obj.object_index, place.middle_m, place.facing_rad, floor_m, caster)
            for place in _places_on(obj, relief, floor_m, [seat.middle_m for seat in seats])
        ]
    return tuple(seats)


def _floor_m(mesh: TriMesh) -> float:
    return float(mesh.vertices_m[:, 2].max())


def _relief(
    obj: SceneObject, caster: Caster, owner_of_face: Int64[np.ndarray, " F"], floor_m: float, height_m: float
) -> _Relief:
    around_m = 0.9
    low, high = obj.mesh.vertices_m.min(0)[:2] - around_m, obj.mesh.vertices_m.max(0)[:2] + around_m
    count = np.ceil((high - low) / _CELL_M).astype(int) + 1
    x_m, y_m = np.meshgrid(*(low[axis] + _CELL_M * np.arange(count[axis]) for axis in (0, 1)), indexing="ij")
    heights: list[np.ndarray] = []
    owner = np.zeros(x_m.shape, np.int64)
    # Closed furniture that is taller than a sitter is seen from above it alone.
    for start_m in (floor_m + height_m - 0.03, floor_m + _FREE_ABOVE_M):
        origins_m = np.stack([x_m.ravel(), y_m.ravel(), np.full(x_m.size, start_m)], axis=1)
        hits = caster.first_hit(origins_m, np.tile([0.0, 0.0, -1.0], (len(origins_m), 1)))
        heights.append(np.where(hits.hit, start_m - hits.distance_m, np.inf).reshape(x_m.shape) - floor_m)
        owner = np.where(hits.hit, owner_of_face[hits.face], 0).reshape(x_m.shape)
    tall_m = np.where(heights[0] > height_m - _LAMP_M, 0.0, heights[0])
    return _Relief(low, heights[1], maximum_filter(heights[1], 3), tall_m, owner)


@dataclass(frozen=True)
class _Place:
    """Where somebody can sit, and facing which way."""

    middle_m: tuple[float, float, float]
    facing_rad: float


def _places_on(
    obj: SceneObject, relief: _Relief, floor_m: float, taken_m: list[tuple[float, float, float]]
) -> list[_Place]:
    mine = (relief.owner == obj.object_index) & (relief.low_m >= LOWEST_M) & (relief.low_m <= HIGHEST_M)
    cell = np.argwhere(mine)[::_EVERY]
    if len(cell) == 0:
        return []
    middle_m = np.column_stack([relief.origin_m + _CELL_M * cell, relief.low_m[mine][::_EVERY]])
    corners = cv2.minAreaRect(obj.mesh.vertices_m[:, :2].astype(np.float32))
    first_rad = float(np.radians(corners[2]))
    tried = [_candidates(middle_m, relief, first_rad + quarter * 0.5 * np.pi) for quarter in range(4)]
    found: list[_Place] = []
    order = sorted((float(cost), way, place) for way, some in enumerate(tried) for place, cost in enumerate(some.cost))
    for _, way, place in order:
        x_m, y_m, height_m = (float(value) for value in tried[way].middle_m[place])
        others_m = (*taken_m, *(other.middle_m for other in found))
        apart_m = [np.hypot(other_m[0] - x_m, other_m[1] - y_m) for other_m in others_m]
        if len(found) < _PER_OBJECT and all(distance_m >= _SPACING_M for distance_m in apart_m):
            facing_rad = (tried[way].facing_rad + np.pi) % (2.0 * np.pi) - np.pi
            found.append(_Place((x_m, y_m, height_m + floor_m), float(facing_rad)))
    return found


def _candidates(middle_m: Float64[np.ndarray, "N 3"], relief: _Relief, facing_rad: float) -> _Candidates:
    """Those of some places at which a person can sit that faces one way."""
    flat = _heights(relief.low_m, relief, middle_m, facing_rad, _span(_HALF_DEPTH_M), _span(_HALF_WIDTH_M))
    level = np.abs(flat - middle_m[:, 2, None, None]) < _FLATNESS_M
    good = level.mean(axis=(1, 2)) >= _FLAT_FRACTION
    middle_m = middle_m[good]
    edge_m = _edge_m(relief, middle_m, facing_rad)
    back_m = _back_m(relief, middle_m, facing_rad)
    usable = np.isfinite(edge_m) & (back_m >= _NEAREST_BACK_M) & _free_beside(relief, middle_m, facing_rad)
    middle_m, edge_m, back_m = middle_m[usable], edge_m[usable], back_m[usable]
    free = _free_in_front(relief, middle_m, facing_rad, edge_m)
    cost = np.abs(edge_m - _TO_EDGE_M) + 0.5 * np.abs(np.minimum(back_m, _FARTHEST_BACK_M) - _TO_BACK_M)
    cost = cost + _off_centre(relief, middle_m, facing_rad)
    return _Candidates(middle_m[free], facing_rad, cost[free])


def _span(half_m: float) -> Float64[np.ndarray, " S"]:
    return np.linspace(-half_m, half_m, 2 * int(np.ceil(half_m / 0.04)) + 1)


def _heights(
    field_m: Float64[np.ndarray, "X Y"],
    relief: _Relief,
    middle_m: Float64[np.ndarray, "N 3"],
    facing_rad: float,
    ahead_m: Float64[np.ndarray, "*N A"],
    aside_m: Float64[np.ndarray, " B"],
) -> Float64[np.ndarray, "N A B"]:
    """Heights at distances ahead of places (the same for all, or each its own) and to their left."""
    ahead = np.array([np.cos(facing_rad), np.sin(facing_rad)])
    left = np.array([-ahead[1], ahead[0]])
    along_m = np.broadcast_to(ahead_m, (len(middle_m), ahead_m.shape[-1]))
    place_m = middle_m[:, None, None, :2] + along_m[:, :, None, None] * ahead + aside_m[None, None, :, None] * left
    return np.asarray(field_m[relief.cells(place_m)])


def _edge_m(relief: _Relief, middle_m: Float64[np.ndarray, "N 3"], facing_rad: float) -> Float64[np.ndarray, " N"]:
    """How far ahead the seat ends; infinite where it does not within reach of a thigh, or something stands on it."""
    ahead_m = np.arange(0.12, 0.44, 0.02)
    low_m, peak_m = (
        _heights(field_m, relief, middle_m, facing_rad, ahead_m, _span(0.5 * _THIGHS_M)) - middle_m[:, 2, None, None]
        for field_m in (relief.low_m, relief.peak_m)
    )
    gone = (low_m < -_STEP_DOWN_M).all(axis=2)
    first = gone.argmax(axis=1)
    in_the_way = np.cumsum((peak_m > 0.05).any(axis=2), axis=1)[np.arange(len(first)), first] > 0
    return np.where(gone.any(axis=1) & ~in_the_way, ahead_m[first], np.inf)


def _back_m(relief: _Relief, middle_m: Float64[np.ndarray, "N 3"], facing_rad: float) -> Float64[np.ndarray, " N"]:
    """How far behind a backrest rises; infinite where none does."""
    behind_m = np.arange(0.02, 0.8, 0.02)
    heights_m = _heights(relief.peak_m, relief, middle_m, facing_rad, -behind_m, _span(0.12))
    rises = (heights_m > middle_m[:, 2, None, None] + _BACKREST_M).any(axis=2)
    return np.where(rises.any(axis=1), behind_m[rises.argmax(axis=1)], np.inf)


def _free_beside(relief: _Relief, middle_m: Float64[np.ndarray, "N 3"], facing_rad: float) -> Bool[np.ndarray, " N"]:
    """Whether nothing higher than an arm rest is at either side: nobody sits sideways on a chair."""
    heights_m = _heights(relief.peak_m, relief, middle_m, facing_rad, _span(_HALF_DEPTH_M), _span(0.3))
    return np.asarray((heights_m < middle_m[:, 2, None, None] + _ARM_REST_M).all(axis=(1, 2)))


def _free_in_front(
    relief: _Relief, middle_m: Float64[np.ndarray, "N 3"], facing_rad: float, edge_m: Float64[np.ndarray, " N"]
) -> Bool[np.ndarray, " N"]:
    ahead_m = edge_m[:, None] + np.arange(0.03, _FRONT_DEPTH_M, 0.03)
    aside_m = _span(0.5 * _FRONT_WIDTH_M)
    low_m = _heights(relief.low_m, relief, middle_m, facing_rad, ahead_m, aside_m)
    tall_m = _heights(relief.tall_m, relief, middle_m, facing_rad, ahead_m, aside_m)
    return np.asarray(((low_m < _FLOOR_M) & (tall_m < _FLOOR_M)).all(axis=(1, 2)))


def _off_centre(relief: _Relief, middle_m: Float64[np.ndarray, "N 3"], facing_rad: float) -> Float64[np.ndarray, " N"]:
    """How much nearer one side's edge or arm rest is than the other's, within half a metre, metres."""
    aside_m = np.arange(0.0, 0.5, 0.02)
    reach_m = []
    for side in (1.0, -1.0):
        heights_m = _heights(relief.low_m, relief, middle_m, facing_rad, np.zeros(1), side * aside_m)[:, 0]
        ends = np.abs(heights_m - middle_m[:, 2, None]) > _STEP_DOWN_M / 2
        reach_m.append(np.where(ends.any(axis=1), aside_m[ends.argmax(axis=1)], 0.5))
    return np.asarray(0.5 * np.abs(reach_m[0] - reach_m[1]))
