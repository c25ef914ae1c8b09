"""Cutting, smoothing and refining surfaces."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float64, Int, Int32
from scipy import sparse

from perpetua.actors.base.piece import Surface


def triangles(quads: Int[np.ndarray, "F 4"]) -> Int32[np.ndarray, "G 3"]:
    """Two triangles of each quad, the first ones first."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)


def catmull_clark(quads: Int[np.ndarray, "F 4"], count: int) -> tuple[sparse.csr_matrix, Int32[np.ndarray, "G 4"]]:
    """One step of Catmull and Clark's subdivision (1978) of a quad mesh with borders, as a linear operator.

    Returns:
        The matrix from old to new vertices (old ones first, then edges, then faces) and the new quads.
    """
    faces = len(quads)
    corner = quads.ravel()
    nxt = np.roll(quads, -1, axis=1).ravel()
    ends, edge_of_corner, sharing = np.unique(
        np.sort(np.stack([corner, nxt], axis=1), axis=1), axis=0, return_inverse=True, return_counts=True
    )
    edge_of_corner = edge_of_corner.reshape(faces, 4)
    edges = len(ends)
    rows = np.repeat(np.arange(faces), 4)
    face_points = sparse.csr_matrix((np.full(4 * faces, 0.25), (rows, corner)), (faces, count))
    face_of_edge = sparse.csr_matrix((np.ones(4 * faces), (edge_of_corner.ravel(), rows)), (edges, faces))
    half = np.full(2 * edges, 0.5)
    middle = sparse.csr_matrix((half, (np.repeat(np.arange(edges), 2), ends.ravel())), (edges, count))
    inner = sharing == 2
    keep = sparse.diags(np.where(inner, 0.5, 1.0))
    edge_points = keep @ middle + sparse.diags(np.where(inner, 0.25, 0.0)) @ face_of_edge @ face_points
    edge_of_vertex = sparse.csr_matrix(
        (np.ones(2 * edges), (ends.ravel(), np.repeat(np.arange(edges), 2))), (count, edges)
    )
    border_edge = sparse.diags((~inner).astype(float))
    on_border = np.asarray((edge_of_vertex @ border_edge).sum(axis=1)).ravel() > 0
    valence = np.maximum(np.asarray(edge_of_vertex.sum(axis=1)).ravel(), 1)
    face_of_vertex = sparse.csr_matrix((np.ones(4 * faces), (corner, rows)), (count, faces))
    inside = np.where(on_border, 0.0, 1.0 / valence**2)
    moved = sparse.diags(inside) @ (face_of_vertex @ face_points + 2.0 * edge_of_vertex @ middle)
    moved = moved + sparse.diags(np.where(on_border, 0.0, (valence - 3.0) / valence))
    moved = moved + sparse.diags(np.where(on_border, 0.5, 0.0))
    moved = moved + sparse.diags(np.where(on_border, 0.25, 0.0)) @ edge_of_vertex @ border_edge @ middle
    operator = sparse.vstack([moved, edge_points, face_points]).tocsr()
    ahead = count + edge_of_corner
    behind = np.roll(ahead, 1, axis=1)
    centre = np.broadcast_to((count + edges + np.arange(faces))[:, None], (faces, 4))
    new = np.stack([quads, ahead, centre, behind], axis=2).reshape(-1, 4)
    return operator, new.astype(np.int32)


def vertex_normals(
    vertices_m: Float64[np.ndarray, "P 3"], faces: Int32[np.ndarray, "F 3"]
) -> Float64[np.ndarray, "P 3"]:
    """Unit normals, weighted by the areas of the faces around."""
    corners = vertices_m[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = np.zeros_like(vertices_m)
    for corner in range(3):
        np.add.at(normal, faces[:, corner], area)
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12))


def _directed(faces: Int32[np.ndarray, "F 3"]) -> Int32[np.ndarray, "E 2"]:
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def border_edges(faces: Int32[np.ndarray, "F 3"]) -> Int32[np.ndarray, "E 2"]:
    """Directed edges with a face on one side only, in the order of the faces."""
    directed = _directed(faces)
    low, high = directed.min(axis=1).astype(np.int64), directed.max(axis=1).astype(np.int64)
    _, index, count = np.unique(low * (high.max(initial=0) + 1) + high, return_inverse=True, return_counts=True)
    return directed[count[index.ravel()] == 1]


