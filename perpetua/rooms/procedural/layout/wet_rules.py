"""How kitchens and bathrooms are furnished; each rule returns whether what the kind needs fits."""

from perpetua.rooms.procedural.layout.common_rules import (
    SMALL_SIZES,
    hang_pictures,
    lay_table,
    radiators,
    seat_long,
    seat_round,
)
from perpetua.rooms.procedural.layout.counters import SPLASH_M, hob_module, module_x_m, modules, sink_module
from perpetua.rooms.procedural.layout.plan import Box, Piece
from perpetua.rooms.procedural.layout.rules import Layout

COUNTER_DEPTH_M = 0.64
COUNTER_HEIGHT_M = 0.91
HANGING_M = COUNTER_HEIGHT_M + SPLASH_M + 0.02


def furnish_kitchen(layout: Layout) -> bool:
    """A counter with hob and sink under hanging cupboards, fridge and tall cupboard beside it, a table to eat at."""
    counter = _counter(layout)
    if counter is None:
        return False
    _keep_tiles_free(layout, counter)
    _above_counter(layout, counter)
    _on_counter(layout, counter)
    layout.beside(counter, "fridge", (0.66, 0.70, 1.86), 0.02, 0.01)
    if layout.beside(counter, "tall_cabinet", (0.6, COUNTER_DEPTH_M, 2.1), 0.01, 0.005) is None:
        layout.at_wall("tall_cabinet", (0.6, COUNTER_DEPTH_M, 2.1), 0.7)
    if not any(piece.category == "fridge" for piece in layout.pieces):
        layout.at_wall("fridge", (0.66, 0.70, 1.86), 0.7)
    _eating_place(layout)
    radiators(layout)
    layout.at_wall("kitchen_cabinet", (layout.between(1.2, 1.8), 0.5, 0.9), 0.6)
    layout.at_wall("shelf", (layout.between(0.8, 1.2), 0.32, layout.between(1.5, 1.9)), 0.4)
    if layout.chance(0.5):
        layout.at_wall("bench", (layout.between(0.9, 1.3), 0.4, 0.45), 0.3)
    layout.at_wall("plant", (0.55, 0.55, layout.between(0.9, 1.4)), corner=True)
    layout.at_wall("basket", (0.4, 0.4, 0.5))
    layout.at_wall("stool", (0.36, 0.36, 0.46))
    if layout.chance(0.7):
        layout.at_wall("wall_shelf", (layout.between(0.8, 1.2), 0.22, 0.5), z_m=1.3, off_m=0.0)
    layout.at_wall("clock", (0.32, 0.04, 0.32), z_m=1.65, off_m=0.0)
    hang_pictures(layout, 2, None)
    return True


def _counter(layout: Layout) -> Piece | None:
    """The counter, as long as fits."""
    for wide in (layout.between(3.0, 3.8), layout.between(2.4, 3.0), 2.4):
        size = (round(wide / 0.6) * 0.6, COUNTER_DEPTH_M, COUNTER_HEIGHT_M)
        counter = layout.at_wall("kitchen_counter", size, 0.95)
        if counter is not None:
            return counter
    return None


def _keep_tiles_free(layout: Layout, counter: Piece) -> None:
    """Nothing hangs on the tiles above the worktop."""
    box = counter.box()
    low, high = box.high_m[2], box.high_m[2] + SPLASH_M
    layout.keep_empty(Box((*box.low_m[:2], low), (*box.high_m[:2], high)))


def _above_counter(layout: Layout, counter: Piece) -> None:
    """An extractor over the hob and hanging cupboards on both sides of it, where no window is."""
    pitch = counter.size_m[0] / modules(counter)
    hob = hob_module(counter)
    layout.on_wall(counter, "extractor", (0.6, 0.48, 0.85), HANGING_M + 0.12, module_x_m(counter, hob))
    left, right = hob * pitch, (modules(counter) - hob - 1) * pitch
    for wide, middle in (
        (left, -0.5 * counter.size_m[0] + 0.5 * left),
        (right, 0.5 * counter.size_m[0] - 0.5 * right),
    ):
        if wide > 0.3:
            layout.on_wall(counter, "wall_cabinet", (wide - 0.08, 0.35, 0.72), HANGING_M, middle)


