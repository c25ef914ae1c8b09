"""Which rooms pass, and which rule each bad room breaks."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from perpetua.geometry.mesh import TriMesh
from perpetua.navigation.config import NavigationConfig
from perpetua.rooms.acceptance import REQUIRED_FURNITURE, RoomRejected, check_room
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.rooms.types import Room, SceneObject

NAVIGATION = NavigationConfig(cell_m=0.1)
CONFIG = RoomsConfig()


def _thing(index: int, category: str, mesh: TriMesh) -> SceneObject:
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


def _block(size_m: float) -> TriMesh:
    """A tetrahedron on the floor in a corner of the room."""
    corners_m = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) * size_m - [1.5, 1.5, 0.0]
    return TriMesh(corners_m, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32))


def _room(kind: str = "bedroom", side_m: float = 4.0, missing: str | None = None) -> Room:
    polygon_m = 0.5 * side_m * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    furniture = [min(group) for group in REQUIRED_FURNITURE[kind] if missing is None or missing not in group]
    things = [_thing(1, "floor", _floor(side_m))]
    things += [_thing(index, category, _block(0.4)) for index, category in enumerate(furniture, start=2)]
    return Room("test", kind, polygon_m, 2.5, tuple(things), (), None)


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
    halves = replace(room, objects=(*room.objects, _thing(9, "wall", _wall_across(4.0))))
    # The whole has 11.8 square metres, each half less than 5.
    config = CONFIG.model_copy(update={"min_free_floor_m2": 5.0})
    check_room(room, config, NAVIGATION)
    assert _rule(halves, config) == "free floor"


def test_no_floor_at_all_is_a_rejection_and_no_error() -> None:
    assert _rule(_room(side_m=0.5)) == "free floor"


def test_equal_object_indices_are_rejected() -> None:
    room = _room()
    assert _rule(replace(room, objects=(*room.objects, _thing(1, "vase", _block(0.1))))) == "object indices"


@pytest.mark.parametrize("index", [0, 65536])
def test_object_indices_must_fit_sixteen_bits(index: int) -> None:
    room = _room()
    assert _rule(replace(room, objects=(*room.objects, _thing(index, "vase", _block(0.1))))) == "object indices"


def test_a_vertex_that_is_not_finite_is_rejected() -> None:
    room = _room()
    broken = _block(0.1)
    broken.vertices_m[2, 1] = np.nan
    assert _rule(replace(room, objects=(*room.objects, _thing(9, "vase", broken)))) == "finite vertices"


def test_triangle_budget_holds_to_the_triangle() -> None:
    room = _room()
    block = _block(0.4)
    many = TriMesh(block.vertices_m, np.tile(block.faces, (300, 1)))
    room = replace(room, objects=(*room.objects, _thing(9, "vase", many)))
    triangles = sum(len(thing.mesh.faces) for thing in room.objects)
    check_room(room, CONFIG.model_copy(update={"max_triangles": triangles}), NAVIGATION)
    assert _rule(room, CONFIG.model_copy(update={"max_triangles": triangles - 1})) == "triangles"
