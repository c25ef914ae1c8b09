"""A signed distance field of a room: positive where a camera can be, negative in solids, cupboards and outside."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64
from scipy import ndimage

from perpetua.errors import CameraError
from perpetua.geometry.raycast import Caster
from perpetua.scene.room import Room

# Distances are exact up to here; further away, where clearance does not matter, they are a few mm too long at most.
NEAR_M = 0.45
COARSE_STRIDE = 3
PADDING_VOXELS = 2


@dataclass(frozen=True)
class SignedDistanceField:
    """Distance to the nearest surface at voxel centres ``origin_m + voxel_m * (i, j, k)``; positive in free space."""

    origin_m: Float64[np.ndarray, "3"]
    voxel_m: float
    distance_m: Float32[np.ndarray, "X Y Z"]


def signed_distance_field(room: Room, caster: Caster, voxel_m: float) -> SignedDistanceField:
    """Distance to the nearest surface of the room, or to the room's boundary where a wall is open.

    The sign is positive in the largest connected region inside the floor polygon and the room's height. Connected
    means by steps of one voxel between voxels that are further than half a voxel from every surface, so open and
    non-watertight furniture has no inside, and cracks narrower than a voxel do not open a cupboard.

    Args:
        room: gives the floor polygon and the height.
        caster: casts against the join of all the room's meshes.
        voxel_m: edge of a voxel.

    Raises:
        CameraError: no voxel is free.
    """
    origin_m, shape = _grid(room, voxel_m)
    boundary_m = _boundary_distance_m(room, origin_m, voxel_m, shape)
    surface_m = _surface_distance_m(caster, origin_m, voxel_m, shape)
    roomy = (surface_m > 0.5 * voxel_m) & (boundary_m > 0.0)
    regions, count = ndimage.label(roomy)
    if count == 0:
        raise CameraError(
            f"a camera needs free space; '{room.name}' has none at a voxel of {voxel_m} m: lower cameras.voxel_m"
        )
    free = regions == 1 + int(np.argmax(np.bincount(regions.ravel())[1:]))
    free |= _sees_free_neighbour(caster, origin_m, voxel_m, free, ~roomy & (boundary_m > 0.0))
    inside_m = np.minimum(surface_m, boundary_m)
    distance_m = np.where(boundary_m <= 0.0, boundary_m, np.where(free, inside_m, -surface_m))
    return SignedDistanceField(origin_m, voxel_m, distance_m.astype(np.float32))


def distance_at_m(
    field: SignedDistanceField, points_m: Float64[np.ndarray, "*batch 3"]
) -> Float64[np.ndarray, "*batch"]:
    """The field at points, trilinear between voxel centres; points beyond the grid take its border's value."""
    cell = np.moveaxis((points_m - field.origin_m) / field.voxel_m, -1, 0)
    return np.asarray(ndimage.map_coordinates(field.distance_m.astype(np.float64), cell, order=1, mode="nearest"))


def voxel_centres_m(field: SignedDistanceField, where: Bool[np.ndarray, "X Y Z"]) -> Float64[np.ndarray, "N 3"]:
    """Centres of chosen voxels."""
    return np.asarray(field.origin_m + field.voxel_m * np.argwhere(where))


def _grid(room: Room, voxel_m: float) -> tuple[Float64[np.ndarray, "3"], tuple[int, int, int]]:
    low_m = np.array([*room.floor_polygon_m.min(axis=0), 0.0])
    high_m = np.array([*room.floor_polygon_m.max(axis=0), room.height_m])
    cells = np.ceil((high_m - low_m) / voxel_m).astype(int) + 2 * PADDING_VOXELS
    origin_m = 0.5 * (low_m + high_m - voxel_m * (cells - 1))
    return origin_m, (int(cells[0]), int(cells[1]), int(cells[2]))


