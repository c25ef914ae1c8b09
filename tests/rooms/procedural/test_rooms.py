"""Built-in rooms: what stands where, of what, and in what light."""

import hashlib
import itertools
from functools import cache
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from matplotlib.path import Path as Outline

from perpetua.geometry.mesh import join
from perpetua.geometry.raycast import Caster
from perpetua.navigation.config import NavigationConfig
from perpetua.rooms.acceptance.checks import check_room
from perpetua.rooms.acceptance.support import find_faults
from perpetua.rooms.config import Daytime, RoomKind, RoomsConfig
from perpetua.rooms.procedural import ProceduralRooms
from perpetua.rooms.procedural.layout.plan import EXTRAS, Box, FloorPlan, RoomPlan
from perpetua.rooms.procedural.layout.sampling import sample_floor, sample_room
from perpetua.rooms.source import RoomRejected, RoomWish
from perpetua.scene.room import PATTERNS, Room
from perpetua.seeding import StageSeed
from tests.support.paths import SCRIPTS

CONFIG = RoomsConfig()
KINDS: tuple[RoomKind, ...] = ("bathroom", "bedroom", "diningroom", "kitchen", "livingroom")
SEEDS = range(4)
SEATS = frozenset({"sofa", "armchair", "chair", "stool", "bench", "bed"})


def wish_of(kind: RoomKind, seed: int, daytime: Daytime = "day", lamps_on: bool = True) -> RoomWish:
    sides = np.random.default_rng(seed).uniform(5.0, 7.0, 2).round(2)
    return RoomWish(kind, (float(sides[0]), float(sides[1]), 2.7), daytime, lamps_on)


@cache
def plan_of(kind: RoomKind, seed: int) -> RoomPlan:
    plan = sample_room(StageSeed(seed, 0, "room").stream("procedural", 0), wish_of(kind, seed))
    assert plan is not None
    return plan


@cache
def room_of(kind: RoomKind, seed: int, daytime: Daytime = "day", lamps_on: bool = True) -> Room:
    wish = wish_of(kind, seed, daytime, lamps_on)
    return ProceduralRooms().make(wish, CONFIG, StageSeed(seed, 0, "room"), 0, Path())


def test_kinds_are_those_of_the_schema() -> None:
    assert get_args(RoomKind) == KINDS


@pytest.mark.parametrize("kind", KINDS)
def test_pieces_keep_apart_and_inside(kind: RoomKind) -> None:
    for plan in (plan_of(kind, seed) for seed in SEEDS):
        for first, second in itertools.combinations(plan.pieces, 2):
            assert not first.box().overlaps(second.box(), -1e-6), (first, second)
        for piece in plan.pieces:
            assert plan.floor.contains(piece.box()), piece
            assert piece.box().low_m[2] >= 0.0
            assert piece.box().high_m[2] <= plan.height_m + 1e-9


@pytest.mark.parametrize("kind", KINDS)
def test_every_room_has_8_to_25_pieces_of_furniture(kind: RoomKind) -> None:
    for plan in (plan_of(kind, seed) for seed in SEEDS):
        furniture = [piece.category for piece in plan.pieces if piece.category not in EXTRAS]
        assert 8 <= len(furniture) <= 25, furniture
        assert len(set(furniture)) >= 7, furniture


@pytest.mark.parametrize("kind", KINDS)
def test_rooms_are_accepted(kind: RoomKind) -> None:
    room = room_of(kind, 3)
    check_room(room, CONFIG, NavigationConfig(cell_m=0.1))
    assert 10_000 < sum(len(obj.mesh.faces) for obj in room.objects) < 120_000


@pytest.mark.parametrize("kind", KINDS)
def test_meshes_stay_inside_the_walls(kind: RoomKind) -> None:
    """No vertex of a piece lies outside the floor polygon, whatever the shape of the room."""
    built_in = {"floor", "ceiling", "wall", "window", "door", "door_frame", "door_handle", "skirting_board"}
    for room in (room_of(kind, seed) for seed in SEEDS):
        vertices = [obj.mesh.vertices_m for obj in room.objects if obj.category not in built_in]
        corners = np.concatenate(vertices)
        # The far side of a chair's back may touch a wall: rounding is allowed for, a millimetre is not.
        outline = Outline(room.floor_polygon_m)
        middle = 0.999 * corners[:, :2]
        outside = ~(outline.contains_points(corners[:, :2]) | outline.contains_points(middle))
        off = corners[outside][:, :2]
        assert len(off) == 0 or _distance_to_outline(off, room.floor_polygon_m).max() < 1e-3
        assert corners[:, 2].min() > -1e-9
        assert corners[:, 2].max() < room.height_m + 1e-9


