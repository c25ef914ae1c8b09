"""The navigation grid against shapes whose distances are known exactly."""

import numpy as np
import pytest
import trimesh
from jaxtyping import Float64

from perpetua.errors import NavigationError
from perpetua.geometry.mesh import TriMesh
from perpetua.navigation.config import NavigationConfig
from perpetua.navigation.grid import build_nav_grid
from perpetua.navigation.raster import Raster, inside_polygon, touched_cells
from perpetua.navigation.types import NavGrid
from perpetua.scene.room import Room, SceneObject

CONFIG = NavigationConfig()


def box(size_m: tuple[float, float, float], low_m: tuple[float, float, float]) -> TriMesh:
    mesh = trimesh.creation.box(extents=size_m)
    mesh.apply_translation(np.array(low_m) + np.array(size_m) / 2)
    return TriMesh(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32))


def room_with(*furniture: TriMesh, rug: TriMesh | None = None, side_m: tuple[float, float] = (4.0, 3.0)) -> Room:
    width_m, depth_m = side_m
    floor = box((width_m, depth_m, 0.1), (-width_m / 2, -depth_m / 2, -0.1))
    walkable = [floor] if rug is None else [floor, rug]
    meshes = [(mesh, True) for mesh in walkable] + [(mesh, False) for mesh in furniture]
    objects = tuple(
        SceneObject(index, f"thing_{index}", "thing", mesh, None, walks, True)
        for index, (mesh, walks) in enumerate(meshes, start=1)
    )
    corners = np.array([[-width_m, -depth_m], [width_m, -depth_m], [width_m, depth_m], [-width_m, depth_m]]) / 2
    return Room("test", "bedroom", corners, 2.6, objects, (), None)


def centres(grid: NavGrid) -> Float64[np.ndarray, "X Y 2"]:
    return Raster(grid.origin_m, grid.cell_m, (grid.free.shape[0], grid.free.shape[1])).centres_m()


def cell_at(grid: NavGrid, x: float, y: float) -> tuple[int, int]:
    i, j = np.round((np.array([x, y]) - grid.origin_m) / grid.cell_m).astype(int)
    return int(i), int(j)


def test_clearance_never_exceeds_the_exact_distance_and_is_close_to_it() -> None:
    leg = box((0.004, 0.004, 0.7), (0.9, 0.4, 0.0))
    grid = build_nav_grid(room_with(leg), CONFIG)
    x, y = centres(grid)[..., 0], centres(grid)[..., 1]
    to_leg = np.hypot(np.maximum(np.abs(x - 0.902) - 0.002, 0), np.maximum(np.abs(y - 0.402) - 0.002, 0))
    exact_m = np.minimum.reduce([2.0 - np.abs(x), 1.5 - np.abs(y), to_leg])
    error_m = (exact_m - grid.clearance_m)[exact_m > 0]
    assert error_m.min() > -1e-6
    assert error_m.max() < 0.04
    assert np.array_equal(grid.free, grid.clearance_m >= CONFIG.body_radius_m)


@pytest.mark.parametrize(
    ("low_z_m", "high_z_m", "blocks"),
    [(0.70, 0.73, True), (1.90, 2.00, True), (2.00, 2.30, False), (0.0, 0.05, False), (0.0, 0.12, True)],
)
def test_only_what_is_between_step_and_head_is_in_the_way(low_z_m: float, high_z_m: float, blocks: bool) -> None:
    plate = box((0.5, 0.5, high_z_m - low_z_m), (-0.25, -0.25, low_z_m))
    grid = build_nav_grid(room_with(plate), CONFIG)
    assert grid.free[cell_at(grid, 0.0, 0.0)] == (not blocks)


def test_rug_is_stood_on() -> None:
    grid = build_nav_grid(room_with(rug=box((1.0, 1.0, 0.01), (-0.5, -0.5, 0.0))), CONFIG)
    assert grid.floor_z_m[cell_at(grid, 0.0, 0.0)] == pytest.approx(0.01)
    assert grid.floor_z_m[cell_at(grid, 1.0, 0.0)] == pytest.approx(0.0)
    assert grid.free[cell_at(grid, 0.5, 0.0)]