def _centres(
    origin_m: Float64[np.ndarray, "3"], step_m: float, shape: tuple[int, int, int]
) -> Float64[np.ndarray, "N 3"]:
    axes = [origin_m[i] + step_m * np.arange(shape[i]) for i in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _surface_distance_m(
    caster: Caster, origin_m: Float64[np.ndarray, "3"], voxel_m: float, shape: tuple[int, int, int]
) -> Float64[np.ndarray, "X Y Z"]:
    """Exact below ``NEAR_M``; beyond, the distance to the nearest of the points found from a coarser grid."""
    distance_m = _coarse_distance_m(caster, origin_m, voxel_m, shape)
    # Of two distances the larger is at most the smaller and the way between: only these can be below NEAR_M.
    near = distance_m < NEAR_M + np.sqrt(3.0) * COARSE_STRIDE * voxel_m
    exact_m = caster.closest_distance(origin_m + voxel_m * np.argwhere(near), NEAR_M)
    distance_m[near] = np.where(exact_m < NEAR_M, exact_m, np.maximum(distance_m[near], NEAR_M))
    return distance_m


def _coarse_distance_m(
    caster: Caster, origin_m: Float64[np.ndarray, "3"], voxel_m: float, shape: tuple[int, int, int]
) -> Float64[np.ndarray, "X Y Z"]:
    """Least distance to the surface points nearest to the eight surrounding nodes of a grid with a longer step."""
    nodes = (_nodes(shape[0]), _nodes(shape[1]), _nodes(shape[2]))
    surface_m = caster.closest_point(_centres(origin_m, COARSE_STRIDE * voxel_m, nodes)).reshape(*nodes, 3)
    centres_m = _centres(origin_m, voxel_m, shape).reshape(*shape, 3)
    cell = [np.arange(n) // COARSE_STRIDE for n in shape]
    distance_m = np.full(shape, np.inf)
    for corner in np.ndindex(2, 2, 2):
        node = np.ix_(*(cell[i] + corner[i] for i in range(3)))
        distance_m = np.minimum(distance_m, np.linalg.norm(surface_m[node] - centres_m, axis=-1))
    return distance_m


def _nodes(voxels: int) -> int:
    return (voxels - 1) // COARSE_STRIDE + 2


def _boundary_distance_m(
    room: Room, origin_m: Float64[np.ndarray, "3"], voxel_m: float, shape: tuple[int, int, int]
) -> Float64[np.ndarray, "X Y Z"]:
    """Signed distance to the prism over the floor polygon, positive inside."""
    plane = _centres(origin_m, voxel_m, (shape[0], shape[1], 1))[:, :2]
    wall_m = polygon_distance_m(room.floor_polygon_m, plane).reshape(shape[0], shape[1], 1)
    z_m = origin_m[2] + voxel_m * np.arange(shape[2])
    return np.asarray(np.minimum(wall_m, np.minimum(z_m, room.height_m - z_m)[None, None, :]))


def polygon_distance_m(
    polygon_m: Float64[np.ndarray, "K 2"], points_m: Float64[np.ndarray, "N 2"]
) -> Float64[np.ndarray, " N"]:
    """Distance of points to a polygon's outline, positive inside."""
    start, edge = polygon_m, np.roll(polygon_m, -1, axis=0) - polygon_m
    nearest_m = np.full(len(points_m), np.inf)
    inside = np.zeros(len(points_m), bool)
    for corner, side in zip(start, edge, strict=True):
        offset = points_m - corner
        along = np.clip(offset @ side / max(float(side @ side), 1e-18), 0.0, 1.0)
        nearest_m = np.minimum(nearest_m, np.linalg.norm(offset - along[:, None] * side, axis=1))
        if side[1] != 0.0:
            fraction = offset[:, 1] / side[1]
            inside ^= (fraction >= 0.0) & (fraction < 1.0) & (offset[:, 0] < fraction * side[0])
    return np.where(inside, nearest_m, -nearest_m)


def _sees_free_neighbour(
    caster: Caster,
    origin_m: Float64[np.ndarray, "3"],
    voxel_m: float,
    free: Bool[np.ndarray, "X Y Z"],
    unsure: Bool[np.ndarray, "X Y Z"],
) -> Bool[np.ndarray, "X Y Z"]:
    """Voxels hard by a surface are free where a straight line to a free neighbour meets no triangle."""
    seen = np.zeros_like(free)
    index = np.argwhere(unsure & ndimage.binary_dilation(free))
    for axis in range(3):
        for step in (-1, 1):
            neighbour = index.copy()
            neighbour[:, axis] = np.clip(neighbour[:, axis] + step, 0, free.shape[axis] - 1)
            usable = free[tuple(neighbour.T)] & ~seen[tuple(index.T)]
            origins_m, targets_m = origin_m + voxel_m * index[usable], origin_m + voxel_m * neighbour[usable]
            seen[tuple(index[usable].T)] = caster.clear(origins_m, targets_m)
    return seen
