"""How cloth lies on a body: eased outward, taut between the places that carry it, wrinkled, hemmed."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int32
from scipy.spatial import ConvexHull

from perpetua.actors.base.piece import Surface
from perpetua.actors.base.surface import averaging, border_edges, positive, vertex_normals

_NORMAL_PASSES = 12


_PASSES = 40
_LEVEL_M = 0.02


@dataclass(frozen=True)
class Drape:
    """Per vertex, ``gap_m`` is the least distance from the body, ``hold`` how strongly cloth keeps its ease.

    ``fold_m`` is how far folds stand out; ``bridge`` (0 to 1) how far cloth is stretched around the whole body rather
    than into its hollows.
    """

    gap_m: Float64[np.ndarray, " P"]
    hold: Float64[np.ndarray, " P"]
    fold_m: Float64[np.ndarray, " P"]
    bridge: Float64[np.ndarray, " P"]


def smooth_normals(surface: Surface) -> Float64[np.ndarray, "P 3"]:
    """Outward directions without the body's small relief."""
    mean = averaging(surface.faces, len(surface.vertices_m))
    normal = vertex_normals(surface.vertices_m, surface.faces)
    for _ in range(_NORMAL_PASSES):
        normal = np.asarray(0.5 * (normal + mean @ normal))
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9))


def draped(surface: Surface, ease_m: Float64[np.ndarray, " P"], how: Drape) -> Float64[np.ndarray, "P 3"]:
    """Where the cloth cut from this body surface comes to lie, folds included.

    Repeated averaging pulls the cloth straight across hollows (the small of the back, between the legs); wherever
    that, or a fold, brings it nearer to the body than ``gap_m`` the body pushes it out again.
    """
    mean = averaging(surface.faces, len(surface.vertices_m))
    normal = smooth_normals(surface)
    wanted = surface.vertices_m + ease_m[:, None] * normal
    cloth = wanted
    hold = how.hold[:, None]
    for _ in range(_PASSES):
        cloth = (1.0 - hold) * (0.4 * cloth + 0.6 * (mean @ cloth)) + hold * wanted
        cloth = _pushed_out(cloth, surface.vertices_m, normal, how.gap_m)
    cloth = _bridged(cloth, how.bridge)
    return _pushed_out(cloth + how.fold_m[:, None] * normal, surface.vertices_m, normal, how.gap_m)


def _bridged(cloth_m: Float64[np.ndarray, "P 3"], fraction: Float64[np.ndarray, " P"]) -> Float64[np.ndarray, "P 3"]:
    """The cloth moved outward in the horizontal, by a fraction of the way to the convex hull of its own level."""
    concerned = np.flatnonzero(fraction > 0.0)
    moved = cloth_m.copy()
    if len(concerned) == 0:
        return moved
    places = cloth_m[concerned]
    lowest, highest = float(places[:, 2].min()), float(places[:, 2].max())
    levels = np.linspace(lowest, highest, max(2, round((highest - lowest) / _LEVEL_M) + 1))
    outward_m = np.zeros((len(levels), len(concerned)))
    middle = 0.5 * (places[:, :2].min(axis=0) + places[:, :2].max(axis=0))
    offset = places[:, :2] - middle
    reach_m = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
    for row, level in enumerate(levels):
        slab = np.abs(places[:, 2] - level) < 1.5 * _LEVEL_M
        if slab.sum() > 8:
            sides = ConvexHull(offset[slab]).equations
            slope = (offset / reach_m[:, None]) @ sides[:, :2].T
            with np.errstate(divide="ignore"):
                hull_m = np.where(slope > 1e-6, -sides[:, 2] / np.maximum(slope, 1e-6), np.inf).min(axis=1)
            outward_m[row] = np.maximum(hull_m - reach_m, 0.0)
    # Between two levels, some of each.
    at = np.clip((places[:, 2] - lowest) / max(highest - lowest, 1e-9) * (len(levels) - 1), 0.0, len(levels) - 1.001)
    below, column = at.astype(np.int64), np.arange(len(concerned))
    push_m = (below + 1 - at) * outward_m[below, column] + (at - below) * outward_m[below + 1, column]
    moved[concerned, :2] += (fraction[concerned] * push_m / reach_m)[:, None] * offset
    return moved


def _pushed_out(
    cloth_m: Float64[np.ndarray, "P 3"],
    body_m: Float64[np.ndarray, "P 3"],
    normal: Float64[np.ndarray, "P 3"],
    gap_m: Float64[np.ndarray, " P"],
) -> Float64[np.ndarray, "P 3"]:
    gap = np.einsum("pa,pa->p", cloth_m - body_m, normal)
    return np.asarray(cloth_m + np.maximum(gap_m - gap, 0.0)[:, None] * normal)


def hemmed(surface: Surface, field_m: Float64[np.ndarray, " P"], width_m: float, thickness_m: float) -> Surface:
    """The cloth with its cut edges turned in, by a strip of inner side ``width_m`` wide.

    Args:
        surface: the cloth's outer side.
        field_m: metres from the cut edges, exactly 0 on them and nowhere else.
        width_m: width of the strip.
        thickness_m: distance between the two sides.
    """
    strip, strip_field_m = positive(surface, width_m - field_m)
    inner_m = strip.vertices_m - thickness_m * vertex_normals(strip.vertices_m, strip.faces)
    offset = len(surface.vertices_m)
    outer_edges = _edges_on_line(surface.faces, field_m)
    inner_edges = _edges_on_line(strip.faces, width_m - strip_field_m)
    bridge = _bridge(surface, outer_edges, strip, inner_edges, offset)
    return Surface(
        np.concatenate([surface.template_m, strip.template_m]),
        np.concatenate([surface.vertices_m, inner_m]),
        np.concatenate([surface.weights, strip.weights]),
        np.concatenate([surface.faces, strip.faces[:, ::-1] + offset, bridge]).astype(np.int32),
    )


def _edges_on_line(faces: Int32[np.ndarray, "F 3"], field_m: Float64[np.ndarray, " P"]) -> Int32[np.ndarray, "E 2"]:
    edges = border_edges(faces)
    return edges[np.all(np.abs(field_m[edges]) < 1e-7, axis=1)]


def _bridge(
    outer: Surface,
    outer_edges: Int32[np.ndarray, "E 2"],
    inner: Surface,
    inner_edges: Int32[np.ndarray, "E 2"],
    offset: int,
) -> Int32[np.ndarray, "F 3"]:
    """Faces between an edge and its copy on the inner side; both have the same place on the template."""
    places = {tuple(place): index for index, place in enumerate(inner.template_m.tolist())}
    wanted = {tuple(edge) for edge in inner_edges.tolist()}
    faces = []
    for first, second in outer_edges.tolist():
        a = places.get(tuple(outer.template_m[first].tolist()))
        b = places.get(tuple(outer.template_m[second].tolist()))
        if a is not None and b is not None and (a, b) in wanted:
            faces.append((second, first, offset + a))
            faces.append((second, offset + a, offset + b))
    return np.array(faces, dtype=np.int32).reshape(-1, 3)
