"""Texture atlases: charts keep their metres, never overlap, and share a budget."""

import importlib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.pinhole import Intrinsics
from perpetua.rendering.bake import bake_room, texel_budget
from perpetua.rendering.closeness import measure_closeness
from perpetua.rendering.config import RenderConfig
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room, SceneObject


@pytest.fixture(scope="module")
def atlas() -> ModuleType:
    """The module of Blender's scripts; it needs numpy alone."""
    return importlib.import_module("blender_scripts.bake.atlas")


def _quads(atlas: ModuleType, corners_m: np.ndarray) -> object:
    """Faces of quads f64[F, 4, 3]; corners at one place are one vertex, so quads that touch share an edge."""
    flat_m = corners_m.reshape(-1, 3)
    _, vertex = np.unique(np.round(flat_m, 6), axis=0, return_inverse=True)
    ends = np.stack([vertex.reshape(-1, 4), np.roll(vertex.reshape(-1, 4), -1, axis=1)], axis=-1).reshape(-1, 2)
    _, edge = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 3] - corners_m[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return atlas.Faces(flat_m, np.repeat(np.arange(len(corners_m)), 4), edge, normal)


def _box(size_m: tuple[float, float, float]) -> np.ndarray:
    """Six quads of a box, outwards."""
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / 2.0
    quads = []
    for axis in range(3):
        for side in (-0.5, 0.5):
            quad = np.insert(signs, axis, side, axis=1)
            outwards = np.cross(quad[1] - quad[0], quad[3] - quad[0])[axis] * side > 0
            quads.append(quad if outwards else quad[::-1])
    return np.stack(quads) * np.array(size_m)


def test_components_follow_chains_of_any_length(atlas: ModuleType) -> None:
    count = 200
    shuffled = np.random.default_rng(3).permutation(count)
    chain = np.concatenate([shuffled[:120], shuffled[119:120]])
    label = atlas.connected_components(count, chain[:-1], chain[1:])
    assert set(label[shuffled[:120]]) == {int(shuffled[:120].min())}
    np.testing.assert_array_equal(label[shuffled[120:]], shuffled[120:])


def test_a_box_has_six_charts_of_its_sides_sizes(atlas: ModuleType) -> None:
    charts = atlas.make_charts(_quads(atlas, _box((3.0, 2.0, 1.0))), np.ones(6, bool))
    sizes = sorted(map(tuple, np.round(charts.size_m, 9)))
    assert sizes == [(2.0, 1.0)] * 2 + [(3.0, 1.0)] * 2 + [(3.0, 2.0)] * 2


def test_unwanted_faces_get_no_chart(atlas: ModuleType) -> None:
    wanted = np.array([True, False, True, False, False, False])
    charts = atlas.make_charts(_quads(atlas, _box((3.0, 2.0, 1.0))), wanted)
    np.testing.assert_array_equal(charts.chart.reshape(6, 4)[:, 0] >= 0, wanted)
    assert len(charts.size_m) == 2


def test_a_ring_is_cut_so_that_its_hole_takes_no_texels(atlas: ModuleType) -> None:
    """Skirting round a room of 6 x 5 m, 2 cm deep, seen from above: 0.44 m2 in a box of 30 m2."""
    outer, inner = np.array([3.0, 2.5]), np.array([2.98, 2.48])
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    corners = np.concatenate([signs * outer, signs * inner])
    quads = np.array([[k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k] for k in range(4)])
    corners_m = np.column_stack([corners, np.zeros(8)])[quads]
    charts = atlas.make_charts(_quads(atlas, corners_m), np.ones(4, bool))
    assert charts.size_m.prod(axis=1).sum() < 0.6


def test_packed_charts_do_not_overlap_and_keep_their_border(atlas: ModuleType) -> None:
    rng = np.random.default_rng(5)
    boxes = [_box(tuple(rng.uniform(0.05, 1.5, 3))) + rng.uniform(-50, 50, 3) for _ in range(25)]
    charts = atlas.make_charts(_quads(atlas, np.concatenate(boxes)), np.ones(150, bool))
    density = rng.choice([20.0, 40.0, 80.0], len(charts.size_m))
    packing = atlas.pack(charts, density)
    uv_px = atlas.uv(charts, packing, density) * [packing.width_px, packing.height_px]
    taken = np.zeros((packing.height_px, packing.width_px), int)
    for chart in range(len(charts.size_m)):
        low, high = uv_px[charts.chart == chart].min(axis=0), uv_px[charts.chart == chart].max(axis=0)
        sides_px = np.maximum(charts.size_m[chart] * density[chart], atlas.MIN_CHART_PX)
        np.testing.assert_allclose(high - low, sides_px, atol=1e-2)
        assert (low > atlas.BORDER_PX - 0.01).all()
        first = np.floor(low + 0.01).astype(int) - atlas.BORDER_PX
        last = np.ceil(high - 0.01).astype(int) + atlas.BORDER_PX
        taken[first[1] : last[1], first[0] : last[0]] += 1
    assert taken.max() == 1
    assert taken.mean() > 0.7


def test_the_shared_scale_uses_the_budget_and_no_more(atlas: ModuleType) -> None:
    all_charts = [atlas.make_charts(_quads(atlas, _box((k + 1.0, 2.0, 1.0))), np.ones(6, bool)) for k in range(4)]
    densities = [np.full(6, wanted) for wanted in (100.0, 100.0, 150.0, 100.0)]

    def used(scale: float) -> int:
        pairs = zip(all_charts, densities, strict=True)
        return sum(atlas.texels(charts, scale * density) for charts, density in pairs)

    scale = atlas.shared_scale(all_charts, densities, 500_000, 1.5)
    step = 2.0 ** (1.0 / atlas.SCALES_PER_OCTAVE)
    assert used(scale) <= 500_000 < used(step * scale)
    # With texels to spare no texture gets finer than its views can show.
    assert 1.5 / step < atlas.shared_scale(all_charts, densities, 10**9, 1.5) <= 1.5


def test_a_chart_is_as_fine_as_its_closest_views(atlas: ModuleType) -> None:
    charts = atlas.make_charts(_quads(atlas, _box((3.0, 2.0, 1.0))), np.ones(6, bool))
    chart_of_polygon = charts.chart.reshape(6, 4)[:, 0]
    near, far = np.full(30, 400.0), np.full(70, 100.0)
    seen = atlas.Seen(np.array([0] * 100 + [3] * 50), np.concatenate([near, far, np.full(50, 50.0)]))
    density = atlas.seen_density(charts, chart_of_polygon, seen, 7.0)
    wanted, typical = density.close, density.typical
    nearest = 2.0 ** (0.5 / atlas.LEVELS_PER_OCTAVE)
    assert 400.0 / nearest <= wanted[chart_of_polygon[0]] <= 400.0 * nearest
    assert 100.0 / nearest <= typical[chart_of_polygon[0]] <= 100.0 * nearest
    assert 50.0 / nearest <= wanted[chart_of_polygon[3]] <= 50.0 * nearest
    # Sides that no ray met are as coarse as the coarsest that one did meet; an object that none met at all is coarser.
    np.testing.assert_array_equal(wanted[chart_of_polygon[[1, 2, 4, 5]]], wanted[chart_of_polygon[3]])
    nothing = atlas.Seen(np.zeros(0, int), np.zeros(0))
    unseen = atlas.seen_density(charts, chart_of_polygon, nothing, 7.0).close
    assert np.abs(np.log2(unseen / 7.0)).max() <= 0.5 / atlas.LEVELS_PER_OCTAVE


def test_close_surfaces_are_told_from_far_ones() -> None:
    """A camera looks down from 2 m at a small table, 1 m high, on a large floor."""
    side = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)

    def square(half_m: float, z_m: float) -> TriMesh:
        return TriMesh(np.column_stack([half_m * side, np.full(4, z_m)]), faces)

    objs = tuple(
        SceneObject(index, name, name, mesh, None, False, True)
        for index, name, mesh in ((5, "floor", square(10.0, 0.0)), (9, "table", square(0.4, 1.0)))
    )
    room = Room("room", "kitchen", np.zeros((4, 2)), 2.5, objs, (), None)
    pose = np.diag([1.0, -1.0, -1.0, 1.0])[None].copy()
    pose[0, 2, 3] = 2.0
    closeness = measure_closeness(room, (CameraPath(0, pose, Intrinsics.centred(100, 100, np.pi / 2.0)),))
    # The focal length is 50 pixels.
    assert set(closeness.object_index) == {5, 9}
    np.testing.assert_allclose(closeness.pixels_per_m[closeness.object_index == 9], 50.0, rtol=1e-4)
    np.testing.assert_allclose(closeness.pixels_per_m[closeness.object_index == 5], 25.0, rtol=1e-4)
    assert set(closeness.triangle[closeness.object_index == 9]) == {0, 1}


