"""Draws the plan of a room."""

import numpy as np

from perpetua.rooms.config import RoomKind
from perpetua.rooms.procedural.kinds import furnish
from perpetua.rooms.procedural.layout import Layout
from perpetua.rooms.procedural.palette import sample_palette
from perpetua.rooms.procedural.plan import DETAILS, Opening, Piece, RoomPlan, at_wall, wall_length_m
from perpetua.rooms.source import RoomWish

LAYOUTS = 8
DOOR_WIDTH_M = 0.9
DOOR_HEIGHT_M = 2.05
CORNER_M = 0.45
LARGE_ROOM_M2 = 30.0
CEILING_LAMP_M = 0.55


def sample_room(rng: np.random.Generator, wish: RoomWish) -> RoomPlan | None:
    """The plan of a room; None if the furniture that its kind needs does not fit."""
    kind, (width_m, depth_m, height_m) = wish.kind, wish.size_m
    walls = [int(wall) for wall in rng.permutation(4)]
    door = _sample_door(rng, walls[0], width_m, depth_m)
    count = 1 if kind == "bathroom" else int(rng.integers(1, 4))
    windows = tuple(_sample_window(rng, kind, wall, width_m, depth_m, height_m) for wall in walls[1 : 1 + count])
    for _ in range(LAYOUTS):
        layout = Layout(rng, width_m, depth_m, door, windows)
        if kind in ("bedroom", "livingroom", "diningroom"):
            for window in windows:
                _hang_curtains(layout, window)
        if furnish(layout, kind):
            break
    else:
        return None
    lamps = _ceiling_lamps(layout, height_m)
    evening = wish.daytime != "day"
    return RoomPlan(
        kind=kind,
        width_m=width_m,
        depth_m=depth_m,
        height_m=height_m,
        wall_thickness_m=0.2,
        door=door,
        windows=windows,
        pieces=(*layout.pieces, *lamps),
        palette=sample_palette(rng, kind),
        lamp_power_w=float(rng.uniform(3.0, 4.5)) * width_m * depth_m / len(lamps),
        daylight_power_w=float(rng.uniform(8.0, 16.0) if evening else rng.uniform(50.0, 110.0)),
        lamp_color=(1.0, float(rng.uniform(0.82, 0.95)), float(rng.uniform(0.65, 0.85))),
        daylight_color=(1.0, 0.72, 0.5) if evening else (float(rng.uniform(0.85, 1.0)), 0.95, 1.0),
    )


def _sample_door(rng: np.random.Generator, wall: int, width_m: float, depth_m: float) -> Opening:
    reach_m = 0.5 * wall_length_m(wall, width_m, depth_m) - 0.5 * DOOR_WIDTH_M - CORNER_M
    return Opening(wall, float(rng.uniform(-reach_m, reach_m)), DOOR_WIDTH_M, 0.0, DOOR_HEIGHT_M)


def _sample_window(
    rng: np.random.Generator, kind: RoomKind, wall: int, width_m: float, depth_m: float, height_m: float
) -> Opening:
    length_m = wall_length_m(wall, width_m, depth_m)
    small = kind == "bathroom"
    wide_m = float(rng.uniform(0.7, 1.1) if small else rng.uniform(1.2, min(2.4, 0.45 * length_m)))
    sill_m = float(rng.uniform(1.2, 1.35) if small else rng.uniform(0.92, 1.05))
    # Room for curtains between the window and the corner.
    reach_m = max(0.0, 0.5 * length_m - 0.5 * wide_m - CORNER_M - 0.3)
    return Opening(wall, float(rng.uniform(-reach_m, reach_m)), wide_m, sill_m, min(2.2, height_m - 0.3))


def _hang_curtains(layout: Layout, window: Opening) -> None:
    """A rod above the window and a curtain on each side of it."""
    wide_m, rod_z_m = 0.32, window.head_m + 0.10
    for side in (-1.0, 1.0):
        along_m = window.middle_m + side * (0.5 * window.width_m + 0.07 + 0.5 * wide_m)
        x, y = at_wall(window.wall, along_m, 0.04, layout.width_m, layout.depth_m)
        layout.add(layout.piece("curtain", (wide_m, 0.10, rod_z_m - 0.03), (x, y, 0.03), window.wall))
    x, y = at_wall(window.wall, window.middle_m, 0.0, layout.width_m, layout.depth_m)
    rod = (window.width_m + 2 * wide_m + 0.24, 0.18, 0.04)
    layout.add(layout.piece("curtain_rod", rod, (x, y, rod_z_m), window.wall))


def _ceiling_lamps(layout: Layout, height_m: float) -> list[Piece]:
    """One lamp, or two in a large room; a pendant over a dining table."""
    table = next((piece for piece in layout.pieces if piece.category == "dining_table"), None)
    if table is not None:
        x, y = table.to_world(0.0, 0.5 * table.size_m[1] - 0.25)
        position = (x, y, 1.6)
        return [_lamp(layout, "pendant", (0.5, 0.5, height_m - 1.6), position, table.quarters)] + [
            _dish(layout, spot, height_m) for spot in _lamp_spots(layout)
        ]
    return [_dish(layout, spot, height_m) for spot in _lamp_spots(layout)]


def _lamp_spots(layout: Layout) -> list[tuple[float, float]]:
    if layout.width_m * layout.depth_m < LARGE_ROOM_M2:
        return [(0.0, 0.0)]
    along_x = layout.width_m >= layout.depth_m
    quarter_m = 0.25 * max(layout.width_m, layout.depth_m)
    return [(side * quarter_m, 0.0) if along_x else (0.0, side * quarter_m) for side in (-1.0, 1.0)]


def _dish(layout: Layout, spot: tuple[float, float], height_m: float) -> Piece:
    position = (spot[0], spot[1] - 0.5 * CEILING_LAMP_M, height_m - 0.12)
    return _lamp(layout, "ceiling_lamp", (CEILING_LAMP_M, CEILING_LAMP_M, 0.12), position, 0)


def _lamp(
    layout: Layout,
    category: str,
    size_m: tuple[float, float, float],
    position_m: tuple[float, float, float],
    quarters: int,
) -> Piece:
    detail = tuple(float(value) for value in layout.rng.uniform(size=DETAILS))
    return Piece(category, size_m, position_m, quarters, detail)