def _distance_to_outline(points: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    distances = []
    for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        along = end - start
        fraction = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        distances.append(np.linalg.norm(points - start - fraction[:, None] * along, axis=1))
    return np.asarray(np.min(distances, axis=0))


def test_about_a_third_of_large_rooms_are_l_shaped() -> None:
    shapes = [len(_floor_corners(seed)) for seed in range(60)]
    assert set(shapes) == {4, 6}
    assert 0.2 < shapes.count(6) / len(shapes) < 0.55


def _floor_corners(seed: int) -> np.ndarray:
    return sample_floor(np.random.default_rng(seed), wish_of("livingroom", seed)).corners_m


@pytest.mark.parametrize("corner", range(4))
def test_l_shape_is_the_rectangle_less_its_corner(corner: int) -> None:
    floor = FloorPlan(6.0, 5.0, corner, (2.0, 1.5))
    x, y = floor.corners_m.T
    area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    assert area == pytest.approx(6.0 * 5.0 - 2.0 * 1.5)
    assert floor.area_m2 == pytest.approx(area)
    assert floor.corners_m.min(0).tolist() == [-3.0, -2.5]
    assert floor.corners_m.max(0).tolist() == [3.0, 2.5]
    sign = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)][corner])
    cut = sign * (np.array([3.0, 2.5]) - 0.5)
    assert not Outline(floor.corners_m).contains_point(cut)
    assert not floor.contains(Box((*(cut - 0.1), 0.0), (*(cut + 0.1), 1.0)))
    assert floor.contains(Box((*(-cut - 0.1), 0.0), (*(-cut + 0.1), 1.0)))
    for number, wall in enumerate(floor.walls):
        assert wall.at(-0.5 * wall.length_m, 0.0) == pytest.approx(tuple(floor.corners_m[number]))
        assert wall.at(0.5 * wall.length_m, 0.0) == pytest.approx(tuple(floor.corners_m[(number + 1) % 6]))
        spot = wall.at(0.3, 0.7)
        assert (wall.along_m(spot), wall.off_m(spot)) == pytest.approx((0.3, 0.7))
        # A little into the room is inside, a little the other way is not.
        assert Outline(floor.corners_m).contains_point(wall.at(0.0, 0.01))
        assert not Outline(floor.corners_m).contains_point(wall.at(0.0, -0.01))


@pytest.mark.parametrize("seed", SEEDS)
def test_walls_are_closed_but_for_the_windows(seed: int) -> None:
    """Rays from the middle of the room leave it through the holes of the windows and nowhere else."""
    plan, room = plan_of("livingroom", seed), room_of("livingroom", seed)
    shell = {"floor", "ceiling", "wall", "door", "door_frame"}
    caster = Caster(join([obj.mesh for obj in room.objects if obj.category in shell]))
    turn, up = np.meshgrid(np.linspace(0.0, 2 * np.pi, 240, endpoint=False), np.linspace(-1.3, 1.3, 40))
    rays = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], axis=-1).reshape(-1, 3)
    start = np.array([0.0, 0.0, 1.2])
    hit = caster.first_hit(np.tile(start, (len(rays), 1)), rays).hit
    in_hole = np.zeros(len(rays), bool)
    for window in plan.windows:
        wall = plan.floor.walls[window.wall]
        corner, outside = np.array(wall.at(0.0, 0.0)), np.array(wall.at(0.0, -1.0))
        out = outside - corner
        facing = rays[:, :2] @ out > 1e-6
        distance = ((corner - start[:2]) @ out) / np.where(facing, rays[:, :2] @ out, np.nan)
        at = start + distance[:, None] * rays
        along = np.abs((at[:, :2] - np.array(wall.at(window.middle_m, 0.0))) @ np.array([out[1], -out[0]]))
        in_hole |= facing & (along < 0.5 * window.width_m) & (at[:, 2] > window.sill_m) & (at[:, 2] < window.head_m)
    assert (~hit & ~in_hole).sum() == 0
    assert (~hit).sum() > 0.5 * in_hole.sum() > 0


