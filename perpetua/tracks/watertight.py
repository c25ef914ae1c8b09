"""Which triangles have an inside that no camera sees."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float64, Int64, Integer
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from perpetua.tracks.surface import SceneMeshes, SurfacePoints

# Eyes, mouth, neck and hems leave holes in a body that is closed for every practical purpose.
OPEN_EDGE_FRACTION = 0.03


@dataclass(frozen=True)
class WatertightFaces:
    """Per face, or per point on a face: whether its back is the inside of a closed surface, and that surface's box."""

    closed: Bool[np.ndarray, " N"]
    box_m: Float64[np.ndarray, "N 2 3"]

    def take(self, chosen: Int64[np.ndarray, " M"] | Bool[np.ndarray, " N"]) -> "WatertightFaces":
        """Some of them."""
        return WatertightFaces(self.closed[chosen], self.box_m[chosen])

    def hide_back(self, eye_m: Float64[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Whether the back is hidden from a camera: it is unless that is inside, as a closed room is seen."""
        inside = ((eye_m >= self.box_m[:, 0]) & (eye_m <= self.box_m[:, 1])).all(axis=1)
        return np.asarray(self.closed & ~inside)


class WatertightTable:
    """The closed surfaces of a scene, found once per object and only for objects that are asked for."""

    def __init__(self, meshes: SceneMeshes) -> None:
        self.meshes = meshes
        self._known: dict[int, WatertightFaces] = {}

    def of(self, points: SurfacePoints) -> WatertightFaces:
        """Looks up points. Boxes of actors are empty: cameras keep their distance and are never inside one."""
        closed, box_m = np.zeros(len(points), bool), np.zeros((len(points), 2, 3))
        for object_index in np.unique(points.object_index).tolist():
            members = np.flatnonzero(points.object_index == object_index)
            watertight = self._of_object(object_index)
            closed[members] = watertight.closed[points.face[members]]
            if object_index in self.meshes.static:
                box_m[members] = watertight.box_m[points.face[members]]
        return WatertightFaces(closed, box_m)

    def _of_object(self, object_index: int) -> WatertightFaces:
        if object_index not in self._known:
            if object_index in self.meshes.static:
                mesh = self.meshes.static[object_index]
                self._known[object_index] = watertight_faces(mesh.vertices_m, mesh.faces)
            else:
                vertices_m = self.meshes.moving_vertices_m[object_index][0]
                self._known[object_index] = watertight_faces(vertices_m, self.meshes.moving_faces[object_index])
        return self._known[object_index]


def watertight_faces(vertices_m: Float[np.ndarray, "P 3"], faces: Integer[np.ndarray, "F 3"]) -> WatertightFaces:
    """Finds connected surfaces that are closed, consistently wound, and face outwards.

    Vertices at one position count as one, because seams of textures split them. A surface is closed when at most
    ``OPEN_EDGE_FRACTION`` of its edges lack a partner of the opposite direction, and faces outwards when its signed
    volume is positive.
    """
    corner = _vertex_at_one_position(vertices_m)[faces]
    surface = _surface_of_faces(corner)
    count = int(surface.max(initial=-1)) + 1
    open_edges = np.bincount(surface, weights=_unpaired_edges(corner), minlength=count)
    edges = 3.0 * np.bincount(surface, minlength=count)
    triangle_m = vertices_m[faces].astype(np.float64)
    volume_m3 = np.einsum("fc,fc->f", triangle_m[:, 0], np.cross(triangle_m[:, 1], triangle_m[:, 2])) / 6.0
    outward = np.bincount(surface, weights=volume_m3, minlength=count) > 0.0
    low_m, high_m = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low_m, surface, triangle_m.min(axis=1))
    np.maximum.at(high_m, surface, triangle_m.max(axis=1))
    closed = outward & (open_edges <= OPEN_EDGE_FRACTION * edges)
    return WatertightFaces(closed[surface], np.stack([low_m, high_m], axis=1)[surface])


def connected_surfaces(
    vertices_m: Float[np.ndarray, "P 3"], faces: Integer[np.ndarray, "F 3"]
) -> Int64[np.ndarray, " F"]:
    """Numbers the connected surfaces of a mesh: a body, a shirt, each lock of hair."""
    return _surface_of_faces(_vertex_at_one_position(vertices_m)[faces])


def _vertex_at_one_position(vertices_m: Float[np.ndarray, "P 3"]) -> Int64[np.ndarray, " P"]:
    """Numbers vertices so that those at one position share a number.

    Sorting one mixed word per vertex is ten times as quick as sorting rows. Two positions with one word by chance
    (about one in 10^7 for a million vertices) would join two surfaces for the test of openness alone.
    """
    # Adding zero makes -0.0 and 0.0 one position.
    words = (np.ascontiguousarray(vertices_m, np.float64) + 0.0).view(np.uint64)
    mixed = words[:, 0].copy()
    for axis in (1, 2):
        mixed = (mixed ^ (mixed >> np.uint64(29))) * np.uint64(0x9E3779B97F4A7C15) + words[:, axis]
        mixed *= np.uint64(0xD6E8FEB86659FD93)
    _, vertex = np.unique(mixed ^ (mixed >> np.uint64(32)), return_inverse=True)
    return np.asarray(vertex, np.int64).reshape(-1)


def _surface_of_faces(corner: Integer[np.ndarray, "F 3"]) -> Int64[np.ndarray, " F"]:
    start, end = corner[:, [0, 1]].reshape(-1), corner[:, [1, 2]].reshape(-1)
    size = int(corner.max(initial=-1)) + 1
    graph = coo_matrix((np.ones(len(start), np.int8), (start, end)), shape=(size, size))
    _, label = connected_components(graph, directed=False)
    _, surface = np.unique(label[corner[:, 0]], return_inverse=True)
    return np.asarray(surface, np.int64).reshape(-1)


def _unpaired_edges(corner: Integer[np.ndarray, "F 3"]) -> Float64[np.ndarray, " F"]:
    """For each face the number of its edges that are not used exactly once in each direction."""
    start, end = corner.astype(np.int64).reshape(-1), np.roll(corner, -1, axis=1).astype(np.int64).reshape(-1)
    size = int(corner.max(initial=-1)) + 1
    forward, there, uses = np.unique(start * size + end, return_inverse=True, return_counts=True)
    backward = end * size + start
    place = np.minimum(np.searchsorted(forward, backward), len(forward) - 1)
    paired = (forward[place] == backward) & (uses[place] == 1) & (uses[there.reshape(-1)] == 1)
    return np.asarray((~paired).reshape(-1, 3).sum(axis=1), np.float64)