def averaging(faces: Int32[np.ndarray, "F 3"], count: int) -> sparse.csr_matrix:
    """The matrix that replaces each vertex by the mean of its neighbours; on a border, of its border neighbours."""
    border = border_edges(faces)
    on_border = np.zeros(count, dtype=bool)
    on_border[border.ravel()] = True
    directed = _directed(faces)
    both = np.concatenate([directed, directed[:, ::-1]])
    pairs = np.concatenate([both[~on_border[both[:, 0]]], border, border[:, ::-1]])
    matrix = sparse.csr_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), (count, count))
    matrix.data[:] = 1.0
    degree = np.asarray(matrix.sum(axis=1)).ravel()
    alone = degree == 0
    return (sparse.diags(1.0 / np.maximum(degree, 1.0)) @ matrix + sparse.diags(alone.astype(float))).tocsr()


def compact(surface: Surface) -> tuple[Surface, Int32[np.ndarray, " Q"]]:
    """The surface without unused vertices, and the old index of each vertex kept."""
    used, faces = np.unique(surface.faces, return_inverse=True)
    kept = Surface(
        surface.template_m[used],
        surface.vertices_m[used],
        surface.weights[used],
        faces.reshape(-1, 3).astype(np.int32),
    )
    return kept, used.astype(np.int32)


def _blend(values: np.ndarray, edges: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    first, second = values[edges[:, 0]], values[edges[:, 1]]
    return np.asarray(first + fraction[:, None] * (second - first))


def split(surface: Surface, field: Float64[np.ndarray, " P"]) -> tuple[Surface, Float64[np.ndarray, " Q"]]:
    """Cuts triangles along the line where a field that is linear in each triangle is zero.

    Returns:
        The surface with new vertices on the line, where the field is exactly 0, and the field on all vertices. Every
        triangle of it has the field >= 0 at all corners or <= 0 at all corners.
    """
    # Vertices a hair's breadth from the line are on it: no slivers.
    scale = np.abs(field).max(initial=1e-12)
    field = np.where(np.abs(field) < 1e-6 * scale, 0.0, field)
    sign = np.sign(field)[surface.faces]
    crossed = (sign.min(axis=1) < 0) & (sign.max(axis=1) > 0)
    whole, cut = surface.faces[~crossed], surface.faces[crossed]
    directed = np.stack([cut[:, [0, 1]], cut[:, [1, 2]], cut[:, [2, 0]]], axis=1)
    changing = field[directed[..., 0]] * field[directed[..., 1]] < 0
    edges, place = np.unique(np.sort(directed[changing], axis=1), axis=0, return_inverse=True)
    new = np.full(changing.shape, -1, dtype=np.int64)
    new[changing] = len(field) + place.ravel()
    pieces = [whole] + [_cut_triangles(cut, new, field, turn) for turn in range(3)]
    fraction = field[edges[:, 0]] / (field[edges[:, 0]] - field[edges[:, 1]])
    grown = Surface(
        np.concatenate([surface.template_m, _blend(surface.template_m, edges, fraction)]),
        np.concatenate([surface.vertices_m, _blend(surface.vertices_m, edges, fraction)]),
        np.concatenate([surface.weights, _blend(surface.weights, edges, fraction)]),
        np.concatenate(pieces).astype(np.int32),
    )
    return grown, np.concatenate([field, np.zeros(len(edges))])


def _cut_triangles(cut: np.ndarray, new: np.ndarray, field: np.ndarray, turn: int) -> np.ndarray:
    """Pieces of the triangles whose corner ``turn`` is alone on its side, or whose corner ``turn`` is on the line."""
    a, b, c = (cut[:, (turn + step) % 3] for step in range(3))
    ab, bc, ca = (new[:, (turn + step) % 3] for step in range(3))
    alone = (ab >= 0) & (ca >= 0)
    on_line = (field[a] == 0) & (bc >= 0)
    a1, b1, c1, ab1, ca1 = a[alone], b[alone], c[alone], ab[alone], ca[alone]
    a2, b2, c2, bc2 = a[on_line], b[on_line], c[on_line], bc[on_line]
    corners = ((a1, ab1, ca1), (ab1, b1, c1), (ab1, c1, ca1), (a2, b2, bc2), (a2, bc2, c2))
    return np.concatenate([np.stack(corner, axis=1) for corner in corners])


def positive(surface: Surface, field: Float64[np.ndarray, " P"]) -> tuple[Surface, Float64[np.ndarray, " Q"]]:
    """The part of a surface where a field is positive, cut along its zero line, and the field there."""
    grown, values = split(surface, field)
    inside = np.max(values[grown.faces], axis=1) > 0
    kept, used = compact(replace(grown, faces=grown.faces[inside]))
    return kept, values[used]
