"""The audit's own pinhole camera and planes, apart from the code that made the data."""

import numpy as np
from jaxtyping import Bool, Float, Float64, Int64

# From the pixel at or before a position to the four pixel centres around it: x, y.
NEIGHBOUR_PIXELS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])


def project_to_pixels(
    intrinsics_px: Float[np.ndarray, "4"],
    camera_from_world: Float[np.ndarray, "4 4"],
    world_m: Float[np.ndarray, "N 3"],
) -> Float64[np.ndarray, "N 3"]:
    """x and y in pixels (0, 0 is the centre of the first pixel), and depth along the optical axis in metres."""
    fx, fy, cx, cy = np.asarray(intrinsics_px, np.float64)
    pose = np.asarray(camera_from_world, np.float64)
    homogeneous = np.concatenate([np.asarray(world_m, np.float64), np.ones((len(world_m), 1))], axis=1)
    camera_m = homogeneous @ pose[:3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        x = fx * camera_m[:, 0] / camera_m[:, 2] + cx
        y = fy * camera_m[:, 1] / camera_m[:, 2] + cy
    return np.stack([x, y, camera_m[:, 2]], axis=1)


def camera_centre_m(camera_from_world: Float[np.ndarray, "4 4"]) -> Float64[np.ndarray, "3"]:
    """Where a camera is in the world, if its transform is rigid."""
    pose = np.asarray(camera_from_world, np.float64)
    return np.asarray(-pose[:3, :3].T @ pose[:3, 3])


def unproject_depth(
    intrinsics_px: Float[np.ndarray, "4"], depth_m: Float[np.ndarray, "H W"]
) -> Float64[np.ndarray, "H W 3"]:
    """What each pixel centre shows, in the camera's axes."""
    fx, fy, cx, cy = np.asarray(intrinsics_px, np.float64)
    height, width = depth_m.shape
    row, column = np.mgrid[:height, :width]
    depth = np.asarray(depth_m, np.float64)
    return np.stack([(column - cx) / fx * depth, (row - cy) / fy * depth, depth], axis=-1)


def to_world(
    camera_from_world: Float[np.ndarray, "4 4"], camera_m: Float64[np.ndarray, "*shape 3"]
) -> Float64[np.ndarray, "*shape 3"]:
    """Points of a camera in the world, if its transform is rigid."""
    pose = np.asarray(camera_from_world, np.float64)
    return np.asarray((camera_m - pose[:3, 3]) @ pose[:3, :3])


def depth_of_planes(
    intrinsics_px: Float[np.ndarray, "4"],
    camera_from_world: Float[np.ndarray, "4 4"],
    triangle_m: Float[np.ndarray, "N 3 3"],
    column: Int64[np.ndarray, " N"],
    row: Int64[np.ndarray, " N"],
) -> Float64[np.ndarray, " N"]:
    """Depth at which the rays of pixel centres meet the planes of triangles given in world coordinates.

    In world coordinates: the ray is ``centre + depth * direction``, with a direction whose depth is 1 metre.
    """
    fx, fy, cx, cy = np.asarray(intrinsics_px, np.float64)
    world_from_camera = np.asarray(camera_from_world, np.float64)[:3, :3].T
    local = np.stack([(column - cx) / fx, (row - cy) / fy, np.ones(len(column))])
    direction = (world_from_camera @ local).T
    triangle = np.asarray(triangle_m, np.float64)
    normal = np.cross(triangle[:, 2] - triangle[:, 0], triangle[:, 1] - triangle[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        height = ((triangle[:, 0] - camera_centre_m(camera_from_world)) * normal).sum(axis=1)
        return np.asarray(height / (direction * normal).sum(axis=1))


def moves_more_than(track_m: Float[np.ndarray, "F N 3"], limit_m: float) -> Bool[np.ndarray, " N"]:
    """Whether two of a track's positions, at any two frames, are more than ``limit_m`` apart."""
    track = np.asarray(track_m, np.float64)
    moves = np.zeros(track.shape[1], bool)
    # A box around the track whose diagonal is short enough settles most of them.
    open_ones = np.flatnonzero(np.linalg.norm(track.max(axis=0) - track.min(axis=0), axis=1) > limit_m)
    for frame in range(len(track)):
        apart_m = np.linalg.norm(track[frame:, open_ones] - track[frame, open_ones], axis=2).max(axis=0)
        moves[open_ones[apart_m > limit_m]] = True
        open_ones = open_ones[apart_m <= limit_m]
    return moves
