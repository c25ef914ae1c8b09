"""Triangles and polygons on a regular grid, never missing a cell that they touch."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int64, Integer

CHUNK_TRIANGLES = 12_000


@dataclass(frozen=True)
class Raster:
    """A grid of square cells; cell (i, j) has its centre at ``origin_m + cell_m * (i, j)``."""

    origin_m: Float64[np.ndarray, "2"]
    cell_m: float
    shape: tuple[int, int]

    def centres_m(self) -> Float64[np.ndarray, "X Y 2"]:
        """The x and y of every cell's centre."""
        indices = np.stack(np.meshgrid(*map(np.arange, self.shape), indexing="ij"), axis=-1)
        return np.asarray(self.origin_m + self.cell_m * indices)


@dataclass(frozen=True)
class Touches:
    """Cells touched by parts of surfaces, as flat indices of a raster, and the heights those parts span."""

    cell: Int64[np.ndarray, " N"]
    low_z_m: Float32[np.ndarray, " N"]
    high_z_m: Float32[np.ndarray, " N"]


def touched_cells(
    raster: Raster,
    corners_m: Float[np.ndarray, "F 3 3"],
    low_z_m: float,
    high_z_m: float,
    settled: Bool[np.ndarray, "X Y"] | None = None,
) -> Iterator[Touches]:
    """The cells that triangles touch between two heights, in chunks.

    Triangles are halved across their longest side (seen from above) until none is wider than a cell, and each piece
    claims every cell of its bounding rectangle. So no touched cell is missed, however thin the triangle, and none is
    claimed that is further than one cell away.

    Args:
        raster: the grid; what lies outside it is left out.
        corners_m: triangle corners in the world.
        low_z_m: pieces entirely below are left out.
        high_z_m: pieces entirely above are left out.
        settled: cells that are of no more interest; pieces over these alone are left out. It is looked at anew for
            each chunk, so the caller may go on filling it.
    """
    low_m = np.append(raster.origin_m - 0.5 * raster.cell_m, low_z_m)
    high_m = np.append(raster.origin_m + raster.cell_m * (np.array(raster.shape) - 0.5), high_z_m)
    for start in range(0, len(corners_m), CHUNK_TRIANGLES):
        waiting = corners_m[start : start + CHUNK_TRIANGLES].astype(np.float32)
        open_cells = None if settled is None else np.pad(~settled, ((1, 0), (1, 0))).cumsum(0, np.int32).cumsum(1)
        while len(waiting):
            low, high = _bounds(waiting)
            relevant = np.logical_and.reduce([*(high >= low_m).T, *(low <= high_m).T])
            if open_cells is not None:
                relevant[relevant] = _count(raster, open_cells, low[relevant], high[relevant]) > 0
            small = np.maximum(high[:, 0] - low[:, 0], high[:, 1] - low[:, 1]) <= raster.cell_m
            claimed = relevant & small
            if claimed.any():
                yield _claim(raster, low[claimed], high[claimed])
            waiting = _halve(waiting[relevant & ~small])


def _count(
    raster: Raster, sums: Integer[np.ndarray, "A B"], low: Float32[np.ndarray, "F 3"], high: Float32[np.ndarray, "F 3"]
) -> Integer[np.ndarray, " F"]:
    """What a summed-area table (Crow 1984) counts in the cells of each rectangle."""
    first, last = (_cells(raster, edge) for edge in (low, high))
    (i0, j0), (i1, j1) = np.maximum(first, 0).T, np.minimum(last + 1, raster.shape).T
    return np.asarray(sums[i1, j1] - sums[i0, j1] - sums[i1, j0] + sums[i0, j0])


def _cells(raster: Raster, place_m: Float32[np.ndarray, "F 3"]) -> Int64[np.ndarray, "F 2"]:
    return np.floor((place_m[:, :2] - raster.origin_m) / raster.cell_m + 0.5).astype(np.int64)


def _bounds(corners_m: Float32[np.ndarray, "F 3 3"]) -> tuple[Float32[np.ndarray, "F 3"], Float32[np.ndarray, "F 3"]]:
    # Far quicker than a reduction over an axis of length three.
    a, b, c = corners_m[:, 0], corners_m[:, 1], corners_m[:, 2]
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def _halve(corners_m: Float32[np.ndarray, "F 3 3"]) -> Float32[np.ndarray, "G 3 3"]:
    side_m = np.roll(corners_m, -1, axis=1)[:, :, :2] - corners_m[:, :, :2]
    longest = (side_m[..., 0] ** 2 + side_m[..., 1] ** 2).argmax(1)
    rows = np.arange(len(corners_m))
    start, end, apex = (corners_m[rows, (longest + offset) % 3] for offset in range(3))
    halves = np.empty((2 * len(corners_m), 3, 3), np.float32)
    first, second = halves[: len(corners_m)], halves[len(corners_m) :]
    first[:, 1] = second[:, 0] = 0.5 * (start + end)
    first[:, 0], second[:, 1] = start, end
    first[:, 2] = second[:, 2] = apex
    return halves


def _claim(raster: Raster, low: Float32[np.ndarray, "F 3"], high: Float32[np.ndarray, "F 3"]) -> Touches:
    first, last = (_cells(raster, edge) for edge in (low, high))
    touches = []
    # No piece is wider than a cell, so it touches at most two columns and two rows.
    for columns in (first[:, 0], last[:, 0]):
        for rows in (first[:, 1], last[:, 1]):
            inside = (columns >= 0) & (columns < raster.shape[0]) & (rows >= 0) & (rows < raster.shape[1])
            cell = columns[inside] * raster.shape[1] + rows[inside]
            touches.append((cell, low[inside, 2], high[inside, 2]))
    cell, low_z_m, high_z_m = (np.concatenate(column) for column in zip(*touches, strict=True))
    return Touches(cell, low_z_m, high_z_m)


def inside_polygon(
    points_m: Float64[np.ndarray, "*batch 2"], polygon_m: Float64[np.ndarray, "K 2"]
) -> Bool[np.ndarray, "*batch"]:
    """Which points lie inside a simple polygon, by the even-odd rule."""
    x, y = points_m[..., 0], points_m[..., 1]
    inside = np.zeros(x.shape, bool)
    for (x0, y0), (x1, y1) in zip(polygon_m, np.roll(polygon_m, -1, axis=0), strict=True):
        if y0 == y1:
            continue
        crossing_x = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
        inside ^= ((y0 > y) != (y1 > y)) & (x < crossing_x)
    return inside
