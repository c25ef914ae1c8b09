"""How living rooms, bedrooms and dining rooms are furnished; each rule returns whether what the kind needs fits."""

import numpy as np

from perpetua.rooms.procedural.layout.common_rules import (
    CHAIR,
    SMALL_SIZES,
    desk_with_chair,
    hang_pictures,
    lay_table,
    radiators,
    seat_long,
    seat_round,
)
from perpetua.rooms.procedural.layout.plan import Piece
from perpetua.rooms.procedural.layout.rules import Layout

SOFA_FRONT_M = 1.15
LARGE_ROOM_M2 = 30.0


def furnish_livingroom(layout: Layout) -> bool:
    """A sofa that faces a television, armchairs around a low table on a rug, and what goes along the walls."""
    sofa = _sofa(layout)
    if sofa is None:
        return False
    bench = layout.facing(sofa, "tv_bench", (layout.between(1.5, 2.1), 0.42, 0.48), 0.4, 5.5)
    if bench is not None:
        wide = layout.between(1.05, 1.4)
        layout.on_top(bench, "tv", (wide, 0.24, 0.6 * wide + 0.06), 0.0, 0.19)
    _sofa_group(layout, sofa)
    radiators(layout)
    if layout.beside(sofa, "side_table", (0.45, 0.45, 0.55)) is None or layout.chance(0.5):
        layout.beside(sofa, "floor_lamp", (0.44, 0.44, layout.between(1.5, 1.7)))
    layout.at_wall("bookshelf", (layout.between(0.9, 1.6), 0.32, layout.between(1.7, 2.1)), 0.5)
    if layout.floor.area_m2 > LARGE_ROOM_M2:
        _second_group(layout)
    sideboard = layout.at_wall("sideboard", (layout.between(1.1, 1.7), 0.44, 0.82), 0.5)
    layout.at_wall("plant", (0.75, 0.75, layout.between(1.2, 1.6)), corner=True)
    layout.at_wall("floor_lamp", (0.44, 0.44, layout.between(1.5, 1.75)), corner=True)
    layout.at_wall("plant", (0.5, 0.5, layout.between(0.8, 1.2)), corner=True)
    if layout.chance(0.5):
        layout.at_wall("basket", (0.42, 0.42, 0.46))
    if layout.chance(0.6):
        layout.at_wall("wall_shelf", (layout.between(0.8, 1.2), 0.22, 0.5), z_m=1.25, off_m=0.0)
    _wall_objects(layout, 2, sideboard, sofa)
    return True


def _sofa(layout: Layout) -> Piece | None:
    """The sofa: in the room before a wall where there is space behind it, else at a wall."""
    size = (layout.between(1.9, 2.5), 0.94, layout.between(0.78, 0.88))
    return layout.at_wall("sofa", size, SOFA_FRONT_M)


def _sofa_group(layout: Layout, sofa: Piece) -> None:
    """A low table on a rug in front of a sofa, and armchairs that look at it."""
    table_y = sofa.size_m[1] + 0.42
    deep = layout.between(0.55, 0.7)
    round_top = layout.chance(0.3)
    width = deep + 0.25 if round_top else layout.between(0.95, 1.2)
    deep = width if round_top else deep
    # The sofa's own front zone keeps others out, so the table goes in unasked.
    x, y = sofa.to_world(0.0, table_y)
    table = layout.add(layout.piece("coffee_table", (width, deep, 0.4), (x, y, 0.0), sofa.quarters))
    for side in layout.rng.permutation([-1.0, 1.0])[: 1 + layout.chance(0.6)]:
        aside = 0.5 * sofa.size_m[0] + 0.28 + layout.between(0.0, 0.3)
        chair = (layout.between(0.78, 0.88), layout.between(0.80, 0.88), 0.84)
        turn = -float(side) * layout.between(0.35, 0.7)
        layout.around(sofa, "armchair", chair, float(side) * aside, table_y + deep + 0.75, 2, 0.05, turn)
    rug_y = table_y + 0.5 * deep
    for wide, long in ((sofa.size_m[0] + 0.4, deep + 0.75), (width + 0.7, deep + 0.6), (width + 0.3, deep + 0.3)):
        if layout.rug((wide, long), sofa.to_world(0.0, rug_y), sofa.quarters) is not None:
            break
    if layout.chance(0.6):
        side = 1.0 if layout.chance(0.5) else -1.0
        layout.around(table, "stool", (0.46, 0.46, 0.42), side * (0.5 * width + 0.45), 0.5 * deep - 0.23, 0, 0.05)


def _second_group(layout: Layout) -> None:
    """In a large room: a small table with chairs, or a desk."""
    if layout.chance(0.6):
        table = layout.free_standing("table", (1.0, 1.0, 0.75), 0.65)
        if table is not None:
            seat_round(layout, table)
            layout.rug((2.5, 2.5), table.to_world(0.0, 0.5), 0)
            return
    desk_with_chair(layout)


def _wall_objects(layout: Layout, pictures: int, first: Piece | None, second: Piece | None) -> None:
    hang_pictures(layout, pictures, first)
    if second is not None:
        hang_pictures(layout, 0, second)
    if layout.chance(0.6):
        layout.at_wall("clock", (0.34, 0.04, 0.34), z_m=1.6, off_m=0.0)


