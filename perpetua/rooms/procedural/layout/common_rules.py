"""Rules that several kinds of rooms share: chairs around tables, pictures, objects on surfaces."""

import numpy as np

from perpetua.rooms.procedural.layout.plan import Piece
from perpetua.rooms.procedural.layout.rules import Layout, Size

CHAIR: Size = (0.45, 0.48, 0.88)


def seat_long(layout: Layout, table: Piece, seats: int) -> int:
    """Chairs along both long sides of a table, and how many found room."""
    width, depth, _ = table.size_m
    per_side = max(1, seats // 2)
    placed = 0
    for index in range(per_side):
        x = (index - 0.5 * (per_side - 1)) * width / per_side
        for front in (True, False):
            out, skew = 0.03 + layout.between(0.0, 0.10), layout.between(-0.12, 0.12)
            y = depth + out + CHAIR[1] if front else -out - CHAIR[1]
            placed += layout.around(table, "chair", CHAIR, x, y, 2 if front else 0, skew_rad=skew) is not None
    return placed


def seat_round(layout: Layout, table: Piece) -> int:
    """A chair on each of the four sides of a round table, and how many found room."""
    half, placed = 0.5 * table.size_m[1], 0
    for quarter in range(4):
        outward = np.array([(0, 1), (-1, 0), (0, -1), (1, 0)][quarter])
        x, y = (half + 0.03 + layout.between(0.0, 0.08) + CHAIR[1]) * outward
        skew = layout.between(-0.1, 0.1)
        chair = layout.around(table, "chair", CHAIR, float(x), float(y) + half, quarter + 2, skew_rad=skew)
        placed += chair is not None
    return placed


def hang_pictures(layout: Layout, count: int, anchor: Piece | None) -> None:
    """Pictures on walls: one or a row of three over a piece, the others where there is room."""
    if anchor is not None:
        low = max(1.15, anchor.position_m[2] + anchor.size_m[2] + 0.25)
        if layout.chance(0.5):
            size: Size = (layout.between(0.8, 1.3), 0.03, layout.between(0.5, 0.75))
            layout.on_wall(anchor, "picture", size, low)
        else:
            size = (layout.between(0.32, 0.42), 0.025, layout.between(0.42, 0.56))
            for x in (-size[0] - 0.1, 0.0, size[0] + 0.1):
                layout.on_wall(anchor, "picture", size, low, x)
    for _ in range(count):
        wide = layout.between(0.35, 0.85)
        size = (wide, 0.028, wide * layout.between(0.8, 1.4))
        layout.at_wall("picture", size, z_m=1.65 - 0.5 * size[2], off_m=0.0)


def desk_with_chair(layout: Layout) -> Piece | None:
    """A desk at a wall with a chair before it, a screen and a lamp on it."""
    desk = layout.at_wall("desk", (layout.between(1.1, 1.5), 0.62, 0.74), 0.85)
    if desk is None:
        return None
    # The desk's own front zone keeps others out, so the chair goes in unasked.
    x, y = desk.to_world(layout.between(-0.1, 0.1), desk.size_m[1] + 0.08 + CHAIR[1])
    layout.add(layout.piece("chair", CHAIR, (x, y, 0.0), desk.quarters + 2, layout.between(-0.18, 0.18)))
    layout.on_top(desk, "monitor", (0.58, 0.42, 0.46), -0.12, 0.26)
    lamp_x = 0.5 * desk.size_m[0] - 0.13
    layout.on_top(desk, "table_lamp", (0.24, 0.24, 0.42), lamp_x, 0.15)
    layout.on_top(desk, "cup", (0.12, 0.09, 0.095), -lamp_x, 0.4, layout.between(-3.0, 3.0))
    return desk


def radiators(layout: Layout) -> None:
    """A radiator under each window that is high enough."""
    for window in layout.windows:
        if window.sill_m < 0.8:
            continue
        wall = layout.floor.walls[window.wall]
        size = (min(1.3, 0.8 * window.width_m), 0.11, 0.68)
        candidate = layout.piece("radiator", size, (*wall.at(window.middle_m, 0.0), 0.0), wall.quarters)
        if layout.chance(0.8):
            layout.try_add(candidate)


def decorate(layout: Layout, surface: Piece) -> None:
    """Puts small objects on a surface, spread along its width, unless something stands there already."""
    choices = SMALL_OBJECTS.get(surface.category, ())
    width, depth, _ = surface.size_m
    if not choices or _taken(layout, surface):
        return
    count = min(len(choices), max(1, int(width / 0.36)))
    chosen = sorted(layout.rng.choice(len(choices), count, replace=False))
    names = [choices[int(index)] for index in chosen if layout.chance(0.85)]
    for index, name in enumerate(names):
        size = SMALL_SIZES[name]
        slot = width / len(names)
        across = float(np.hypot(size[0], size[1])) if name in LOOSE else max(size[0], size[1])
        if across > slot or across > depth - 0.02:
            continue
        slack = 0.5 * max(0.0, slot - across - 0.04)
        x = -0.5 * width + (index + 0.5) * slot + slack * layout.between(-1.0, 1.0)
        y = 0.5 * depth + 0.5 * (depth - across - 0.02) * layout.between(-0.8, 0.5)
        skew = layout.between(-0.6, 0.6) if name in LOOSE else 0.0
        layout.on_top(surface, name, size, x, y, skew)


def _taken(layout: Layout, surface: Piece) -> bool:
    box = surface.box()
    return any(other is not surface and box.overlaps(other.box()) for other in _just_above(layout, surface))


def _just_above(layout: Layout, surface: Piece) -> list[Piece]:
    """Pieces on a surface, moved down into it so that their boxes meet."""
    top = surface.position_m[2] + surface.size_m[2]
    found = []
    for other in layout.pieces:
        if abs(other.position_m[2] - top) < 1e-6:
            x, y, z = other.position_m
            found.append(Piece(other.category, other.size_m, (x, y, z - 0.05), other.quarters, (), other.skew_rad))
    return found


def lay_table(layout: Layout, table: Piece) -> None:
    """Places laid in front of the chairs of a table, and a bowl or vase in its middle."""
    top = table.position_m[2] + table.size_m[2]
    middle_y = 0.5 * table.size_m[1]
    for chair in [piece for piece in layout.pieces if piece.category == "chair" and piece.detail is table.detail]:
        size: Size = (0.40, 0.30, 0.02)
        # From the chair's back, over its seat, to a hand's breadth inside the table's edge.
        straight = Piece("chair", chair.size_m, chair.position_m, chair.quarters, ())
        edge = _distance_to_table(straight, table)
        x, y = straight.to_world(0.0, edge + 0.02)
        layout.put(layout.piece("plates", size, (x, y, top), straight.quarters))
    centre = ("vase", "bowl", "candles")[int(layout.rng.integers(3))]
    layout.on_top(table, centre, SMALL_SIZES[centre], 0.0, middle_y)


def _distance_to_table(chair: Piece, table: Piece) -> float:
    """How far in front of a chair's back the edge of the table lies."""
    box = table.box()
    axis = 0 if chair.quarters % 2 == 1 else 1
    back = chair.position_m[axis]
    near = min((box.low_m[axis], box.high_m[axis]), key=lambda edge: abs(edge - back))
    return abs(near - back)


SMALL_SIZES: dict[str, Size] = {
    "vase": (0.17, 0.17, 0.36),
    "bowl": (0.26, 0.26, 0.11),
    "cup": (0.12, 0.09, 0.095),
    "books": (0.27, 0.20, 0.11),
    "table_lamp": (0.28, 0.28, 0.46),
    "small_plant": (0.24, 0.24, 0.36),
    "candles": (0.2, 0.2, 0.16),
    "photo": (0.15, 0.11, 0.2),
    "tray": (0.36, 0.26, 0.2),
    "kettle": (0.26, 0.2, 0.24),
    "bottles": (0.26, 0.1, 0.3),
    "chopping_board": (0.4, 0.24, 0.12),
    "towel_stack": (0.34, 0.26, 0.2),
    "soap": (0.2, 0.09, 0.18),
}
# What may be turned a little where it stands.
LOOSE = frozenset({"books", "cup", "tray", "photo", "chopping_board", "kettle"})

# The order is that from left to right.
SMALL_OBJECTS: dict[str, tuple[str, ...]] = {
    "coffee_table": ("books", "candles", "tray", "cup", "bowl"),
    "side_table": ("table_lamp",),
    "nightstand": ("table_lamp",),
    "dresser": ("small_plant", "books", "photo", "table_lamp", "candles", "vase"),
    "desk": ("table_lamp", "books", "cup"),
    "sideboard": ("vase", "photo", "bowl", "table_lamp", "books", "small_plant", "candles"),
    "table": ("bowl", "vase"),
    "kitchen_island": ("bowl", "chopping_board", "vase", "tray", "small_plant"),
    "tv_bench": (),
    "shelf": ("small_plant",),
    "bookshelf": ("small_plant", "vase", "books"),
    "bathroom_shelf": ("towel_stack", "small_plant"),
}
