"""Which furniture each kind of room gets and by which rules it is placed.

Each rule returns whether the room got what it is recognised by.
"""

from collections.abc import Callable

import numpy as np

from perpetua.rooms.config import RoomKind
from perpetua.rooms.procedural.layout import Layout, Size
from perpetua.rooms.procedural.plan import Piece

SOFA_FRONT_M = 1.1


def furnish(layout: Layout, kind: RoomKind) -> bool:
    """Places the furniture of a room of this kind; False if what the kind needs did not fit."""
    if not RULES[kind](layout):
        return False
    for surface in list(layout.pieces):
        _decorate(layout, surface)
    return True


def _between(layout: Layout, low: float, high: float) -> float:
    return float(layout.rng.uniform(low, high))


def _furnish_livingroom(layout: Layout) -> bool:
    sofa = layout.at_wall("sofa", (_between(layout, 1.8, 2.5), 0.92, 0.82), SOFA_FRONT_M)
    if sofa is None:
        return False
    _sofa_group(layout, sofa)
    opposite = (sofa.quarters + 2) % 4
    tv_bench = layout.at_wall("tv_bench", (_between(layout, 1.4, 2.0), 0.42, 0.48), 0.5, walls=(opposite,))
    if tv_bench is not None:
        layout.on_top(tv_bench, "tv", (_between(layout, 1.0, 1.3), 0.22, 0.72), 0.0, 0.10)
    layout.beside(sofa, "side_table", (0.45, 0.45, 0.55))
    layout.at_wall("bookshelf", (_between(layout, 0.8, 1.5), 0.32, _between(layout, 1.7, 2.1)), 0.4)
    layout.at_wall("armchair", (0.85, 0.86, 0.82), 0.4)
    layout.at_wall("floor_lamp", (0.42, 0.42, 1.6), corner=True)
    layout.at_wall("plant", (0.7, 0.7, _between(layout, 1.1, 1.5)), corner=True)
    layout.at_wall("sideboard", (_between(layout, 1.0, 1.6), 0.42, 0.8), 0.4)
    layout.at_wall("stool", (0.5, 0.5, 0.42))
    _hang_pictures(layout, 2, sofa)
    return True


def _sofa_group(layout: Layout, sofa: Piece) -> None:
    """A low table on a rug in front of a sofa."""
    width = 0.55 * sofa.size_m[0]
    table_y = sofa.size_m[1] + 0.45
    # The sofa's own front zone keeps others out, so the table goes in unasked.
    x, y = sofa.to_world(0.0, table_y)
    table = layout.add(layout.piece("coffee_table", (width, 0.55, 0.42), (x, y, 0.0), sofa.quarters))
    rug_middle = sofa.to_world(0.0, table_y + 0.30)
    rug = layout.rug((sofa.size_m[0] + 0.3, 1.3), rug_middle, sofa.quarters)
    if rug is None:
        layout.rug((width + 0.5, 0.85), table.to_world(0.0, 0.27), sofa.quarters)


def _furnish_bedroom(layout: Layout) -> bool:
    bed = layout.at_wall("bed", (_between(layout, 1.4, 1.8), 2.08, _between(layout, 0.9, 1.2)), 0.7)
    if bed is None:
        return False
    nightstand: Size = (0.46, 0.42, 0.5)
    for _ in range(2):
        layout.beside(bed, "nightstand", nightstand)
    layout.at_wall("wardrobe", (_between(layout, 1.2, 2.2), 0.6, 2.1), 0.7)
    layout.at_wall("dresser", (_between(layout, 0.9, 1.4), 0.46, 0.85), 0.5)
    desk = layout.at_wall("desk", (_between(layout, 1.1, 1.5), 0.6, 0.74), 0.6)
    if desk is not None:
        _chair_at_desk(layout, desk)
    layout.at_wall("bookshelf", (_between(layout, 0.7, 1.0), 0.3, _between(layout, 1.2, 2.0)), 0.4)
    layout.at_wall("armchair", (0.82, 0.84, 0.82), 0.4, corner=True)
    layout.at_wall("plant", (0.6, 0.6, _between(layout, 0.9, 1.4)), corner=True)
    layout.at_wall("floor_lamp", (0.4, 0.4, 1.6), corner=True)
    for middle_y in (0.62, 0.5):
        if layout.rug((bed.size_m[0] * 0.9, 0.8), bed.to_world(0.0, 2.2 + middle_y), bed.quarters) is not None:
            break
    _hang_pictures(layout, 2, bed)
    return True


