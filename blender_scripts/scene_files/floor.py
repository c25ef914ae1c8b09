# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the floor of a scene nobody has described, from its triangles alone: numpy, no Blender.

Lengths are whatever the caller takes for metres, which may be wrong by far: nothing here trusts them, so that a wrong
scale is found out instead of hiding the floor.
"""

from dataclasses import dataclass

import numpy as np

# A face within about 20 degrees of level counts as level.
MIN_LEVEL_NORMAL = 0.94
# Faces this near to a height belong to one surface: metres, or a share of the scene where that is less.
SAME_HEIGHT_M, SAME_HEIGHT_FRACTION = 0.025, 0.003
# A floor given by the user is looked for this near to the height given.
GIVEN_HEIGHT_M = 0.05
# Floor lies in the lower part of the scene and is no small part of its ground area.
LOWER_FRACTION = 0.4
MIN_GROUND_FRACTION, MIN_FLOOR_M2 = 0.05, 2.0
# Cells in which the floor's plan is drawn: metres, or a share of the scene where that is less.
CELL_M, CELL_FRACTION, MAX_CELLS = 0.1, 1.0 / 60.0, 500
SAMPLES_PER_CELL = 6.0
MAX_SAMPLES = 4_000_000
# A ceiling is level, covers this share of the floor, and lies above this share of what stands on it.
CEILING_COVER, CEILING_FRACTION = 0.4, 0.3


@dataclass(frozen=True)
class Floor:
    """A level surface: its height, its plan as cells, and which faces make it.

    ``cells`` bool[X, Y]: cell (i, j) has its lower corner at ``corner_m + cell_m * (i, j)``. ``faces`` bool[F] marks
    the triangles of the surface; ``upward`` tells whether they show their front to the top. ``low_m`` and ``high_m``
    bound the surface in x and y.
    """

    z_m: float
    upward: bool
    cells: np.ndarray
    cell_m: float
    corner_m: np.ndarray
    faces: np.ndarray
    low_m: np.ndarray
    high_m: np.ndarray

    @property
    def area_m2(self) -> float:
        """Area of the plan, square metres."""
        return float(self.cells.sum()) * self.cell_m**2


@dataclass(frozen=True)
class _LevelFaces:
    """Of every triangle: whether it is level, its area seen from above, its middle's height, the sign of its normal."""

    level: np.ndarray
    area_m2: np.ndarray
    z_m: np.ndarray
    upward: np.ndarray


def find_floor(corners_m: np.ndarray, named: np.ndarray, given_z_m: float | None) -> Floor | None:
    """The largest level surface near the bottom of the scene; None where there is none.

    Args:
        corners_m: triangles f64[F, 3, 3], Z up.
        named: bool[F], triangles of objects that are called floor; where they suffice, no others are looked at.
        given_z_m: height of the floor where the user gave it.
    """
    low_m, high_m = corners_m.min((0, 1)), corners_m.max((0, 1))
    diagonal_m = float(np.linalg.norm(high_m - low_m))
    if diagonal_m == 0.0:
        return None
    faces = _level_faces(corners_m)
    least_m2 = min(MIN_FLOOR_M2, MIN_GROUND_FRACTION * float(np.prod((high_m - low_m)[:2])))
    window_m = min(SAME_HEIGHT_M, SAME_HEIGHT_FRACTION * diagonal_m)
    if given_z_m is not None:
        window_m = GIVEN_HEIGHT_M
        eligible = np.abs(faces.z_m - given_z_m) <= window_m
    else:
        eligible = faces.z_m <= low_m[2] + LOWER_FRACTION * (high_m[2] - low_m[2]) + window_m
    for chosen in (named, np.ones_like(named)):
        for upward in (True, False):
            usable = eligible & chosen & faces.level & (faces.upward == upward)
            z_m = _fullest_height_m(faces, usable, window_m, least_m2)
            if z_m is not None:
                surface = usable & (np.abs(faces.z_m - z_m) <= window_m)
                return _plan(corners_m, surface, faces.area_m2, upward, diagonal_m)
    return None


def ceiling_height_m(corners_m: np.ndarray, floor: Floor) -> tuple[float, bool]:
    """Height above the floor of the ceiling (True), or where there is none, of the highest object over it (False)."""
    middle_m = corners_m.mean(1)
    margin_m = floor.cell_m
    over = ((middle_m[:, :2] >= floor.low_m - margin_m) & (middle_m[:, :2] <= floor.high_m + margin_m)).all(1)
    over &= middle_m[:, 2] > floor.z_m
    if not over.any():
        return 0.0, False
    top_m = float(corners_m[over, :, 2].max()) - floor.z_m
    faces = _level_faces(corners_m)
    high = over & faces.level & (faces.z_m - floor.z_m > CEILING_FRACTION * top_m)
    # A ceiling looks down, unless its normals are wrong; a large table's top looks up.
    for chosen in (high & ~faces.upward, high):
        height_m = _lowest_cover_m(faces, chosen, floor, 0.01 * top_m)
        if height_m is not None:
            return height_m, True
    return top_m, False


def _lowest_cover_m(faces: _LevelFaces, chosen: np.ndarray, floor: Floor, window_m: float) -> float | None:
    """The lowest height above the floor at which faces cover enough of it."""
    if not chosen.any():
        return None
    height_m, area_m2 = faces.z_m[chosen] - floor.z_m, faces.area_m2[chosen]
    bins = np.floor(height_m / window_m).astype(np.int64)
    per_bin_m2 = np.bincount(bins, area_m2)
    covering = np.flatnonzero(per_bin_m2 + np.append(per_bin_m2[1:], 0.0) >= CEILING_COVER * floor.area_m2)
    if len(covering) == 0:
        return None
    first = (bins == covering[0]) | (bins == covering[0] + 1)
    return float(np.average(height_m[first], weights=area_m2[first]))


