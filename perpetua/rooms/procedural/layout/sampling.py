"""Draws the plan of a room."""

import numpy as np

from perpetua.rooms.config import RoomKind
from perpetua.rooms.procedural.finish.palette import sample_palette
from perpetua.rooms.procedural.layout.kinds import furnish
from perpetua.rooms.procedural.layout.light import lamp_lights, sample_sky, window_lights
from perpetua.rooms.procedural.layout.plan import DETAILS, FloorPlan, Opening, Piece, RoomPlan
from perpetua.rooms.procedural.layout.rules import Layout
from perpetua.rooms.source import RoomWish

LAYOUTS = 8
DOOR_WIDTH_M = 0.9
DOOR_HEIGHT_M = 2.05
CORNER_M = 0.45
LARGE_ROOM_M2 = 26.0
CEILING_LAMP_M = 0.5
# A corner is cut from this share of the rooms that stay this large.
L_FRACTION = 0.4
L_MIN_AREA_M2 = 20.0
L_MIN_ARM_M = 2.7


def sample_room(rng: np.random.Generator, wish: RoomWish) -> RoomPlan | None:
    """The plan of a room; None if the furniture that its kind needs does not fit."""
    kind, height_m = wish.kind, wish.size_m[2]
    floor = sample_floor(rng, wish)
    for _ in range(LAYOUTS):
        door, windows = _sample_openings(rng, floor, kind, height_m)
        layout = Layout(rng, floor, door, windows)
        if kind in ("bedroom", "livingroom", "diningroom"):
            for window in windows:
                _hang_curtains(layout, window)
        if furnish(layout, kind):
            break
    else:
        return None
    pieces = (*layout.pieces, *_ceiling_lamps(layout, height_m))
    accent_wall, palette = int(rng.integers(len(floor.walls))), sample_palette(rng, kind, wish.lamps_on)
    # Light comes last, so that it changes nothing about what stands where.
    lights = window_lights(rng, floor, windows, wish.daytime)
    if wish.lamps_on:
        lights += lamp_lights(rng, floor, pieces)
    return RoomPlan(
        kind=kind,
        floor=floor,
        height_m=height_m,
        door=door,
        windows=windows,
        accent_wall=accent_wall,
        pieces=pieces,
        palette=palette,
        lights=tuple(lights),
        sky=sample_sky(rng, wish.daytime),
    )


def sample_floor(rng: np.random.Generator, wish: RoomWish) -> FloorPlan:
    """A rectangle, or an L where what is left is large enough and both arms are wide enough."""
    width_m, depth_m, _ = wish.size_m
    corner, wanted = int(rng.integers(4)), rng.uniform() < L_FRACTION
    fractions = rng.uniform(0.25, 0.45, size=2)
    # Even corners are arrived at along y and left along x.
    sides = (depth_m, width_m) if corner % 2 == 0 else (width_m, depth_m)
    notch = (round(float(fractions[0]) * sides[0], 2), round(float(fractions[1]) * sides[1], 2))
    area_m2 = width_m * depth_m - notch[0] * notch[1]
    arms_m = (sides[0] - notch[0], sides[1] - notch[1])
    if wanted and area_m2 >= L_MIN_AREA_M2 and min(arms_m) >= L_MIN_ARM_M:
        return FloorPlan(width_m, depth_m, corner, notch)
    return FloorPlan(width_m, depth_m)


def _sample_openings(
    rng: np.random.Generator, floor: FloorPlan, kind: RoomKind, height_m: float
) -> tuple[Opening, tuple[Opening, ...]]:
    """The door, and windows in other walls: none of them on walls that are too short."""
    long = [number for number, wall in enumerate(floor.walls) if wall.length_m > DOOR_WIDTH_M + 2 * CORNER_M]
    # Windows look outwards: the walls of a notch border on other rooms.
    outer = [number for number in long if _faces_outwards(floor, number)]
    walls = [int(wall) for wall in rng.permutation(outer)]
    inner = [number for number in long if number not in outer]
    door_wall = inner[0] if inner and rng.uniform() < 0.5 else walls.pop()
    door = _sample_door(rng, door_wall, floor)
    count = 1 if kind == "bathroom" else int(rng.integers(1, 4))
    windows = tuple(_sample_window(rng, kind, wall, floor, height_m) for wall in walls[:count])
    return door, windows


