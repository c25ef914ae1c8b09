"""Which rooms pass, and which rule each bad room breaks."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from perpetua.geometry.mesh import TriMesh, join
from perpetua.navigation.config import NavigationConfig
from perpetua.rooms.acceptance.checks import REQUIRED_FURNITURE, check_room
from perpetua.rooms.acceptance.support import find_faults
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.rooms.source import RoomRejected
from perpetua.scene.room import Room, SceneObject

NAVIGATION = NavigationConfig(cell_m=0.1)
CONFIG = RoomsConfig()


def _object(index: int, category: str, mesh: TriMesh) -> SceneObject:
    return SceneObject(index, f"{category}_{index}", category, mesh, None, walkable=category == "floor", opaque=True)


def _floor(side_m: float) -> TriMesh:
    half_m = 0.5 * side_m
    corners_m = np.array([[-half_m, -half_m, 0], [half_m, -half_m, 0], [half_m, half_m, 0], [-half_m, half_m, 0]])
    return TriMesh(corners_m, np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def _wall_across(side_m: float) -> TriMesh:
    """A wall through the middle of the room, from side to side."""
    half_m = 0.5 * side_m
    corners_m = np.array([[0, -half_m, 0], [0, half_m, 0], [0, half_m, 2.5], [0, -half_m, 2.5]])
    return TriMesh(corners_m, np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def _block(size_m: float, number: int = 0) -> TriMesh:
    """A tetrahedron on the floor at a side of the room, each number at a place of its own."""
    corners_m = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * size_m - [1.5, 1.5 - 0.5 * number, 0.0]
    return TriMesh(corners_m, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32))


def _room(kind: str = "bedroom", side_m: float = 4.0, missing: str | None = None) -> Room:
    polygon_m = 0.5 * side_m * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    furniture = [min(group) for group in REQUIRED_FURNITURE[kind] if missing is None or missing not in group]
    objs = [_object(1, "floor", _floor(side_m))]
    objs += [_object(index, category, _block(0.4, index - 2)) for index, category in enumerate(furniture, start=2)]
    return Room("test", kind, polygon_m, 2.5, tuple(objs), (), None)


def _rule(room: Room, config: RoomsConfig = CONFIG) -> str:
    with pytest.raises(RoomRejected) as rejection:
        check_room(room, config, NAVIGATION)
    return rejection.value.rule


@pytest.mark.parametrize("kind", get_args(RoomKind))
def test_a_room_with_its_furniture_and_floor_passes(kind: str) -> None:
    check_room(_room(kind), CONFIG, NAVIGATION)


@pytest.mark.parametrize(
    ("kind", "category"), [(kind, min(group)) for kind in get_args(RoomKind) for group in REQUIRED_FURNITURE[kind]]
)
def test_missing_furniture_is_named(kind: str, category: str) -> None:
    room = _room(kind, missing=category)
    with pytest.raises(RoomRejected, match=f"'{category}'") as rejection:
        check_room(room, CONFIG, NAVIGATION)
    assert rejection.value.rule == "furniture"


def test_too_little_floor_is_rejected() -> None:
    # 2.8 m less the body's radius on both sides leaves 2.24 m x 2.24 m = 5.0 square metres.
    assert _rule(_room(side_m=2.8)) == "free floor"


def test_only_the_largest_connected_floor_counts() -> None:
    room = _room(side_m=4.0)
    halves = replace(room, objects=(*room.objects, _object(9, "wall", _wall_across(4.0))))
    # The whole has 11.8 square metres, each half less than 5.
    config = CONFIG.model_copy(update={"min_free_floor_m2": 5.0})
    check_room(room, config, NAVIGATION)
    assert _rule(halves, config) == "free floor"


def test_no_floor_at_all_is_a_rejection_and_no_error() -> None:
    assert _rule(_room(side_m=0.5)) == "free floor"


def test_equal_object_indices_are_rejected() -> None:
    room = _room()
    assert _rule(replace(room, objects=(*room.objects, _object(1, "vase", _block(0.1))))) == "object indices"


@pytest.mark.parametrize("index", [0, 65536])
def test_object_indices_must_fit_sixteen_bits(index: int) -> None:
    room = _room()
    assert _rule(replace(room, objects=(*room.objects, _object(index, "vase", _block(0.1))))) == "object indices"


def test_a_vertex_that_is_not_finite_is_rejected() -> None:
    room = _room()
    broken = _block(0.1)
    broken.vertices_m[2, 1] = np.nan
    assert _rule(replace(room, objects=(*room.objects, _object(9, "vase", broken)))) == "finite vertices"


def test_triangle_budget_holds_to_the_triangle() -> None:
    room = _room()
    block = _block(0.4, 3)
    many = TriMesh(block.vertices_m, np.tile(block.faces, (300, 1)))
    room = replace(room, objects=(*room.objects, _object(9, "vase", many)))
    triangles = sum(len(obj.mesh.faces) for obj in room.objects)
    check_room(room, CONFIG.model_copy(update={"max_triangles": triangles}), NAVIGATION)
    assert _rule(room, CONFIG.model_copy(update={"max_triangles": triangles - 1})) == "triangles"


def _box(low_m: tuple[float, float, float], high_m: tuple[float, float, float]) -> TriMesh:
    low, high = np.array(low_m), np.array(high_m)
    corners_m = low + (high - low) * np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float64)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [(a, b, c) for a, b, c, _ in quads] + [(a, c, d) for a, _, c, d in quads]
    return TriMesh(corners_m, np.array(faces, np.int32))


def _with(*objs: SceneObject) -> Room:
    """A room with a wall at x = 2 and these objects."""
    room = _room()
    wall = _object(5, "wall", _box((2.0, -2.0, 0.0), (2.1, 2.0, 2.5)))
    return replace(room, objects=(*room.objects, wall, *objs))


def _table(index: int, lift_m: float = 0.0) -> SceneObject:
    """A top of 0.8 m x 0.8 m on four legs, 0.7 m high."""
    corners = [(x, y) for x in (0.0, 0.75) for y in (0.0, 0.75)]
    legs = [_box((x, y, lift_m), (x + 0.05, y + 0.05, 0.66 + lift_m)) for x, y in corners]
    top = _box((0.0, 0.0, 0.66 + lift_m), (0.8, 0.8, 0.7 + lift_m))
    return _object(index, "table", join([*legs, top]))


def _faults(*objs: SceneObject) -> list[tuple[str, bool, float]]:
    found = find_faults(_with(*objs).objects)
    return [(fault.name, fault.floats, round(fault.distance_m, 2)) for fault in found]


@pytest.mark.parametrize("gap_m", [-0.025, 0.0, 0.025])
def test_what_stands_within_three_centimetres_is_no_fault(gap_m: float) -> None:
    cup = _object(11, "cup", _box((0.3, 0.3, 0.7 + gap_m), (0.38, 0.38, 0.8 + gap_m)))
    assert _faults(_table(10), cup) == []
    assert _faults(_table(10, lift_m=gap_m)) == []


def test_what_floats_is_found_with_its_drop() -> None:
    assert _faults(_table(10, lift_m=0.04)) == [("table_10", True, 0.04)]
    cup = _object(11, "cup", _box((0.3, 0.3, 0.74), (0.38, 0.38, 0.84)))
    assert _faults(_table(10), cup) == [("cup_11", True, 0.04)]


def test_what_stands_on_a_floating_table_floats_with_it() -> None:
    cup = _object(11, "cup", _box((0.3, 0.3, 1.0), (0.38, 0.38, 1.1)))
    assert [name for name, _, _ in _faults(_table(10, lift_m=0.3), cup)] == ["table_10", "cup_11"]


def test_what_is_sunk_is_found_with_its_depth() -> None:
    cup = _object(11, "cup", _box((0.3, 0.3, 0.66), (0.38, 0.38, 0.78)))
    assert _faults(_table(10), cup) == [("cup_11", False, 0.04)]
    assert _faults(_table(10, lift_m=-0.05)) == [("table_10", False, 0.05)]


def test_a_chair_under_a_table_is_not_sunk() -> None:
    chair = join([_box((0.2, 0.2, 0.0), (0.6, 0.6, 0.45)), _box((0.2, 0.2, 0.45), (0.25, 0.6, 0.6))])
    assert _faults(_table(10), _object(11, "chair", chair)) == []


def test_a_chair_does_not_hang_on_a_wall_but_a_painting_does() -> None:
    beside_wall = _box((1.6, 0.0, 0.3), (1.99, 0.4, 0.8))
    assert _faults(_object(10, "chair", beside_wall)) == [("chair_10", True, 0.3)]
    assert _faults(_object(10, "painting", beside_wall)) == []
    away = _box((1.6, 0.0, 0.3), (1.96, 0.4, 0.8))
    assert _faults(_object(10, "painting", away)) == [("painting_10", True, 0.3)]


def test_a_shade_belongs_to_its_lamp() -> None:
    pole = _object(10, "floor_lamp", _box((0.5, 0.5, 0.0), (0.52, 0.52, 1.5)))
    ring = [_box((x, 0.3, 1.2), (x + 0.01, 0.7, 1.4)) for x in (0.3, 0.7)]
    assert _faults(pole, _object(11, "floor_lamp", join(ring))) == []
    assert _faults(_object(11, "floor_lamp", join(ring))) == [("floor_lamp_11", True, 1.2)]


def test_a_room_with_something_in_the_air_is_rejected() -> None:
    assert _rule(_with(_table(10, lift_m=0.1))) == "support"
    check_room(_with(_table(10)), CONFIG, NAVIGATION)