def _chair_at_desk(layout: Layout, desk: Piece) -> None:
    # The desk's own front zone keeps others out, so the chair goes in unasked.
    x, y = desk.to_world(0.0, desk.size_m[1] + 0.03 + 0.46)
    layout.add(layout.piece("chair", (0.44, 0.46, 0.86), (x, y, 0.0), desk.quarters + 2))


def _furnish_diningroom(layout: Layout) -> bool:
    seats = int(layout.rng.choice([4, 6]))
    table = layout.free_standing("dining_table", (1.4 if seats == 4 else 1.9, 0.92, 0.75), 0.75)
    if table is None or _seat(layout, table, seats) < 3:
        return False
    sideboard = layout.at_wall("sideboard", (_between(layout, 1.4, 2.0), 0.45, 0.85), 0.5)
    layout.at_wall("cabinet", (_between(layout, 0.9, 1.3), 0.42, 2.0), 0.5)
    layout.at_wall("bookshelf", (_between(layout, 0.8, 1.2), 0.32, 1.9), 0.4)
    layout.at_wall("armchair", (0.82, 0.84, 0.82), 0.4)
    layout.at_wall("plant", (0.7, 0.7, _between(layout, 1.1, 1.6)), corner=True)
    layout.at_wall("floor_lamp", (0.42, 0.42, 1.65), corner=True)
    layout.at_wall("sideboard", (_between(layout, 0.9, 1.3), 0.42, 0.8), 0.4)
    layout.rug(
        (table.size_m[0] + 1.5, table.size_m[1] + 1.5), table.to_world(0.0, 0.5 * table.size_m[1]), table.quarters
    )
    _hang_pictures(layout, 3, sideboard)
    return True


def _seat(layout: Layout, table: Piece, seats: int) -> int:
    """Chairs along both long sides of a table, and how many found room."""
    width, depth, _ = table.size_m
    chair: Size = (0.44, 0.47, 0.9)
    per_side = seats // 2
    placed = 0
    for index in range(per_side):
        x = (index - 0.5 * (per_side - 1)) * width / per_side
        off = 0.03 + 0.06 * float(layout.rng.uniform())
        placed += layout.around(table, "chair", chair, x, depth + off + chair[1], 2) is not None
        placed += layout.around(table, "chair", chair, x, -off - chair[1], 0) is not None
    return placed


def _furnish_kitchen(layout: Layout) -> bool:
    counter = layout.at_wall("kitchen_counter", (_between(layout, 2.2, 3.2), 0.63, 0.91), 0.9)
    if counter is None:
        return False
    layout.beside(counter, "fridge", (0.68, 0.68, 1.85), 0.02)
    layout.above(counter, "wall_cabinet", (0.9 * counter.size_m[0], 0.34, 0.68), 1.48)
    layout.at_wall("cabinet", (_between(layout, 0.8, 1.2), 0.55, 2.05), 0.6)
    table = layout.free_standing("table", (1.0, 1.0, 0.75), 0.7)
    if table is not None:
        _seat_round(layout, table)
    layout.at_wall("kitchen_cabinet", (_between(layout, 1.2, 1.9), 0.6, 0.9), 0.6)
    layout.at_wall("shelf", (_between(layout, 0.7, 1.1), 0.32, 1.7), 0.3)
    layout.at_wall("plant", (0.5, 0.5, _between(layout, 0.8, 1.2)), corner=True)
    layout.at_wall("stool", (0.38, 0.38, 0.62))
    _hang_pictures(layout, 2, None)
    return True


def _seat_round(layout: Layout, table: Piece) -> None:
    """A chair on each of the four sides of a round table."""
    half, (width, depth, height) = 0.5 * table.size_m[1], (0.43, 0.45, 0.88)
    for quarter in range(4):
        outward = np.array([(0, 1), (-1, 0), (0, -1), (1, 0)][quarter])
        x, y = (half + 0.04 + depth) * outward
        layout.around(table, "chair", (width, depth, height), float(x), float(y) + half, quarter + 2)


