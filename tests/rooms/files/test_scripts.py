"""The parts of the scene-file script that need no Blender: floor, scale, categories."""

import importlib
from types import ModuleType

import numpy as np
import pytest


def _module(name: str) -> ModuleType:
    return importlib.import_module(f"blender_scripts.scene_files.{name}")


def _rectangle(low: tuple[float, float], high: tuple[float, float], z_m: float, up: bool = True) -> np.ndarray:
    """Two triangles f64[2, 3, 3]."""
    a, b = np.array([*low, z_m]), np.array([high[0], low[1], z_m])
    c, d = np.array([*high, z_m]), np.array([low[0], high[1], z_m])
    triangles = np.array([[a, b, c], [a, c, d]])
    return triangles if up else triangles[:, ::-1]


def _box(low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    """Twelve triangles that face out."""
    import trimesh

    box = trimesh.creation.box(bounds=[low, high])
    return np.asarray(box.vertices[box.faces], np.float64)


def _room(height_m: float = 2.6) -> np.ndarray:
    """A floor slab of 5 x 4 m with its top at 0.3, four tables and a ceiling slab."""
    objs = [_box((0, 0, 0), (5, 4, 0.3)), _box((0, 0, 0.3 + height_m), (5, 4, 0.5 + height_m))]
    objs += [_box((x, y, 1.0), (x + 2, y + 1.5, 1.05)) for x in (0.2, 2.6) for y in (0.2, 2.2)]
    return np.concatenate(objs)


@pytest.mark.parametrize("scale", [0.001, 0.01, 1.0, 39.37, 1000.0])
def test_floor_and_ceiling_are_found_at_any_scale(scale: float) -> None:
    floors = _module("floor")
    corners_m = scale * _room()
    floor = floors.find_floor(corners_m, np.zeros(len(corners_m), bool), None)
    assert floor is not None
    assert floor.z_m == pytest.approx(0.3 * scale, rel=1e-6)
    assert floor.upward
    assert floor.low_m == pytest.approx([0.0, 0.0], abs=1e-9)
    assert floor.high_m == pytest.approx([5.0 * scale, 4.0 * scale])
    assert floor.area_m2 == pytest.approx(20.0 * scale**2, rel=0.05)
    assert floors.ceiling_height_m(corners_m, floor) == (pytest.approx(2.6 * scale), True)


def test_a_floor_seen_from_below_is_a_floor() -> None:
    corners_m = np.concatenate([_rectangle((0, 0), (5, 4), 0.0, up=False), _box((1, 1, 2), (2, 2, 2.5))])
    floor = _module("floor").find_floor(corners_m, np.zeros(len(corners_m), bool), None)
    assert floor is not None
    assert (floor.z_m, floor.upward) == (0.0, False)


def test_what_is_called_floor_or_given_wins_over_what_is_larger() -> None:
    corners_m = np.concatenate([_rectangle((-20, -20), (20, 20), -0.5), _rectangle((0, 0), (5, 4), 0.0)])
    corners_m = np.concatenate([corners_m, _box((0, 0, 2.5), (5, 4, 2.6))])
    find = _module("floor").find_floor
    nothing, named = np.zeros(len(corners_m), bool), np.zeros(len(corners_m), bool)
    named[2:4] = True
    assert find(corners_m, nothing, None).z_m == -0.5
    assert find(corners_m, named, None).z_m == 0.0
    assert find(corners_m, nothing, 0.02).z_m == 0.0
    assert find(corners_m, nothing, 1.5) is None


def test_only_what_hangs_together_is_the_floor() -> None:
    parts = [_rectangle((x, y), (x + 0.49, y + 0.49), 0.0) for x in np.arange(0, 4, 0.5) for y in np.arange(0, 3, 0.5)]
    far = [_rectangle((10, 10), (12, 11), 0.01), _box((0, 0, 2), (1, 1, 2.4))]
    corners_m = np.concatenate([*parts, *far])
    floor = _module("floor").find_floor(corners_m, np.zeros(len(corners_m), bool), None)
    assert floor.low_m == pytest.approx([0.0, 0.0])
    assert floor.high_m == pytest.approx([3.99, 2.99])
    assert floor.faces.sum() == 2 * len(parts)


def test_walls_alone_have_no_floor() -> None:
    corners_m = np.concatenate([_box((0, 0, 0), (5, 0.1, 2.5)), _box((0, 4, 0), (5, 4.1, 2.5))])
    assert _module("floor").find_floor(corners_m, np.zeros(len(corners_m), bool), None) is None


@pytest.mark.parametrize(
    ("sides_m", "height_m", "doors_m", "now", "measure", "advice"),
    [
        ((60.0, 50.0), 26.0, [20.5], 1.0, "tallest door measures 20.5 m", "perhaps to 0.1"),
        ((600.0, 500.0), 260.0, [], 1.0, "ceiling measures 260 m", "perhaps to 0.01"),
        ((0.06, 0.05), 0.026, [], 0.01, "ceiling measures 0.026 m", "perhaps to 1"),
        ((0.4, 0.5), None, [], 1.0, "shorter side of its floor measures 0.4 m", "perhaps to 10"),
        ((300.0, 20.0), 2.5, [2.0], 1.0, "longer side of its floor measures 300 m", "perhaps to"),
    ],
)
def test_a_wrong_scale_names_the_measure_and_the_unit(
    sides_m: tuple[float, float], height_m: float | None, doors_m: list[float], now: float, measure: str, advice: str
) -> None:
    refused = _module("refusal").Refused
    with pytest.raises(refused) as refusal:
        _module("scale").check_scale(np.array(sides_m), height_m, doors_m, now)
    assert refusal.value.rule == "scale"
    assert measure in str(refusal.value)
    assert f"rooms.file.metres_per_unit, {advice}" in str(refusal.value)


def test_rooms_of_people_pass() -> None:
    check = _module("scale").check_scale
    check(np.array([4.0, 6.0]), 2.5, [2.0, 0.1], 1.0)
    check(np.array([12.0, 20.0]), 8.0, [3.0], 0.01)
    check(np.array([3.0, 3.0]), None, [], 1.0)


@pytest.mark.parametrize(
    ("name", "around", "materials", "category"),
    [
        ("Floor_01", [], [], "floor"),
        ("FloorLamp.002", [], [], "floor_lamp"),
        ("wooden-floor", [], [], "floor"),
        ("KitchenCabinetDoor", [], [], "kitchen_cabinet"),
        ("kitchen table", [], [], "table"),
        ("tableLamp", [], [], "table_lamp"),
        ("Wall Art 3", [], [], "picture"),
        ("TVStand", [], [], "tv_bench"),
        ("Persian_Carpet", [], [], "rug"),
        ("Cube.014", ["Sofa", "Furniture"], [], "sofa"),
        ("Mesh_3", ["Collection"], ["Ceiling_Paint"], "ceiling"),
        ("Mesh_4", [], ["wall_paint", "floor_tiles"], "clutter"),
        ("Object_7", [], ["dark wood"], "clutter"),
        ("mattress.001", [], [], "mattress"),
    ],
)
def test_names_tell_categories(name: str, around: list[str], materials: list[str], category: str) -> None:
    assert _module("categories").guess_category(name, around, materials) == category
