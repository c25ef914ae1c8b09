"""Room -> navigation grid: where a person can stand, from the meshes as rendered."""

import math

import numpy as np
from jaxtyping import Bool, Float32, Float64
from scipy import ndimage

from perpetua.errors import NavigationError
from perpetua.navigation.config import NavigationConfig
from perpetua.navigation.raster import Raster, inside_polygon, touched_cells
from perpetua.navigation.types import NavGrid
from perpetua.scene.room import Room, SceneObject

# Obstacles are rasterised on cells of at most this side, so that the grid's cells need not be fine.
FINE_CELL_M = 0.02
# A surface counts as floor up to this slope, and floors are looked for up to this far from z = 0.
MIN_UPWARD_NORMAL = math.cos(math.radians(40.0))
FLOOR_RANGE_M = 0.5


def build_nav_grid(room: Room, config: NavigationConfig) -> NavGrid:
    """The grid of where a person of the configured size can stand and walk.

    Floor is what walkable objects show upwards inside ``room.floor_polygon_m``. Every surface between
    ``config.step_m`` and ``config.body_height_m`` above it is an obstacle, whatever its shape, and so is a step
    higher than ``config.step_m``. ``clearance_m`` comes from an exact Euclidean distance transform on a finer grid,
    less the largest rounding of that grid, so it never exceeds the true distance.

    Connected regions smaller than ``config.min_region_m2`` are left out; the largest one is kept in any case.

    Raises:
        NavigationError: no cell is free.
    """
    fine_per_cell = _odd_at_least(config.cell_m / FINE_CELL_M)
    fine = _fine_raster(room.floor_polygon_m, config.cell_m, fine_per_cell)
    floor_z_m = _floor_heights(room, fine)
    obstacle = _obstacles(room, fine, floor_z_m, config)
    half_diagonal_m = fine.cell_m * math.sqrt(0.5)
    fine_clearance_m = ndimage.distance_transform_edt(~obstacle) * fine.cell_m - half_diagonal_m
    clearance_m = np.maximum(_at_centres(fine_clearance_m, fine_per_cell), 0.0).astype(np.float32)
    free = large_regions(clearance_m >= config.body_radius_m, config.min_region_m2 / config.cell_m**2)
    if not free.any():
        raise NavigationError(
            f"a person needs {config.body_radius_m:.2f} m of free floor around the body, but the widest place of "
            f"room '{room.name}' leaves {clearance_m.max(initial=0.0):.2f} m: lower navigation.body_radius_m or "
            "raise rooms.min_side_m"
        )
    centre_floor_z_m = np.nan_to_num(_at_centres(floor_z_m, fine_per_cell), nan=0.0)
    origin_m = fine.origin_m + fine.cell_m * (fine_per_cell // 2)
    return NavGrid(origin_m, config.cell_m, centre_floor_z_m, free, clearance_m)


def _odd_at_least(value: float) -> int:
    # Odd, so that a fine cell shares its centre with each cell of the grid.
    return 2 * math.ceil((value - 1.0) / 2.0) + 1 if value > 1.0 else 1


def _fine_raster(polygon_m: Float64[np.ndarray, "K 2"], cell_m: float, fine_per_cell: int) -> Raster:
    low, high = polygon_m.min(0), polygon_m.max(0)
    # One cell beyond the floor on every side, so that its edge counts as an obstacle.
    cells = np.ceil((high - low) / cell_m).astype(int) + 2
    corner = 0.5 * (low + high) - 0.5 * cells * cell_m
    fine_cell_m = cell_m / fine_per_cell
    shape = (int(cells[0]) * fine_per_cell, int(cells[1]) * fine_per_cell)
    return Raster(corner + 0.5 * fine_cell_m, fine_cell_m, shape)


def _at_centres(values: Float64[np.ndarray, "A B"] | Float32[np.ndarray, "A B"], fine_per_cell: int) -> np.ndarray:
    middle = fine_per_cell // 2
    return values[middle::fine_per_cell, middle::fine_per_cell]


def _floor_heights(room: Room, fine: Raster) -> Float32[np.ndarray, "X Y"]:
    """Height of the highest walkable surface in each cell, NaN where there is none."""
    height_m = np.full(fine.shape[0] * fine.shape[1], -np.inf, np.float32)
    for obj in room.objects:
        if not obj.walkable:
            continue
        corners_m = obj.mesh.vertices_m[obj.mesh.faces]
        normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
        upward = normal[:, 2] > MIN_UPWARD_NORMAL * np.linalg.norm(normal, axis=1)
        for touches in touched_cells(fine, corners_m[upward], -FLOOR_RANGE_M, FLOOR_RANGE_M):
            np.maximum.at(height_m, touches.cell, touches.high_z_m)
    height_m = height_m.reshape(fine.shape)
    height_m[~(inside_polygon(fine.centres_m(), room.floor_polygon_m) & np.isfinite(height_m))] = np.nan
    return height_m


def _obstacles(
    room: Room, fine: Raster, floor_z_m: Float32[np.ndarray, "X Y"], config: NavigationConfig
) -> Bool[np.ndarray, "X Y"]:
    """Cells without floor, with something in a person's way, or beside too high a step."""
    no_floor = np.isnan(floor_z_m)
    if no_floor.all():
        return no_floor
    low_z_m = np.where(no_floor, np.inf, floor_z_m + config.step_m).ravel()
    high_z_m = np.where(no_floor, -np.inf, floor_z_m + config.body_height_m).ravel()
    lowest_m = float(np.nanmin(floor_z_m)) + config.step_m
    highest_m = float(np.nanmax(floor_z_m)) + config.body_height_m
    blocked = no_floor.ravel()
    # Large objects first: most small ones stand on them and need no closer look.
    for obj in sorted(room.objects, key=lambda other: -_footprint_m2(other)):
        corners_m = obj.mesh.vertices_m[obj.mesh.faces]
        for touches in touched_cells(fine, corners_m, lowest_m, highest_m, blocked.reshape(fine.shape)):
            hit = (touches.high_z_m > low_z_m[touches.cell]) & (touches.low_z_m < high_z_m[touches.cell])
            blocked[touches.cell[hit]] = True
    return np.asarray(blocked.reshape(fine.shape) | _too_high_steps(floor_z_m, config.step_m))


def _footprint_m2(obj: SceneObject) -> float:
    return float(np.ptp(obj.mesh.vertices_m[:, :2], axis=0).prod()) if len(obj.mesh.vertices_m) else 0.0


def _too_high_steps(floor_z_m: Float32[np.ndarray, "X Y"], step_m: float) -> Bool[np.ndarray, "X Y"]:
    highest_m = ndimage.maximum_filter(np.where(np.isnan(floor_z_m), -np.inf, floor_z_m), size=3)
    lowest_m = ndimage.minimum_filter(np.where(np.isnan(floor_z_m), np.inf, floor_z_m), size=3)
    return np.asarray(highest_m > lowest_m + step_m)


def large_regions(free: Bool[np.ndarray, "X Y"], min_cells: float) -> Bool[np.ndarray, "X Y"]:
    """The connected regions of at least so many cells, and the largest in any case."""
    labels, count = ndimage.label(free)
    if count == 0:
        return free
    cells = np.bincount(labels.ravel())
    cells[0] = 0
    kept = cells >= min(float(cells.max()), max(min_cells, 1.0))
    return np.asarray(kept[labels])