def _on_counter(layout: Layout, counter: Piece) -> None:
    """Objects on the worktop, away from hob and sink."""
    free = [k for k in range(modules(counter)) if k not in (hob_module(counter), sink_module(counter))]
    objs = ("kettle", "chopping_board", "bottles", "small_plant", "bowl")
    for module, index in zip(free, layout.rng.permutation(len(objs)), strict=False):
        name = objs[int(index)]
        layout.on_top(counter, name, SMALL_SIZES[name], module_x_m(counter, module), 0.3, layout.between(-0.4, 0.4))
    hob_x = module_x_m(counter, hob_module(counter))
    if layout.chance(0.6):
        x, y = counter.to_world(hob_x - 0.14, 0.33)
        top = counter.position_m[2] + counter.size_m[2] + 0.009
        layout.add(layout.piece("kettle", (0.24, 0.18, 0.2), (x, y, top), counter.quarters))


def _eating_place(layout: Layout) -> None:
    """An island with stools, or a table with chairs."""
    if layout.floor.area_m2 > 32.0 and layout.chance(0.4):
        layout.free_standing("kitchen_island", (layout.between(1.4, 1.9), 0.85, COUNTER_HEIGHT_M), 0.95)
    if layout.chance(0.5):
        table = layout.free_standing("table", (1.05, 1.05, 0.75), 0.7)
        if table is not None:
            seat_round(layout, table)
    else:
        table = layout.free_standing("table", (1.4, 0.85, 0.75), 0.7)
        if table is not None:
            seat_long(layout, table, 4)
    if table is not None and layout.chance(0.6):
        lay_table(layout, table)


def furnish_bathroom(layout: Layout) -> bool:
    """A wash stand under a mirror, toilet, tub and shower, and shelves for towels."""
    vanity = layout.at_wall("bathroom_cabinet", (layout.between(0.9, 1.6), 0.5, 0.82), 0.75)
    toilet = layout.at_wall("toilet", (0.38, 0.68, 0.84), 0.65)
    if vanity is None or toilet is None:
        return False
    if layout.chance(0.5):
        layout.on_wall(vanity, "mirror", (0.85 * vanity.size_m[0], 0.035, 0.85), 1.15)
    else:
        wide = min(0.85, 0.9 * vanity.size_m[0])
        layout.on_wall(vanity, "round_mirror", (wide, 0.05, wide), 1.15)
    layout.on_top(vanity, "soap", SMALL_SIZES["soap"], 0.5 * vanity.size_m[0] - 0.12, 0.12)
    layout.on_wall(toilet, "paper_roll", (0.15, 0.13, 0.12), 0.62, 0.36)
    layout.at_wall("bathtub", (layout.between(1.65, 1.8), 0.8, 0.56), 0.65, corner=True)
    layout.at_wall("shower", (0.95, 0.95, 2.05), 0.65, corner=True)
    radiators(layout)
    layout.at_wall("cabinet", (layout.between(0.5, 0.9), 0.38, 1.75), 0.5)
    layout.at_wall("bathroom_shelf", (layout.between(0.6, 0.9), 0.32, layout.between(0.9, 1.5)), 0.4)
    layout.at_wall("basket", (0.44, 0.44, 0.6))
    layout.at_wall("stool", (0.38, 0.38, 0.45))
    if layout.chance(0.6):
        layout.at_wall("bench", (layout.between(0.8, 1.1), 0.4, 0.45), 0.4)
    layout.at_wall("plant", (0.55, 0.55, layout.between(0.9, 1.3)), corner=True)
    for _ in range(2):
        layout.at_wall("towel", (0.6, 0.1, 0.75), z_m=0.75, off_m=0.0)
    if layout.chance(0.5):
        layout.at_wall("coat_rack", (0.6, 0.14, 1.0), z_m=0.85, off_m=0.0)
    layout.rug((1.0, 0.65), vanity.to_world(0.0, vanity.size_m[1] + 0.5), vanity.quarters)
    tub = next((piece for piece in layout.pieces if piece.category == "bathtub"), None)
    if tub is not None:
        layout.rug((0.9, 0.55), tub.to_world(0.0, tub.size_m[1] + 0.42), tub.quarters)
    hang_pictures(layout, 2, None)
    return True