def furnish_bedroom(layout: Layout) -> bool:
    """A bed between two nightstands, a wardrobe, and a place to sit."""
    wide = float(layout.rng.choice([1.4, 1.6, 1.8]))
    bed = layout.at_wall("bed", (wide, 2.08, layout.between(0.95, 1.2)), 0.75)
    if bed is None:
        return False
    for _ in range(2):
        stand = layout.beside(bed, "nightstand", (0.48, 0.42, 0.52), 0.06, 0.04)
        if stand is not None:
            _nightstand_objects(layout, stand)
    if layout.chance(0.6):
        layout.around(bed, "bench", (0.8 * wide, 0.42, 0.46), 0.0, bed.size_m[1] + 0.06, 0)
    radiators(layout)
    layout.at_wall("wardrobe", (layout.between(1.3, 2.2), 0.62, 2.1), 0.75)
    dresser = layout.at_wall("dresser", (layout.between(0.9, 1.4), 0.48, 0.86), 0.6)
    if dresser is not None and layout.chance(0.6):
        wide_mirror = min(0.8, 0.8 * dresser.size_m[0])
        layout.on_wall(dresser, "round_mirror", (wide_mirror, 0.05, wide_mirror), 1.15)
    desk_with_chair(layout)
    _reading_corner(layout)
    layout.at_wall("bookshelf", (layout.between(0.7, 1.1), 0.3, layout.between(1.3, 2.0)), 0.5)
    layout.at_wall("plant", (0.6, 0.6, layout.between(1.0, 1.5)), corner=True)
    layout.at_wall("basket", (0.44, 0.44, 0.56))
    if layout.chance(0.5):
        layout.at_wall("coat_rack", (0.8, 0.14, 1.1), z_m=0.75, off_m=0.0)
    _bedside_rug(layout, bed)
    _wall_objects(layout, 2, bed, None)
    return True


def _nightstand_objects(layout: Layout, stand: Piece) -> None:
    layout.on_top(stand, "table_lamp", (0.24, 0.24, 0.42), -0.11, 0.14)
    obj, x = ("books", 0.11) if layout.chance(0.5) else ("cup", 0.14)
    size = (0.18, 0.13, 0.07) if obj == "books" else SMALL_SIZES[obj]
    layout.on_top(stand, obj, size, x, 0.31, layout.between(-0.3, 0.3))


def _reading_corner(layout: Layout) -> None:
    """An armchair at a wall with a lamp beside it."""
    chair = layout.at_wall("armchair", (0.82, 0.84, 0.84), 0.6)
    if chair is not None and layout.beside(chair, "floor_lamp", (0.42, 0.42, 1.6)) is None:
        layout.at_wall("floor_lamp", (0.4, 0.4, 1.6), corner=True)


def _bedside_rug(layout: Layout, bed: Piece) -> None:
    """A rug at the foot of the bed, or beside it."""
    wide, long, _ = bed.size_m
    for size, place in (
        ((wide + 0.5, 1.3), (0.0, long + 1.4)),
        ((0.7, 1.5), (0.5 * wide + 0.5, 0.6 * long)),
        ((0.7, 1.5), (-0.5 * wide - 0.5, 0.6 * long)),
        ((wide, 0.8), (0.0, long + 0.55)),
    ):
        if layout.rug(size, bed.to_world(*place), bed.quarters) is not None:
            return


def furnish_diningroom(layout: Layout) -> bool:
    """A laid table with chairs on a rug, and what keeps china along the walls."""
    table, seated = _dining_table(layout)
    if table is None or seated < 3:
        return False
    width, depth, _ = table.size_m
    for around_m in (1.7, 1.5):
        if (
            layout.rug((width + around_m, depth + around_m), table.to_world(0.0, 0.5 * depth), table.quarters)
            is not None
        ):
            break
    lay_table(layout, layout.placed(table))
    radiators(layout)
    sideboard = layout.at_wall("sideboard", (layout.between(1.4, 2.0), 0.46, 0.86), 0.5)
    layout.at_wall("cabinet", (layout.between(0.9, 1.3), 0.44, 2.0), 0.5)
    layout.at_wall("bookshelf", (layout.between(0.8, 1.3), 0.32, 1.9), 0.5)
    _reading_corner(layout)
    layout.at_wall("plant", (0.75, 0.75, layout.between(1.2, 1.7)), corner=True)
    layout.at_wall("floor_lamp", (0.44, 0.44, 1.65), corner=True)
    if layout.chance(0.6):
        layout.at_wall("bench", (layout.between(1.0, 1.4), 0.42, 0.46), 0.3)
    layout.at_wall("plant", (0.5, 0.5, layout.between(0.8, 1.1)), corner=True)
    if layout.chance(0.4):
        layout.at_wall("umbrella_stand", (0.3, 0.3, 0.9))
    if layout.chance(0.6):
        layout.at_wall("wall_shelf", (layout.between(0.8, 1.3), 0.22, 0.5), z_m=1.25, off_m=0.0)
    _wall_objects(layout, 3, sideboard, None)
    return True


def _dining_table(layout: Layout) -> tuple[Piece | None, int]:
    """A round table for four or a long one for four to six, and how many chairs found room at it."""
    if layout.chance(0.25):
        table = layout.free_standing("dining_table", (1.25, 1.25, 0.75), 0.75)
        return table, 0 if table is None else seat_round(layout, table)
    seats = int(layout.rng.choice([4, 6]))
    size = (1.45 if seats == 4 else 2.0, layout.between(0.9, 1.0), 0.75)
    table = layout.free_standing("dining_table", size, 0.75)
    if table is None:
        return None, 0
    placed = seat_long(layout, table, seats)
    if seats == 6 and layout.chance(0.5):
        for side in (-1.0, 1.0):
            x = side * (0.5 * size[0] + 0.06 + CHAIR[1])
            quarter = 1 if side > 0 else 3
            placed += layout.around(table, "chair", CHAIR, float(np.round(x, 6)), 0.5 * size[1], quarter) is not None
    return table, placed
