# SPDX-License-Identifier: GPL-3.0-or-later
"""UV atlases for baking: charts of faces that look the same way, projected flat and packed without overlap.

Every chart keeps its metres, so texels are stretched by 1.7 at most (a face that looks along a diagonal of the axes);
how dense they are is each chart's own. Arrays in, arrays out: nothing here knows Blender.
"""

from dataclasses import dataclass

import numpy as np

# Free texels around each chart: baking extends the colours into them, so that filtering never meets a neighbour, not
# even in an image of half the resolution.
BORDER_PX = 2
# A chart is stretched to this many texels along each side: the middle of one has to lie in it to be baked at all.
MIN_CHART_PX = 4.0
# A chart is cut in two while it fills less of its box than this, unless the box is small.
MIN_FILL, MIN_SPLIT_M2, MAX_SPLITS = 0.35, 0.01, 8
# A chart is as fine as this share of its views needs; the rest, from closer by, see it magnified.
CLOSE_QUANTILE = 0.9
# Densities, and the scale they share, are powers of two to the power of one over these.
LEVELS_PER_OCTAVE, SCALES_PER_OCTAVE = 2, 4
# Bumps are averaged over at most so many texels.
MOST_BLUR_PX = 12.0
# Below this scale nothing is left to save: each chart is its border.
LEAST_SCALE = 1e-3


@dataclass(frozen=True)
class Faces:
    """Polygons: ``corner_m`` f64[L, 3], ``face_of_corner`` i64[L], ``edge_of_corner`` i64[L], ``normal`` f64[F, 3]."""

    corner_m: np.ndarray
    face_of_corner: np.ndarray
    edge_of_corner: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class Charts:
    """``plane_m`` f64[L, 2] corners in their chart, from 0; ``chart`` i64[L], -1: none; ``size_m`` f64[C, 2]."""

    plane_m: np.ndarray
    chart: np.ndarray
    size_m: np.ndarray


@dataclass(frozen=True)
class Seen:
    """What cameras met of a mesh: polygons i64[N], and the pixels per metre f64[N] with which each was seen."""

    polygon: np.ndarray
    pixels_per_m: np.ndarray


@dataclass(frozen=True)
class Packing:
    """Image size in pixels and ``corner_px`` f64[C, 2], where each chart begins."""

    width_px: int
    height_px: int
    corner_px: np.ndarray


def make_charts(faces: Faces, wanted: np.ndarray) -> Charts:
    """Charts of the ``wanted`` bool[F] faces: connected ones that look along the same axis and direction."""
    axis = np.abs(faces.normal).argmax(axis=1)
    direction = 2 * axis + (np.take_along_axis(faces.normal, axis[:, None], 1)[:, 0] > 0)
    label = connected_components(len(axis), *_joined_faces(faces, np.where(wanted, direction, -1)))
    chart_of_face = np.full(len(axis), -1)
    chart_of_face[wanted] = np.unique(label[wanted], return_inverse=True)[1]
    plane = np.array([[1, 2], [0, 2], [0, 1]])[axis][faces.face_of_corner]
    plane_m = np.take_along_axis(faces.corner_m, plane, axis=1)
    for _ in range(MAX_SPLITS):
        split = _split_sparse(chart_of_face, plane_m, faces.face_of_corner)
        if np.array_equal(split, chart_of_face):
            break
        chart_of_face = split
    chart = chart_of_face[faces.face_of_corner]
    chosen = chart >= 0
    low_m, high_m = _bounds(plane_m[chosen], chart[chosen])
    plane_m[chosen] -= low_m[chart[chosen]]
    size_m = high_m - low_m
    _lay_flat(plane_m, chart, size_m)
    return Charts(plane_m, chart, size_m)