def _furnish_bathroom(layout: Layout) -> bool:
    vanity = layout.at_wall("bathroom_cabinet", (_between(layout, 0.9, 1.4), 0.5, 0.84), 0.7)
    toilet = layout.at_wall("toilet", (0.40, 0.68, 0.8), 0.6)
    if vanity is None or toilet is None:
        return False
    layout.above(vanity, "mirror", (0.85 * vanity.size_m[0], 0.035, 0.8), 1.15)
    layout.at_wall("bathtub", (1.75, 0.8, 0.58), 0.6, corner=True)
    layout.at_wall("shower", (0.95, 0.95, 2.1), 0.6, corner=True)
    layout.at_wall("cabinet", (_between(layout, 0.5, 0.9), 0.38, 1.75), 0.5)
    layout.at_wall("shelf", (_between(layout, 0.6, 0.9), 0.3, 1.5), 0.3)
    layout.at_wall("basket", (0.44, 0.44, 0.6))
    layout.at_wall("stool", (0.4, 0.4, 0.45))
    layout.at_wall("plant", (0.5, 0.5, _between(layout, 0.8, 1.2)), corner=True)
    for _ in range(2):
        layout.at_wall("towel", (0.6, 0.09, 0.75), z_m=0.75, off_m=0.0)
    layout.rug((0.95, 0.6), vanity.to_world(0.0, vanity.size_m[1] + 0.45), vanity.quarters)
    _hang_pictures(layout, 1, None)
    return True


def _hang_pictures(layout: Layout, count: int, anchor: Piece | None) -> None:
    size: Size = (_between(layout, 0.6, 1.1), 0.03, _between(layout, 0.5, 0.75))
    if anchor is not None and layout.above(anchor, "picture", size, 1.4) is not None:
        count -= 1
    for _ in range(count):
        size = (_between(layout, 0.4, 0.9), 0.03, _between(layout, 0.4, 0.8))
        layout.at_wall("picture", size, z_m=1.35, off_m=0.0)


def _decorate(layout: Layout, surface: Piece) -> None:
    """Puts small things on a surface, spread along its width."""
    choices = SMALL_THINGS.get(surface.category, ())
    width, depth, _ = surface.size_m
    names = [name for name in choices if layout.rng.uniform() < 0.75]
    for index, name in enumerate(names):
        w, d, h = SMALL_SIZES[name]
        slot = width / len(names)
        if w > slot or d > depth:
            continue
        slack = 0.5 * max(0.0, slot - w - 0.04)
        x = -0.5 * width + (index + 0.5) * slot + slack * _between(layout, -1.0, 1.0)
        y = _between(layout, 0.25, 0.75) * (depth - d)
        layout.on_top(surface, name, (w, d, h), x, y)


SMALL_SIZES: dict[str, Size] = {
    "vase": (0.15, 0.15, 0.28),
    "bowl": (0.26, 0.26, 0.09),
    "cup": (0.12, 0.09, 0.09),
    "books": (0.24, 0.17, 0.10),
    "table_lamp": (0.28, 0.28, 0.46),
    "small_plant": (0.22, 0.22, 0.32),
}

# The order is that from left to right.
SMALL_THINGS: dict[str, tuple[str, ...]] = {
    "coffee_table": ("books", "bowl", "cup"),
    "side_table": ("table_lamp",),
    "nightstand": ("table_lamp",),
    "dresser": ("small_plant", "books", "vase"),
    "desk": ("table_lamp", "books", "cup"),
    "sideboard": ("vase", "bowl", "table_lamp"),
    "dining_table": ("cup", "bowl", "cup"),
    "kitchen_cabinet": ("bowl", "small_plant", "cup", "books"),
    "bookshelf": ("small_plant",),
    "wardrobe": (),
}

RULES: dict[RoomKind, Callable[[Layout], bool]] = {
    "bathroom": _furnish_bathroom,
    "bedroom": _furnish_bedroom,
    "diningroom": _furnish_diningroom,
    "kitchen": _furnish_kitchen,
    "livingroom": _furnish_livingroom,
}