def test_blur_stays_in_its_chart_and_ignores_texels_that_were_not_baked(atlas: ModuleType) -> None:
    values = np.zeros((6, 16, 1), np.float32)
    known = np.zeros((6, 16), bool)
    known[1:5, 2:6] = known[1:5, 8:14] = True
    values[1:5, 2:6], values[1:5, 8:14] = 7.0, 90.0
    boxes = np.array([[0, 0, 8, 6], [8, 0, 16, 6]])
    even = values.copy()
    atlas.blur_charts(even, known, boxes, np.array([9.0, 2.5]))
    np.testing.assert_allclose(even, values, rtol=1e-5)
    values[2, 3] = 23.0
    atlas.blur_charts(values, known, boxes, np.array([2.5, 1.0]))
    # Weights 1-2-1 in both directions: a quarter of the difference stays in the middle.
    np.testing.assert_allclose(values[2, 3], 7.0 + 16.0 / 4.0, rtol=1e-5)
    # Over a single texel nothing is averaged.
    spot = np.where(np.arange(16) == 10, 5.0, 1.0)[None, :, None] * known[..., None]
    before = spot.copy()
    atlas.blur_charts(spot, known, boxes, np.array([1.0, 1.0]))
    np.testing.assert_array_equal(spot, before)


def test_the_budget_follows_the_work_ahead() -> None:
    config = RenderConfig(width_px=192, height_px=192, samples=24, max_texels=4_000_000)
    assert texel_budget(config, 1) == 0
    assert texel_budget(config, 8) == 600_000
    assert 600_000 < texel_budget(config, 60) < 4_000_000
    assert texel_budget(config, 10_000) == 4_000_000
    assert texel_budget(config.model_copy(update={"bake": False}), 10_000) == 0


def test_a_room_is_rendered_as_made_where_baking_does_not_pay(tmp_path: Path) -> None:
    blend = tmp_path / "room.blend"
    room = Room("room", "kitchen", np.zeros((4, 2)), 2.5, (), (), blend)
    assert bake_room(room, (), RenderConfig(width_px=64, height_px=48, samples=4), 24, tmp_path) == blend