def _level_faces(corners_m: np.ndarray) -> _LevelFaces:
    normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    length = np.linalg.norm(normal, axis=1)
    level = (np.abs(normal[:, 2]) > MIN_LEVEL_NORMAL * length) & (length > 0.0)
    return _LevelFaces(level, 0.5 * np.abs(normal[:, 2]), corners_m[:, :, 2].mean(1), normal[:, 2] > 0.0)


def _fullest_height_m(faces: _LevelFaces, usable: np.ndarray, window_m: float, least_m2: float) -> float | None:
    """The height around which most area lies; None where that is less than ``least_m2``."""
    if not usable.any():
        return None
    order = np.argsort(faces.z_m[usable], kind="stable")
    z_m, area_m2 = faces.z_m[usable][order], faces.area_m2[usable][order]
    total_m2 = np.concatenate([[0.0], np.cumsum(area_m2)])
    first = np.searchsorted(z_m, z_m - window_m)
    last = np.searchsorted(z_m, z_m + window_m, side="right")
    near_m2 = total_m2[last] - total_m2[first]
    best = int(near_m2.argmax())
    if near_m2[best] < least_m2:
        return None
    within = slice(int(first[best]), int(last[best]))
    return float(np.average(z_m[within], weights=area_m2[within]))


def _plan(corners_m: np.ndarray, surface: np.ndarray, area_m2: np.ndarray, upward: bool, diagonal_m: float) -> Floor:
    """The largest connected part of a surface, seen from above."""
    flat_m = corners_m[surface][:, :, :2]
    low_m, high_m = flat_m.min((0, 1)), flat_m.max((0, 1))
    cell_m = max(min(CELL_M, CELL_FRACTION * diagonal_m), float((high_m - low_m).max()) / MAX_CELLS)
    points_m, owner = _spread(flat_m, area_m2[surface], cell_m)
    shape = np.floor((high_m - low_m) / cell_m).astype(int) + 1
    index = np.minimum(np.floor((points_m - low_m) / cell_m).astype(int), shape - 1)
    covered = np.zeros(shape, bool)
    covered[index[:, 0], index[:, 1]] = True
    cells = covered & _largest_region(_grown(covered))
    inside = np.zeros(len(flat_m), bool)
    inside[owner[cells[index[:, 0], index[:, 1]]]] = True
    faces = np.zeros(len(corners_m), bool)
    faces[np.flatnonzero(surface)[inside]] = True
    kept_m = corners_m[faces]
    z_m = _median(kept_m[:, :, 2].mean(1), area_m2[faces])
    return Floor(z_m, upward, cells, cell_m, low_m, faces, kept_m[:, :, :2].min((0, 1)), kept_m[:, :, :2].max((0, 1)))


def _median(values: np.ndarray, weights: np.ndarray) -> float:
    """The value in the middle of the weights, which a rug on the floor does not move."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1])])


def _spread(flat_m: np.ndarray, area_m2: np.ndarray, cell_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Points f64[N, 2] evenly over triangles, and the triangle of each; a triangle has one at least."""
    wanted = SAMPLES_PER_CELL * area_m2 / cell_m**2
    wanted *= min(1.0, MAX_SAMPLES / max(float(wanted.sum()), 1.0))
    count = np.maximum(1, np.ceil(wanted)).astype(np.int64)
    owner = np.repeat(np.arange(len(flat_m)), count)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    # The R2 sequence (Roberts 2018): even, and the same at every call.
    u, v = (0.5 + step * 0.7548776662466927) % 1.0, (0.5 + step * 0.5698402909980532) % 1.0
    outside = u + v > 1.0
    u, v = np.where(outside, 1.0 - u, u), np.where(outside, 1.0 - v, v)
    corner = flat_m[owner]
    return corner[:, 0] + u[:, None] * (corner[:, 1] - corner[:, 0]) + v[:, None] * (corner[:, 2] - corner[:, 0]), owner


def _grown(cells: np.ndarray) -> np.ndarray:
    """The cells and their neighbours at sides and corners, so that narrow gaps do not part a floor."""
    wide = cells.copy()
    wide[1:] |= cells[:-1]
    wide[:-1] |= cells[1:]
    both = wide.copy()
    both[:, 1:] |= wide[:, :-1]
    both[:, :-1] |= wide[:, 1:]
    return both


def _largest_region(cells: np.ndarray) -> np.ndarray:
    """The connected part that has the most cells."""
    left, best = cells.copy(), np.zeros_like(cells)
    while left.sum() > best.sum():
        region = np.zeros_like(cells)
        region[tuple(np.argwhere(left)[0])] = True
        size = 0
        while size != (size := int(region.sum())):
            region = _swept(region, left)
        left &= ~region
        if region.sum() > best.sum():
            best = region
    return best


def _swept(region: np.ndarray, free: np.ndarray) -> np.ndarray:
    """A region grown along rows and columns as far as free cells go, which settles in few rounds."""
    for axis in (0, 1):
        for flip in (False, True):
            grown = np.flip(region, axis) if flip else region
            passable = np.flip(free, axis) if flip else free
            position = np.arange(passable.shape[axis]).reshape((-1, 1) if axis == 0 else (1, -1))
            wall = np.maximum.accumulate(np.where(passable, -1, position), axis)
            seed = np.maximum.accumulate(np.where(grown, position, -1), axis)
            grown = passable & (seed > wall)
            region = np.flip(grown, axis) if flip else grown
    return region
