"""What every room source keeps, whatever it makes rooms from."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from perpetua.navigation.config import NavigationConfig
from perpetua.navigation.grid import build_nav_grid
from perpetua.navigation.types import NavGrid
from perpetua.rooms.acceptance.build import build_room
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.rooms.source import ROOM_SOURCES, draw_wish
from perpetua.scene.room import Material, Room
from perpetua.seeding import StageSeed
from perpetua.testing.samples import RoomSample

NAVIGATION = NavigationConfig()
SEED = StageSeed(3, 1, "room")
# Rooms of a kind that can be asked for hold at least so many categories of objects, floor and walls included.
LEAST_CATEGORIES = 8


@dataclass(frozen=True)
class Made:
    """A room, what was asked for, and where one can walk in it."""

    config: RoomsConfig
    kind: str
    furnished: bool
    room: Room
    grid: NavGrid


@pytest.fixture(scope="module")
def made(room_case: tuple[str, RoomKind, RoomSample], tmp_path_factory: pytest.TempPathFactory) -> Made:
    """One room of each source and kind."""
    source, kind, sample = room_case
    config = sample.config(source, kind, tmp_path_factory.mktemp("given"))
    room = build_room(config, NAVIGATION, SEED, tmp_path_factory.mktemp("room"))
    return Made(config, sample.made_kind or kind, sample.made_kind is None, room, build_nav_grid(room, NAVIGATION))


def test_room_is_of_the_kind_and_large_enough(made: Made) -> None:
    room = made.room
    config = RoomsConfig()
    sides_m = np.ptp(room.floor_polygon_m, axis=0)
    assert room.kind == made.kind
    assert room.name
    # Bathrooms may be smaller.
    assert 0.8 * config.min_side_m - 0.3 <= sides_m.min()
    assert sides_m.max() <= config.max_side_m + 0.3
    assert 2.2 <= room.height_m <= 4.0


def test_origin_is_on_the_floor_in_the_middle(made: Made) -> None:
    room = made.room
    middle_m = 0.5 * (room.floor_polygon_m.min(0) + room.floor_polygon_m.max(0))
    assert np.abs(middle_m).max() < 0.05
    grid = made.grid
    assert abs(float(np.median(grid.floor_z_m[grid.free]))) < 0.02


def test_floor_polygon_is_simple_and_counter_clockwise(made: Made) -> None:
    corners_m = made.room.floor_polygon_m
    following_m = np.roll(corners_m, -1, axis=0)
    area_m2 = 0.5 * float((corners_m[:, 0] * following_m[:, 1] - corners_m[:, 1] * following_m[:, 0]).sum())
    assert area_m2 > 9.0


def test_objects_are_well_formed(made: Made) -> None:
    room = made.room
    indices = [thing.object_index for thing in room.objects]
    names = [thing.name for thing in room.objects]
    assert len(set(indices)) == len(indices)
    assert len(set(names)) == len(names)
    assert min(indices) >= 1
    assert room.next_object_index == max(indices) + 1
    for thing in room.objects:
        assert thing.category, thing.name
        assert np.isfinite(thing.mesh.vertices_m).all(), thing.name
        if len(thing.mesh.faces):
            assert thing.mesh.faces.min() >= 0, thing.name
            assert thing.mesh.faces.max() < len(thing.mesh.vertices_m), thing.name
        assert room.blend_path is not None or thing.material is not None, thing.name


def test_room_is_closed_below_and_above_and_furnished(made: Made) -> None:
    room = made.room
    categories = {thing.category for thing in room.objects}
    assert any(thing.walkable for thing in room.objects)
    assert {"floor", "wall", "ceiling"} <= categories
    assert len(categories) >= LEAST_CATEGORIES or not made.furnished
    vertices_m = np.concatenate([thing.mesh.vertices_m for thing in room.objects])
    assert vertices_m[:, 2].max() >= room.height_m - 0.05
    reach_m = np.abs(room.floor_polygon_m).max(0) + 1.5
    assert (np.abs(vertices_m[:, :2]) <= reach_m).all()


def test_four_people_can_walk(made: Made) -> None:
    assert made.grid.free_floor_m2 >= RoomsConfig().min_free_floor_m2


def test_light_comes_from_lamps_or_from_the_blend(made: Made) -> None:
    room = made.room
    assert room.lights or room.blend_path is not None
    for light in room.lights:
        assert light.power_w > 0
        assert np.linalg.norm(light.direction) == pytest.approx(1.0, abs=0.01)


def _same_material(first: Material | None, second: Material | None) -> bool:
    if first is None or second is None or first.image is None or second.image is None:
        return first == second
    plain = replace(first, image=None) == replace(second, image=None)
    return plain and np.array_equal(first.image, second.image)


def test_same_seed_same_room(made: Made, tmp_path: Path) -> None:
    config, room = made.config, made.room
    again = build_room(config, NAVIGATION, SEED, tmp_path)
    assert np.array_equal(room.floor_polygon_m, again.floor_polygon_m)
    assert room.lights == again.lights
    assert [thing.name for thing in room.objects] == [thing.name for thing in again.objects]
    for first, second in zip(room.objects, again.objects, strict=True):
        assert _same_material(first.material, second.material), first.name
        assert np.array_equal(first.mesh.vertices_m, second.mesh.vertices_m), first.name
        assert np.array_equal(first.mesh.faces, second.mesh.faces), first.name


def test_another_attempt_is_another_room(many_rooms: tuple[str, RoomSample], tmp_path: Path) -> None:
    # Where a draw takes a minute, the source's own tests show that the attempt reaches its job.
    source, sample = many_rooms
    kind = sample.kinds[0]
    given = tmp_path / "given"
    given.mkdir()
    config = sample.config(source, kind, given)
    first, other = (
        ROOM_SOURCES[source]().make(
            draw_wish(kind, config, SEED.stream("wish", attempt)), config, SEED, attempt, tmp_path
        )
        for attempt in (0, 1)
    )
    assert not np.array_equal(first.floor_polygon_m, other.floor_polygon_m)
