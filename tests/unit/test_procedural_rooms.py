"""Built-in rooms: what stands where, of what, and how solidly."""

import itertools
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import trimesh

from perpetua.navigation.config import NavigationConfig
from perpetua.rooms.acceptance import RoomRejected, check_room
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.rooms.procedural import ProceduralRooms
from perpetua.rooms.procedural.building import BUILDERS, build_piece
from perpetua.rooms.procedural.palette import sample_palette
from perpetua.rooms.procedural.parts import bar, block, folds, lathe
from perpetua.rooms.procedural.plan import DETAILS, Piece, RoomPlan
from perpetua.rooms.procedural.sampling import sample_room
from perpetua.rooms.source import RoomWish, draw_wish
from perpetua.seeding import StageSeed

CONFIG = RoomsConfig()
KINDS: tuple[RoomKind, ...] = ("bathroom", "bedroom", "diningroom", "kitchen", "livingroom")
SEEDS = range(2)


def wish(kind: RoomKind, seed: int) -> RoomWish:
    return draw_wish(kind, CONFIG, StageSeed(seed, 0, "room").stream("wish"))


def plan_of(kind: RoomKind, seed: int) -> RoomPlan:
    plan = sample_room(StageSeed(seed, 0, "room").stream("test"), wish(kind, seed))
    assert plan is not None
    return plan


def test_kinds_are_those_of_the_schema() -> None:
    assert get_args(RoomKind) == KINDS


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", SEEDS)
def test_pieces_keep_apart_and_inside(kind: RoomKind, seed: int) -> None:
    plan = plan_of(kind, seed)
    half = (0.5 * plan.width_m, 0.5 * plan.depth_m, plan.height_m)
    for first, second in itertools.combinations(plan.pieces, 2):
        assert not first.box().overlaps(second.box(), -1e-6), (first.category, second.category)
    for piece in plan.pieces:
        low, high = np.array(piece.box().low_m), np.array(piece.box().high_m)
        assert (low >= np.array([-half[0], -half[1], 0.0]) - 1e-9).all(), piece.category
        assert (high <= np.array(half) + 1e-9).all(), piece.category


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_floats(kind: RoomKind, seed: int) -> None:
    """Each piece touches the floor, the top of another piece under it, a wall behind it, or the ceiling."""
    plan = plan_of(kind, seed)
    for piece in plan.pieces:
        low, high = np.array(piece.box().low_m), np.array(piece.box().high_m)
        on_floor = low[2] == 0.0
        at_ceiling = abs(high[2] - plan.height_m) < 1e-6
        to_wall = min(
            plan.width_m / 2 - np.abs([low[0], high[0]]).max(), plan.depth_m / 2 - np.abs([low[1], high[1]]).max()
        )
        tops = [other.box() for other in plan.pieces if other is not piece]
        carried = any(
            abs(box.high_m[2] - low[2]) < 1e-6
            and all(box.low_m[axis] <= low[axis] + 1e-6 and high[axis] <= box.high_m[axis] + 1e-6 for axis in range(2))
            for box in tops
        )
        assert on_floor or at_ceiling or carried or to_wall < 0.045, (piece.category, low, high)


@pytest.mark.parametrize("category", sorted(BUILDERS))
def test_piece_is_solid_and_fills_its_box(category: str) -> None:
    sizes = {
        "sofa": (2.2, 0.92, 0.82),
        "bed": (1.6, 2.08, 1.0),
        "fridge": (0.68, 0.68, 1.85),
        "bathtub": (1.75, 0.8, 0.58),
    }
    sizes |= {"kitchen_counter": (2.6, 0.63, 0.91), "shower": (0.95, 0.95, 2.1), "curtain": (0.32, 0.10, 2.2)}
    sizes |= {
        "curtain_rod": (1.9, 0.18, 0.04),
        "rug": (2.0, 1.3, 0.01),
        "toilet": (0.4, 0.68, 0.8),
        "armchair": (0.85, 0.86, 0.82),
    }
    size = sizes.get(category, (0.5, 0.5, 0.9))
    detail = tuple(np.random.default_rng(3).uniform(size=DETAILS).tolist())
    palette = sample_palette(np.random.default_rng(4), "livingroom")
    parts = build_piece(Piece(category, size, (0.0, 0.0, 0.0), 0, detail), palette)
    for part in parts:
        mesh = trimesh.Trimesh(part.mesh.vertices_m, part.mesh.faces, process=False)
        assert mesh.is_watertight, part.label
        assert mesh.is_winding_consistent, part.label
        assert all(body.volume > 0 for body in mesh.split(only_watertight=False)), part.label
    vertices = np.concatenate([part.mesh.vertices_m for part in parts])
    # Taps, pillows and lids may stand out a little, and a piece must come near each face of its box.
    assert (vertices.min(0) >= np.array([-0.5 * size[0], 0.0, 0.0]) - 1e-9).all()
    assert (vertices[:, :2].max(0) <= np.array([0.5 * size[0], size[1]]) + 1e-9).all()
    assert 0.8 * size[2] <= vertices[:, 2].max() <= size[2] + 0.3


