"""Cutting, refining and hemming of surfaces."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from perpetua.actors.base.piece import Surface
from perpetua.actors.base.surface import (
    averaging,
    border_edges,
    catmull_clark,
    positive,
    split,
    triangles,
    vertex_normals,
)
from perpetua.actors.clothing.drape import hemmed
from perpetua.geometry.mesh import face_areas_m2

SIZE = 6


def sheet() -> Surface:
    """A flat square of 1 m with its weights equal to its places."""
    axis = np.linspace(0.0, 1.0, SIZE)
    x, y = np.meshgrid(axis, axis)
    places = np.stack([x.ravel(), y.ravel(), np.zeros(SIZE * SIZE)], axis=1)
    index = np.arange(SIZE * SIZE).reshape(SIZE, SIZE)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=2).reshape(-1, 4)
    return Surface(places, places.copy(), places.copy(), triangles(quads))


@settings(max_examples=15, deadline=None)
@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-0.7, 0.7))
def test_a_cut_keeps_area_orientation_and_attributes(a: float, b: float, c: float) -> None:
    flat = sheet()
    field = a * flat.template_m[:, 0] + b * flat.template_m[:, 1] + c
    grown, values = split(flat, field)
    assert np.isclose(face_areas_m2(grown.vertices_m, grown.faces).sum(), 1.0)
    assert np.all(vertex_normals(grown.vertices_m, grown.faces)[np.unique(grown.faces), 2] > 0.99)
    assert np.allclose(grown.weights, grown.vertices_m)
    assert np.allclose(a * grown.template_m[:, 0] + b * grown.template_m[:, 1] + c, values, atol=1e-5)
    signs = np.sign(values)[grown.faces]
    assert np.all((signs.min(axis=1) >= 0) | (signs.max(axis=1) <= 0))


def test_the_positive_part_of_a_half_plane_is_half() -> None:
    flat = sheet()
    kept, field = positive(flat, flat.template_m[:, 0] - 0.53)
    assert np.isclose(face_areas_m2(kept.vertices_m, kept.faces).sum(), 0.47)
    assert field.min() == 0.0 and np.isclose(kept.vertices_m[:, 0].min(), 0.53)
    edge = border_edges(kept.faces)
    on_cut = np.all(np.isclose(kept.vertices_m[edge, 0], 0.53), axis=1)
    lengths = np.linalg.norm(np.diff(kept.vertices_m[edge[on_cut]], axis=1), axis=2)
    assert np.isclose(lengths.sum(), 1.0), "the cut is one straight line"


def test_subdivision_keeps_a_plane_and_smooths_a_cube() -> None:
    axis = np.array([-1.0, 1.0])
    corners = np.array([(x, y, z) for x in axis for y in axis for z in axis])
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    operator, finer = catmull_clark(quads, 8)
    assert operator.shape == (26, 8) and finer.shape == (24, 4)
    assert np.allclose(operator.sum(axis=1), 1.0)
    points = operator @ corners
    # Catmull & Clark 1978: a corner of a cube of half width 1 moves to 5/9.
    assert np.allclose(np.abs(points[:8]), 5.0 / 9.0)
    assert len(border_edges(triangles(finer))) == 0
    normal = vertex_normals(points, triangles(finer))
    before = vertex_normals(corners, triangles(quads))
    assert np.sign(np.sum(normal[:8] * corners)) == np.sign(np.sum(before * corners))


def test_averaging_keeps_borders_on_the_border() -> None:
    flat = sheet()
    mean = averaging(flat.faces, len(flat.vertices_m)) @ flat.vertices_m
    bottom = flat.vertices_m[:, 1] == 0.0
    middle = bottom & (flat.vertices_m[:, 0] > 0) & (flat.vertices_m[:, 0] < 1)
    assert np.allclose(mean[middle], flat.vertices_m[middle])
    lone = averaging(np.array([[0, 1, 2]], dtype=np.int32), 5)
    assert lone[4, 4] == 1.0


def test_a_hem_closes_the_edge_with_thickness() -> None:
    flat = sheet()
    kept, _ = positive(flat, flat.template_m[:, 0] - 0.33)
    field = np.maximum(kept.template_m[:, 0] - 0.33, 1e-5)
    field[np.isclose(kept.template_m[:, 0], 0.33)] = 0.0
    sewn = hemmed(kept, field, 0.1, 0.01)
    edge = border_edges(sewn.faces)
    level = np.ptp(sewn.vertices_m[edge, 2], axis=1) < 1e-9
    assert not np.any(np.all(np.isclose(sewn.vertices_m[edge, 0], 0.33), axis=1) & level), "the cut edge is closed"
    inner = sewn.vertices_m[len(kept.vertices_m) :]
    assert np.allclose(inner[:, 2], -0.01) and inner[:, 0].max() <= 0.43 + 1e-9
    area = face_areas_m2(sewn.vertices_m, sewn.faces).sum()
    assert np.isclose(area, 0.67 + 0.10 + 0.01)