def _bounds(points: np.ndarray, group: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest coordinates f64[G, 2] of the points in each group."""
    count = int(group.max()) + 1 if len(group) else 0
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, group, points)
    np.maximum.at(high, group, points)
    return low, high


def _split_sparse(chart_of_face: np.ndarray, plane_m: np.ndarray, face_of_corner: np.ndarray) -> np.ndarray:
    """Cuts charts that fill little of their box (a ring of skirting) in two, where their faces lie furthest apart."""
    wanted = np.flatnonzero(chart_of_face >= 0)
    if len(wanted) == 0:
        return chart_of_face
    chart = chart_of_face[wanted]
    area_m2 = np.bincount(chart, _plane_area_m2(plane_m, face_of_corner, len(chart_of_face))[wanted])
    chosen = chart_of_face[face_of_corner] >= 0
    low_m, high_m = _bounds(plane_m[chosen], chart_of_face[face_of_corner[chosen]])
    size_m = high_m - low_m
    sparse = (area_m2 < MIN_FILL * size_m.prod(axis=1)) & (size_m.prod(axis=1) > MIN_SPLIT_M2)
    corners = np.bincount(face_of_corner, minlength=len(chart_of_face))
    centre_m = np.stack([np.bincount(face_of_corner, plane_m[:, k]) / corners for k in (0, 1)], axis=1)[wanted]
    low_centre_m, high_centre_m = _bounds(centre_m, chart)
    wider = (high_centre_m - low_centre_m).argmax(axis=1)[chart]
    along_m = np.take_along_axis(centre_m, wider[:, None], 1)[:, 0]
    mean_m = np.bincount(chart, along_m) / np.bincount(chart)
    upper = sparse[chart] & (along_m > mean_m[chart])
    split = chart_of_face.copy()
    split[wanted] = np.unique(2 * chart + upper, return_inverse=True)[1]
    return split


def _plane_area_m2(plane_m: np.ndarray, face_of_corner: np.ndarray, count: int) -> np.ndarray:
    """Area f64[F] of each polygon in its plane, by the shoelace formula."""
    start = np.searchsorted(face_of_corner, np.arange(count))
    following = np.arange(1, len(face_of_corner) + 1)
    last = np.append(start[1:], len(face_of_corner)) - 1
    following[last] = start
    cross = plane_m[:, 0] * plane_m[following, 1] - plane_m[:, 1] * plane_m[following, 0]
    return np.abs(np.bincount(face_of_corner, cross, minlength=count)) / 2.0


def _lay_flat(plane_m: np.ndarray, chart: np.ndarray, size_m: np.ndarray) -> None:
    """Turns tall charts on their side, which packs better."""
    tall = size_m[:, 1] > size_m[:, 0]
    size_m[tall] = size_m[tall][:, ::-1]
    turned = (chart >= 0) & np.append(tall, False)[chart]
    plane_m[turned] = plane_m[turned][:, ::-1]


def _joined_faces(faces: Faces, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of faces that share an edge and look the same way."""
    order = np.argsort(faces.edge_of_corner, kind="stable")
    edge, face = faces.edge_of_corner[order], faces.face_of_corner[order]
    first, second = face[:-1], face[1:]
    joined = (edge[:-1] == edge[1:]) & (direction[first] == direction[second]) & (direction[first] >= 0)
    return first[joined], second[joined]


def connected_components(count: int, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """For each of ``count`` nodes the smallest node that edges ``first[k] - second[k]`` connect it to."""
    label = np.arange(count)
    while True:
        least = np.minimum(label[first], label[second])
        lower = label.copy()
        np.minimum.at(lower, label[first], least)
        np.minimum.at(lower, label[second], least)
        lower = lower[lower]
        if np.array_equal(lower, label):
            return label
        label = lower


@dataclass(frozen=True)
class Density:
    """Pixels per metre f64[C] with which each chart is seen: in its closest views, and in half of them."""

    close: np.ndarray
    typical: np.ndarray


def seen_density(charts: Charts, chart_of_polygon: np.ndarray, seen: Seen, unseen_per_m: float) -> Density:
    """How finely each chart is seen.

    A chart that no ray met counts as the least of its mesh's seen ones, as it may be a narrow side of them; those of a
    mesh that no ray met as ``unseen_per_m``: it shows in mirrors, and colours the light.
    """
    density = np.full((len(charts.size_m), 2), np.nan)
    chart = chart_of_polygon[seen.polygon]
    order = np.argsort(chart, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(chart[order])) + 1):
        if len(group) and chart[group[0]] >= 0:
            density[chart[group[0]]] = np.quantile(seen.pixels_per_m[group], (CLOSE_QUANTILE, 0.5))
    met = ~np.isnan(density[:, 0])
    density[~met] = density[met].min(axis=0) if met.any() else unseen_per_m
    density = quantised(density)
    return Density(density[:, 0], density[:, 1])


def quantised(density: np.ndarray) -> np.ndarray:
    """The nearest of fixed densities, so that cameras that see a mesh about alike find its images in the cache."""
    return 2.0 ** (np.round(np.log2(density) * LEVELS_PER_OCTAVE) / LEVELS_PER_OCTAVE)


def pack(charts: Charts, texels_per_m: np.ndarray) -> Packing:
    """Places the charts, with densities f64[C], in rows (tallest first) of a nearly square image."""
    size_px = _size_px(charts, texels_per_m)
    width_px = max(int(size_px[:, 0].max()), round(float(np.sqrt(size_px.prod(axis=1).sum()))))
    corner_px = np.zeros((len(size_px), 2))
    x = y = row_height = 0
    for chart in np.argsort(-size_px[:, 1], kind="stable"):
        width, height = size_px[chart]
        if x + width > width_px:
            x, y = 0, y + row_height
        if x == 0:
            row_height = height
        corner_px[chart] = (x, y)
        x += width
    return Packing(width_px, int(y + row_height), corner_px)


def _size_px(charts: Charts, texels_per_m: np.ndarray) -> np.ndarray:
    return np.ceil(_chart_px(charts, texels_per_m)).astype(np.int64) + 2 * BORDER_PX


def _chart_px(charts: Charts, texels_per_m: np.ndarray) -> np.ndarray:
    """Sides f64[C, 2] of the charts, without their borders."""
    return np.maximum(charts.size_m * texels_per_m[:, None], MIN_CHART_PX)


def boxes(charts: Charts, packing: Packing, texels_per_m: np.ndarray) -> np.ndarray:
    """Left, bottom, right and top i64[C, 4] of the packed charts, with their borders; the last two exclusive."""
    begin = packing.corner_px.astype(np.int64)
    return np.concatenate([begin, begin + _size_px(charts, texels_per_m)], axis=1)


def texels(charts: Charts, texels_per_m: np.ndarray) -> int:
    """Texels that charts take at densities f64[C], before what packing wastes."""
    return int(_size_px(charts, texels_per_m).prod(axis=1).sum())


def shared_scale(all_charts: list[Charts], densities: list[np.ndarray], budget: int, most: float) -> float:
    """The largest factor, up to ``most``, by which all wanted densities fit a budget of texels together."""
    steps = int(np.floor(np.log2(most) * SCALES_PER_OCTAVE))
    while True:
        scale = 2.0 ** (steps / SCALES_PER_OCTAVE)
        used = sum(texels(charts, scale * density) for charts, density in zip(all_charts, densities, strict=True))
        if used <= budget or scale < LEAST_SCALE:
            return scale
        steps -= 1


def blur_charts(values: np.ndarray, known: np.ndarray, boxes: np.ndarray, width: np.ndarray) -> None:
    """Averages ``values`` f[H, W, K] in place, over the ``known`` bool[H, W] texels of each chart alone.

    ``boxes`` i[C, 4] holds left, bottom, right and top of the charts with their borders; ``width`` f[C] over how many
    texels each is averaged.
    """
    for (left, bottom, right, top), passes in zip(boxes, _passes(width), strict=True):
        part = (slice(bottom, top), slice(left, right))
        for _ in range(passes):
            values[part] = np.where(known[part][..., None], _blur(values[part], known[part]), values[part])


def _passes(width: np.ndarray) -> np.ndarray:
    """How often weights 1-2-1 (a variance of 1/2) make a box so wide (a variance of its square over 12)."""
    return np.round(np.minimum(width, MOST_BLUR_PX) ** 2 / 6.0).astype(int)


def _blur(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """``values`` f[H, W, K] smoothed with weights 1-2-1 along both sides, over the ``known`` bool[H, W] texels."""
    weight = known.astype(np.float32)[..., None]
    total = values * weight
    for axis in (0, 1):
        total, weight = _smooth(total, axis), _smooth(weight, axis)
    return total / np.maximum(weight, 1e-6)


def _smooth(values: np.ndarray, axis: int) -> np.ndarray:
    padding = [(0, 0)] * values.ndim
    padding[axis] = (1, 1)
    padded = np.moveaxis(np.pad(values, padding), axis, 0)
    return np.moveaxis(padded[:-2] + 2.0 * padded[1:-1] + padded[2:], 0, axis)


def uv(charts: Charts, packing: Packing, texels_per_m: np.ndarray) -> np.ndarray:
    """UV f32[L, 2] of every corner; corners without a chart lie outside the image."""
    size_px = np.array([packing.width_px, packing.height_px])
    begin_px = np.append(packing.corner_px, [[0.0, 0.0]], axis=0)[charts.chart]
    px_per_m = _chart_px(charts, texels_per_m) / np.maximum(charts.size_m, 1e-9)
    inside = (begin_px + BORDER_PX + charts.plane_m * np.append(px_per_m, [[0.0, 0.0]], axis=0)[charts.chart]) / size_px
    return np.where(charts.chart[:, None] >= 0, inside, -2.0).astype(np.float32)