def _faces_outwards(floor: FloorPlan, number: int) -> bool:
    after = floor.walls[(number + 1) % len(floor.walls)]
    return floor.walls[number].starts_convex and after.starts_convex


def _sample_door(rng: np.random.Generator, wall: int, floor: FloorPlan) -> Opening:
    reach_m = 0.5 * floor.walls[wall].length_m - 0.5 * DOOR_WIDTH_M - CORNER_M
    return Opening(wall, float(rng.uniform(-reach_m, reach_m)), DOOR_WIDTH_M, 0.0, DOOR_HEIGHT_M)


def _sample_window(rng: np.random.Generator, kind: RoomKind, wall: int, floor: FloorPlan, height_m: float) -> Opening:
    length_m = floor.walls[wall].length_m
    small = kind == "bathroom"
    wide_m = float(rng.uniform(0.8, 1.2) if small else rng.uniform(1.2, min(2.6, max(1.3, 0.45 * length_m))))
    sill_m = float(rng.uniform(1.1, 1.3) if small else rng.uniform(0.88, 1.0))
    # Room for curtains between the window and the corner.
    reach_m = max(0.0, 0.5 * length_m - 0.5 * wide_m - CORNER_M - 0.1)
    return Opening(wall, float(rng.uniform(-reach_m, reach_m)), wide_m, sill_m, min(2.25, height_m - 0.25))


def _hang_curtains(layout: Layout, window: Opening) -> None:
    """A rod above the window and a curtain on each side of it."""
    wall, wide_m, rod_z_m = layout.floor.walls[window.wall], 0.34, window.head_m + 0.09
    for side in (-1.0, 1.0):
        along_m = window.middle_m + side * (0.5 * window.width_m + 0.1 + 0.5 * wide_m)
        position = (*wall.at(along_m, 0.04), 0.02)
        layout.add(layout.piece("curtain", (wide_m, 0.10, rod_z_m - 0.02), position, wall.quarters))
    rod = (window.width_m + 2 * wide_m + 0.3, 0.18, 0.04)
    layout.add(layout.piece("curtain_rod", rod, (*wall.at(window.middle_m, 0.0), rod_z_m), wall.quarters))


def _ceiling_lamps(layout: Layout, height_m: float) -> list[Piece]:
    """A pendant over a dining table, and dishes over the middle of each part of the room."""
    lamps = []
    table = next((piece for piece in layout.pieces if piece.category == "dining_table"), None)
    if table is not None:
        x, y = table.to_world(0.0, 0.5 * table.size_m[1] - 0.25)
        low_m = min(1.62, height_m - 0.7)
        lamps.append(_lamp(layout, "pendant", (0.5, 0.5, height_m - low_m), (x, y, low_m), table.quarters))
    size = (CEILING_LAMP_M, CEILING_LAMP_M, 0.12)
    for x, y in _lamp_spots(layout.floor):
        lamp = _lamp(layout, "ceiling_lamp", size, (x, y - 0.5 * CEILING_LAMP_M, height_m - 0.12), 0)
        if not any(lamp.box().overlaps(other.box(), 0.1) for other in [*layout.pieces, *lamps]):
            lamps.append(lamp)
    return lamps


def _lamp_spots(floor: FloorPlan) -> list[tuple[float, float]]:
    """The middle of a rectangle, or two places along it if it is large; of an L, the middles of its two arms."""
    low, high = floor.corners_m.min(0), floor.corners_m.max(0)
    if floor.notch is not None:
        # Beside the notch, along each axis, lies an arm that runs the whole length of the other axis.
        cut_low, cut_high = np.array(floor.notch.low_m[:2]), np.array(floor.notch.high_m[:2])
        x, y = np.where(cut_low <= low, 0.5 * (cut_high + high), 0.5 * (low + cut_low))
        return [(float(x), 0.0), (0.0, float(y))]
    if floor.area_m2 < LARGE_ROOM_M2:
        return [(0.0, 0.0)]
    width, depth = high - low
    quarter = 0.25 * float(max(width, depth))
    return [(side * quarter, 0.0) if width >= depth else (0.0, side * quarter) for side in (-1.0, 1.0)]


def _lamp(
    layout: Layout,
    category: str,
    size_m: tuple[float, float, float],
    position_m: tuple[float, float, float],
    quarters: int,
) -> Piece:
    detail = tuple(float(value) for value in layout.rng.uniform(size=DETAILS))
    return Piece(category, size_m, position_m, quarters, detail)