def test_high_platform_is_not_stepped_on_and_low_one_is() -> None:
    def free_across_the_edge(height_m: float) -> bool:
        grid = build_nav_grid(room_with(rug=box((2.0, 3.0, height_m), (0.0, -1.5, 0.0))), CONFIG)
        assert grid.floor_z_m[cell_at(grid, 1.0, 0.0)] == pytest.approx(height_m)
        return bool(grid.free[cell_at(grid, 0.0, 0.0)])

    assert free_across_the_edge(CONFIG.step_m - 0.01)
    assert not free_across_the_edge(CONFIG.step_m + 0.01)
    assert not free_across_the_edge(0.25)


def test_table_top_is_no_floor() -> None:
    table = box((1.4, 1.0, 0.03), (-0.7, -0.5, 0.4))
    grid = build_nav_grid(room_with(table), CONFIG)
    assert not grid.free[cell_at(grid, 0.0, 0.0)]
    assert grid.floor_z_m.max() == 0.0


def test_free_floor_keeps_the_body_radius_and_no_more() -> None:
    pillar = box((0.4, 0.4, 2.0), (-0.2, -0.2, 0.0))
    for radius_m in (0.2, 0.35):
        grid = build_nav_grid(room_with(pillar), NavigationConfig(body_radius_m=radius_m))
        x, y = centres(grid)[grid.free].T
        to_pillar_m = np.hypot(np.maximum(np.abs(x) - 0.2, 0.0), np.maximum(np.abs(y) - 0.2, 0.0))
        to_wall_m = np.minimum(2.0 - np.abs(x), 1.5 - np.abs(y))
        assert radius_m <= to_pillar_m.min() < radius_m + 0.07
        assert radius_m <= to_wall_m.min() < radius_m + 0.07


def test_regions_large_enough_are_kept_and_the_largest_always() -> None:
    wall = box((0.02, 3.0, 2.0), (0.6, -1.5, 0.0))
    larger_m2, smaller_m2 = (2.6 - 0.56) * (3.0 - 0.56), (1.38 - 0.56) * (3.0 - 0.56)
    for min_region_m2, kept in ((0.0, True), (smaller_m2 - 0.3, True), (smaller_m2 + 0.3, False), (90.0, False)):
        grid = build_nav_grid(room_with(wall), NavigationConfig(min_region_m2=min_region_m2))
        assert grid.free[cell_at(grid, -1.0, 0.0)]
        assert grid.free[cell_at(grid, 1.3, 0.0)] == kept
        assert grid.free_floor_m2 == pytest.approx(larger_m2, abs=0.25)


def test_hole_in_the_floor_is_no_floor() -> None:
    room = room_with()
    l_shape = np.array([[-2, -1.5], [2, -1.5], [2, 0], [0, 0], [0, 1.5], [-2, 1.5]], np.float64)
    grid = build_nav_grid(Room("l", "bedroom", l_shape, 2.6, room.objects, (), None), CONFIG)
    assert not grid.free[cell_at(grid, 1.0, 0.75)]
    assert grid.free[cell_at(grid, 1.0, -0.75)]


def test_room_without_free_floor_says_how_much_there_is() -> None:
    with pytest.raises(NavigationError, match=r"needs 0\.28 m .* leaves 0\.\d\d m: lower navigation\.body_radius_m"):
        build_nav_grid(room_with(side_m=(0.5, 3.0)), CONFIG)


def test_sliver_touches_every_cell_on_its_way() -> None:
    raster = Raster(np.zeros(2), 0.1, (50, 50))
    sliver = np.array([[[0.03, 0.01, 1.0], [4.83, 3.71, 1.0], [4.83, 3.71001, 1.0]]])
    claimed = {int(cell) for touches in touched_cells(raster, sliver, 0.0, 2.0) for cell in touches.cell}
    along = sliver[0, 0, :2] + np.linspace(0, 1, 20_000)[:, None] * (sliver[0, 1, :2] - sliver[0, 0, :2])
    i, j = np.floor(along / 0.1 + 0.5).astype(int).T
    assert set(i * 50 + j) <= claimed
    assert len(claimed) < 4 * len(set(i * 50 + j))


def test_inside_polygon_of_a_notched_square() -> None:
    notched = np.array([[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]], np.float64)
    points = np.array([[2.0, 0.5], [2.0, 2.0], [0.5, 2.0], [3.5, 2.0], [5.0, 1.0]])
    assert inside_polygon(points, notched).tolist() == [True, False, True, True, False]