def test_seats_are_as_high_as_people_sit() -> None:
    """Most of the upward surface of each seat near the height of a knee lies 40 to 50 cm above the floor."""
    seen = set()
    for kind, seed in itertools.product(KINDS, SEEDS):
        for obj in room_of(kind, seed).objects:
            if obj.category in SEATS and obj.name.count("_") == 1:
                corners = obj.mesh.vertices_m[obj.mesh.faces]
                normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
                up = 0.5 * np.maximum(normal[:, 2], 0.0) * (normal[:, 2] > 0.8 * np.linalg.norm(normal, axis=1))
                height = corners[:, :, 2].mean(axis=1)
                seat_m2 = float(up[(height > 0.39) & (height < 0.51)].sum())
                assert seat_m2 > 0.05, (obj.name, seat_m2)
                seen.add(obj.category)
    assert seen == SEATS


def test_time_of_day_settles_sky_and_lamps() -> None:
    day, night = (room_of("bedroom", 0, daytime, daytime == "night") for daytime in ("day", "night"))
    assert day.sky is not None
    assert night.sky is not None
    assert night.sky.radiance_w_m2_sr < 0.05 * day.sky.radiance_w_m2_sr
    glowing = [
        {t.material.name for t in room.objects if t.material and t.material.emission_w_m2 > 0} for room in (day, night)
    ]
    assert glowing == [set(), {"lamp shade"}]
    outside = [
        max((light.power_w for light in room.lights if light.direction[2] > -0.99), default=0.0)
        for room in (day, night)
    ]
    assert outside[1] < 0.1 * outside[0]
    assert not any(light.direction == (0.0, 0.0, -1.0) for light in day.lights)
    assert any(light.direction == (0.0, 0.0, -1.0) for light in night.lights)
    # What the light is like changes nothing about what stands where.
    assert [obj.name for obj in day.objects] == [obj.name for obj in night.objects]
    assert all(
        np.array_equal(a.mesh.vertices_m, b.mesh.vertices_m) for a, b in zip(day.objects, night.objects, strict=True)
    )


@pytest.mark.parametrize("kind", KINDS)
def test_materials_are_of_the_known_patterns(kind: RoomKind) -> None:
    materials = [obj.material for obj in room_of(kind, 1).objects]
    assert all(material is not None and material.pattern in PATTERNS for material in materials)
    colors = np.array([(m.base_color, m.second_color) for m in materials if m is not None])
    assert colors.min() >= 0.0
    assert colors.max() <= 1.0
    assert len({material.pattern for material in materials if material is not None}) >= 5


def test_blender_knows_every_pattern() -> None:
    source = (SCRIPTS / "render" / "cheap_materials.py").read_text(encoding="utf-8")
    table = source[source.index("PATTERNS: dict") :]
    assert all(f'"{pattern}": _' in table for pattern in PATTERNS if pattern != "plain")


def test_same_seed_same_room() -> None:
    first, second = (
        ProceduralRooms().make(wish_of("kitchen", 5), CONFIG, StageSeed(5, 2, "room"), 1, Path()) for _ in range(2)
    )
    other = ProceduralRooms().make(wish_of("kitchen", 5), CONFIG, StageSeed(5, 2, "room"), 2, Path())
    assert _digest(first) == _digest(second)
    assert _digest(first) != _digest(other)
    assert first.lights == second.lights


def _digest(room: Room) -> str:
    digest = hashlib.sha256()
    for obj in room.objects:
        digest.update(f"{obj.name} {obj.category} {obj.object_index}".encode())
        digest.update(obj.mesh.vertices_m.tobytes() + obj.mesh.faces.tobytes())
        assert obj.material is not None
        digest.update(repr((obj.material.base_color, obj.material.pattern)).encode())
    return digest.hexdigest()


def test_room_too_small_for_its_furniture_is_rejected() -> None:
    with pytest.raises(RoomRejected, match="does not fit"):
        tiny = RoomWish("diningroom", (2.7, 2.7, 2.6), "day", True)
        ProceduralRooms().make(tiny, CONFIG, StageSeed(0, 0, "room"), 0, Path())


def test_a_bench_whose_feet_lie_in_the_plane_of_the_floor_stands() -> None:
    """Rays that see one of two surfaces at one place once found this bench hanging."""
    wish = RoomWish("bathroom", (5.66, 5.43, 2.64), "evening", True)
    room = ProceduralRooms().make(wish, CONFIG, StageSeed(8, 3, "room"), 0, Path())
    benches = [obj for obj in room.objects if obj.category == "bench"]
    assert benches and min(obj.mesh.vertices_m[:, 2].min() for obj in benches) == 0.0
    assert find_faults(room.objects) == ()
