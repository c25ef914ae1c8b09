"""Exact least distance between a moving point and a moving, deforming triangle mesh."""

import numpy as np
import trimesh
from jaxtyping import Bool, Float32, Float64, Int32, Int64

from perpetua.scene.actor import ActorMesh

CELL_M = 0.12


class MovingMesh:
    """An actor's triangles in groups that lie close together, with the box of each group at each frame."""

    def __init__(self, actor: ActorMesh) -> None:
        self.vertices_m = actor.vertices_m
        self._groups = _face_groups(actor.vertices_m[0], actor.faces)
        low_m, high_m = zip(*(self._box(group) for group in self._groups), strict=True)
        self._low_m, self._high_m = np.stack(low_m, axis=1), np.stack(high_m, axis=1)

    def least_distance_m(
        self,
        points_m: Float64[np.ndarray, "N 3"],
        frame: Int32[np.ndarray, " N"],
        fraction: Float64[np.ndarray, " N"],
    ) -> float:
        """The least of N distances, each between a point and the mesh ``fraction`` of the way to the next frame.

        Vertices move on straight lines between frames. A group lies within the join of its two frames' boxes, so
        points are measured in the order of how near they could be, until none can be nearer than the nearest.
        """
        group_m = self._group_distance_m(points_m, frame)
        could_be_m = group_m.min(axis=1)
        nearest_m = np.inf
        for step in np.argsort(could_be_m, kind="stable"):
            if could_be_m[step] >= nearest_m:
                break
            corners_m = self._corners_m(group_m[step] < nearest_m, int(frame[step]), float(fraction[step]))
            nearest_m = min(nearest_m, _distance_m(points_m[step], corners_m))
        return float(nearest_m)

    def _box(self, group: Int32[np.ndarray, "F 3"]) -> tuple[Float32[np.ndarray, "T 3"], Float32[np.ndarray, "T 3"]]:
        vertices_m = self.vertices_m[:, np.unique(group)]
        return vertices_m.min(axis=1), vertices_m.max(axis=1)

    def _group_distance_m(
        self, points_m: Float64[np.ndarray, "N 3"], frame: Int32[np.ndarray, " N"]
    ) -> Float64[np.ndarray, "N G"]:
        low_m = np.minimum(self._low_m[frame], self._low_m[frame + 1])
        high_m = np.maximum(self._high_m[frame], self._high_m[frame + 1])
        beyond_m = np.maximum(np.maximum(low_m - points_m[:, None], points_m[:, None] - high_m), 0.0)
        return np.asarray(np.linalg.norm(beyond_m, axis=-1))

    def _corners_m(self, near: Bool[np.ndarray, " G"], frame: int, fraction: float) -> Float64[np.ndarray, "F 3 3"]:
        faces = np.concatenate([self._groups[group] for group in np.flatnonzero(near)])
        start_m, end_m = self.vertices_m[frame][faces], self.vertices_m[frame + 1][faces]
        return (1.0 - fraction) * start_m.astype(np.float64) + fraction * end_m.astype(np.float64)


def _face_groups(vertices_m: Float32[np.ndarray, "P 3"], faces: Int32[np.ndarray, "F 3"]) -> list[np.ndarray]:
    """Faces whose middles share a cell of a grid at the first frame."""
    cell = np.floor(vertices_m[faces].mean(axis=1) / CELL_M).astype(np.int64)
    cell -= cell.min(axis=0)
    key: Int64[np.ndarray, " F"] = np.ravel_multi_index(tuple(cell.T), tuple(cell.max(axis=0) + 1))
    order = np.argsort(key, kind="stable")
    starts = np.flatnonzero(np.diff(key[order])) + 1
    return np.split(faces[order], starts)


def _distance_m(point_m: Float64[np.ndarray, "3"], corners_m: Float64[np.ndarray, "F 3 3"]) -> float:
    to_corner_m = np.linalg.norm(corners_m - point_m, axis=2)
    # A triangle's points are no nearer than its nearest corner less its longest edge.
    edge_m = np.linalg.norm(corners_m - np.roll(corners_m, 1, axis=1), axis=2).max(axis=1)
    near = to_corner_m.min(axis=1) - edge_m <= to_corner_m.min()
    closest_m = trimesh.triangles.closest_point(corners_m[near], np.repeat(point_m[None], near.sum(), axis=0))
    return float(np.linalg.norm(closest_m - point_m, axis=1).min())
