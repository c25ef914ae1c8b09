# SPDX-License-Identifier: GPL-3.0-or-later
"""Where patterns and pictures lie on the objects of a room, which have no UVs of their own."""

import numpy as np

from blender_scripts.render.mesh_arrays import box_projection

# Parts of an object start this far apart in its pattern, so that no two boards show the same grain.
PART_STEP_M = 0.731


def along_the_grain(vertices_m: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Metres f64[F, 3, 2] as in ``box_projection``, but with U along the longest side of each connected part."""
    part = connected_parts(len(vertices_m), faces)[faces[:, 0]]
    corners = np.asarray(vertices_m, np.float64)[faces]
    count = int(part.max()) + 1 if len(part) else 0
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, part, corners.min(axis=1))
    np.maximum.at(high, part, corners.max(axis=1))
    longest = (high - low).argmax(axis=1)[part]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = np.abs(normal).argmax(axis=1)
    # Of the two axes in the triangle's plane, the part's longest comes first; end grain keeps their order.
    plane = np.array([[1, 2], [0, 2], [0, 1]])[facing]
    swap = plane[:, 1] == longest
    plane[swap] = plane[swap][:, ::-1]
    uv = np.take_along_axis(corners, np.repeat(plane[:, None, :], 3, axis=1), axis=2)
    return uv + (PART_STEP_M * part)[:, None, None]


def connected_parts(vertex_count: int, faces: np.ndarray) -> np.ndarray:
    """For each vertex i64[P] the number of the connected part it belongs to, counted from 0."""
    label = np.arange(vertex_count)
    while True:
        smallest = label[faces].min(axis=1)
        lower = label.copy()
        for corner in range(3):
            np.minimum.at(lower, faces[:, corner], smallest)
        # Following labels to their own labels halves the distance to the smallest each time.
        lower = lower[lower]
        if np.array_equal(lower, label):
            break
        label = lower
    return np.unique(label, return_inverse=True)[1].ravel()


def over_the_whole(vertices_m: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """UV f64[F, 3, 2] from 0 to 1 over the object's box in the plane that each triangle faces most."""
    uv_m = box_projection(vertices_m, faces)
    corners = np.asarray(vertices_m, np.float64)[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    plane = np.array([[1, 2], [0, 2], [0, 1]])[np.abs(normal).argmax(axis=1)]
    low, high = vertices_m.min(axis=0), vertices_m.max(axis=0)
    uv = (uv_m - low[plane][:, None, :]) / (high - low)[plane][:, None, :]
    # On the sides whose normal is +y or -x the first axis runs to the left.
    facing = np.abs(normal).argmax(axis=1)
    sign = np.take_along_axis(normal, facing[:, None], axis=1)[:, 0]
    left = ((facing == 1) & (sign > 0)) | ((facing == 0) & (sign < 0))
    uv[left, :, 0] = 1.0 - uv[left, :, 0]
    return uv