@pytest.mark.parametrize("kind", KINDS)
def test_default_rooms_are_acceptable(kind: RoomKind) -> None:
    room = ProceduralRooms().make(wish(kind, 11), CONFIG, StageSeed(11, 0, "room"), 0, Path())
    check_room(room, CONFIG, NavigationConfig(cell_m=0.1))
    assert len({thing.category for thing in room.objects if thing.category not in ("floor", "wall", "ceiling")}) >= 8
    assert any(light.direction == (0.0, 0.0, -1.0) for light in room.lights)
    assert any(light.direction[2] > -0.5 for light in room.lights)


def test_room_too_small_for_its_furniture_is_rejected() -> None:
    with pytest.raises(RoomRejected, match="does not fit"):
        tiny = RoomWish("diningroom", (2.7, 2.7, 2.6), "day", True)
        ProceduralRooms().make(tiny, CONFIG, StageSeed(0, 0, "room"), 0, Path())


def test_walls_are_open_at_windows_and_closed_elsewhere() -> None:
    plan = plan_of("livingroom", 0)
    room = ProceduralRooms().make(wish("livingroom", 0), CONFIG, StageSeed(0, 0, "room"), 0, Path())
    walls = [thing.mesh for thing in room.objects if thing.category == "wall"]
    inside_m2 = sum(trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False).volume for mesh in walls)
    x, y = np.ptp(room.floor_polygon_m, axis=0)
    assert plan.wall_thickness_m == 0.2
    whole_m3 = ((x + 0.4) * (y + 0.4) - x * y) * room.height_m
    assert 0.7 * whole_m3 < inside_m2 < whole_m3 - 0.2 * 0.9 * 2.0


def test_block_has_the_volume_of_its_corners() -> None:
    mesh = block((0.0, 1.0, 2.0), (0.5, 1.2, 3.0), 0.001)
    assert trimesh.Trimesh(mesh.vertices_m, mesh.faces).volume == pytest.approx(0.1, rel=1e-3)
    assert mesh.vertices_m.min(0) == pytest.approx([0.0, 1.0, 2.0])
    assert mesh.vertices_m.max(0) == pytest.approx([0.5, 1.2, 3.0])


def test_lathe_and_bar_have_the_volume_of_a_cylinder() -> None:
    sides = 64
    area = 0.5 * sides * np.sin(2 * np.pi / sides) * 0.2**2
    upright = lathe([(0.0, 0.0), (0.2, 0.0), (0.2, 0.7), (0.0, 0.7)], (1.0, 1.0), sides)
    slanted = bar((0.0, 0.0, 0.0), (0.3, 0.6, 0.2), 0.2, sides)
    assert trimesh.Trimesh(upright.vertices_m, upright.faces).volume == pytest.approx(area * 0.7)
    assert trimesh.Trimesh(slanted.vertices_m, slanted.faces).volume == pytest.approx(area * 0.7)


def test_folds_are_solid_and_as_deep_as_asked() -> None:
    mesh = folds(0.4, 0.1, 0.2, 2.0, 4)
    solid = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    assert solid.is_watertight
    assert solid.volume == pytest.approx(0.4 * 0.02 * 1.8, rel=0.02)
    assert np.ptp(mesh.vertices_m, axis=0) == pytest.approx([0.4, 0.1, 1.8])
