"""What finishes a neckline: a ribbed band, or a folded shirt collar."""

import numpy as np
from jaxtyping import Float64, Int32

from perpetua.actors.base.piece import Piece, Surface
from perpetua.actors.base.surface import border_edges, vertex_normals
from perpetua.actors.clothing.fabrics import Fabric
from perpetua.scene.actor import ActorPart
from perpetua.scene.room import Material

# Rows of a collar: metres up the neck and metres outward, from the cut edge on. The last rows fold back.
_ROWS_M = {
    "band": ((0.0, 0.0015), (0.006, 0.003), (0.012, 0.002), (0.013, -0.002), (0.002, -0.003)),
    "shirt": ((0.0, 0.001), (0.016, 0.002), (0.032, 0.004), (0.036, 0.009), (0.022, 0.014), (-0.006, 0.018)),
    "polo": ((0.0, 0.001), (0.012, 0.003), (0.024, 0.005), (0.027, 0.009), (0.015, 0.013), (-0.008, 0.015)),
}
_UP = np.array([0.25, 0.0, 0.97])


def _neck_loop(outside: Surface) -> Int32[np.ndarray, " L"]:
    """The vertices of the neckline in order, starting at the front."""
    edges = border_edges(outside.faces)
    middle = outside.template_m[edges].mean(axis=1)
    edges = edges[(np.abs(middle[:, 1]) < 0.16) & (middle[:, 2] > 0.38)]
    following = {int(first): int(second) for first, second in edges}
    front = max(following, key=lambda vertex: float(outside.template_m[vertex, 0]))
    loop = [front]
    while following.get(loop[-1], front) != front and len(loop) <= len(following):
        loop.append(following[loop[-1]])
    return np.array(loop, dtype=np.int32)


def collar(top: Piece, outside: Surface, kind: str, fabric: Fabric) -> Piece:
    """The top with a collar sewn to its neckline ("none" leaves it as it is).

    Args:
        top: the finished top; its first vertices are those of ``outside``.
        outside: the top's outer side, from which the neckline is found.
        kind: "none", "band", "polo" or "shirt".
        fabric: the top's fabric.
    """
    if kind == "none":
        return top
    loop = _neck_loop(outside)
    ring_m = outside.vertices_m[loop]
    normal = vertex_normals(outside.vertices_m, outside.faces)[loop]
    outward = normal - (normal @ _UP)[:, None] * _UP
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    closeness = _closeness(ring_m, kind)
    rows = [ring_m + up * closeness[:, None] * _UP + out * outward for up, out in _ROWS_M[kind]]
    count, offset = len(loop), len(top.vertices_m)
    faces, uv = _strip(count, len(rows), ring_m, fabric, closed=kind == "band")
    shade = Material(name="collar", base_color=(0.5, 0.5, 0.5), roughness=fabric.roughness, image=fabric.image)
    part = ActorPart("collar", (faces + offset).astype(np.int32), uv, shade)
    return Piece(
        np.concatenate([top.vertices_m, *rows]),
        np.concatenate([top.weights, *[outside.weights[loop]] * len(rows)]),
        (*top.parts, part),
    )


def _closeness(ring_m: Float64[np.ndarray, "L 3"], kind: str) -> Float64[np.ndarray, " L"]:
    """Folded collars are open at the throat: lower towards the front."""
    if kind == "band":
        return np.ones(len(ring_m))
    forward = ring_m[:, 0] - ring_m[:, 0].min()
    return np.interp(forward / forward.max(), [0.0, 0.6, 1.0], [1.0, 0.9, 0.55])


def _strip(
    count: int, rows: int, ring_m: Float64[np.ndarray, "L 3"], fabric: Fabric, closed: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles and UVs of rows of ``count`` vertices; open ones leave a gap at the front."""
    gap = 0 if closed else max(count // 40, 1)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ring_m, axis=0), axis=1))])
    columns = np.arange(gap, count - gap)
    ahead = (columns + 1) % count
    faces, uv = [], []
    for row in range(rows - 1):
        a, b = row * count + columns, row * count + ahead
        c, d = b + count, a + count
        faces.append(np.concatenate([np.stack([a, d, c], axis=1), np.stack([a, c, b], axis=1)]))
        u0, u1 = along[columns], np.where(ahead == 0, along[-1], along[ahead])
        v0, v1 = np.full(len(columns), 0.012 * row), np.full(len(columns), 0.012 * (row + 1))
        corner_a, corner_b = np.stack([u0, v0], axis=1), np.stack([u1, v0], axis=1)
        corner_c, corner_d = np.stack([u1, v1], axis=1), np.stack([u0, v1], axis=1)
        uv.append(
            np.concatenate(
                [np.stack([corner_a, corner_d, corner_c], axis=1), np.stack([corner_a, corner_c, corner_b], axis=1)]
            )
        )
    return np.concatenate(faces), (np.concatenate(uv) / fabric.tile_m).astype(np.float32)
