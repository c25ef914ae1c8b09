"""Builds a room from its plan."""

from collections import Counter
from collections.abc import Callable

from perpetua.rooms.procedural.finish.palette import Palette
from perpetua.rooms.procedural.furniture import (
    bath,
    beds,
    decoration,
    kitchen,
    lamps,
    openings,
    plants,
    seating,
    shell,
    small,
    storage,
)
from perpetua.rooms.procedural.furniture.parts import Part, turned
from perpetua.rooms.procedural.layout.plan import Piece, RoomPlan
from perpetua.scene.room import Room, SceneObject

BUILDERS: dict[str, Callable[[Piece, Palette], list[Part]]] = {
    "armchair": seating.build_sofa,
    "basket": bath.build_basket,
    "bathroom_cabinet": bath.build_vanity,
    "bathroom_shelf": storage.build_linen_shelf,
    "bathtub": bath.build_bathtub,
    "bed": beds.build_bed,
    "bench": seating.build_bench,
    "books": small.build_books,
    "bookshelf": storage.build_bookshelf,
    "bottles": kitchen.build_bottles,
    "bowl": small.build_bowl,
    "cabinet": storage.build_cabinet,
    "candles": small.build_candles,
    "ceiling_lamp": lamps.build_ceiling_lamp,
    "chair": seating.build_chair,
    "chopping_board": kitchen.build_chopping_board,
    "clock": decoration.build_clock,
    "coat_rack": storage.build_coat_rack,
    "coffee_table": storage.build_table,
    "cup": small.build_cup,
    "curtain": decoration.build_curtain,
    "curtain_rod": decoration.build_curtain_rod,
    "desk": storage.build_table,
    "dining_table": storage.build_table,
    "dresser": storage.build_cabinet,
    "extractor": kitchen.build_extractor,
    "floor_lamp": lamps.build_lamp,
    "fridge": kitchen.build_fridge,
    "kettle": kitchen.build_kettle,
    "kitchen_cabinet": storage.build_cabinet,
    "kitchen_counter": kitchen.build_kitchen_counter,
    "kitchen_island": kitchen.build_island,
    "mirror": decoration.build_picture,
    "monitor": small.build_monitor,
    "nightstand": storage.build_cabinet,
    "paper_roll": bath.build_paper_roll,
    "pendant": lamps.build_pendant,
    "photo": small.build_photo,
    "picture": decoration.build_picture,
    "plant": plants.build_plant,
    "plates": small.build_plates,
    "radiator": decoration.build_radiator,
    "round_mirror": decoration.build_round_mirror,
    "rug": decoration.build_rug,
    "shelf": storage.build_bookshelf,
    "shower": bath.build_shower,
    "side_table": storage.build_table,
    "sideboard": storage.build_cabinet,
    "small_plant": plants.build_plant,
    "soap": bath.build_soap,
    "sofa": seating.build_sofa,
    "stool": seating.build_stool,
    "table": storage.build_table,
    "table_lamp": lamps.build_lamp,
    "tall_cabinet": kitchen.build_tall_cabinet,
    "toilet": bath.build_toilet,
    "towel": bath.build_towel,
    "towel_stack": bath.build_towel_stack,
    "tray": small.build_tray,
    "tv": decoration.build_tv,
    "tv_bench": storage.build_cabinet,
    "umbrella_stand": decoration.build_umbrella_stand,
    "vase": small.build_vase,
    "wall_cabinet": kitchen.build_wall_cabinet,
    "wall_shelf": storage.build_wall_shelf,
    "wardrobe": storage.build_cabinet,
}


def build_room(plan: RoomPlan, name: str) -> Room:
    """The room of a plan."""
    entries = [(part.label, part.category or part.label, part) for part in _shell(plan)]
    numbers: Counter[str] = Counter()
    for piece in plan.pieces:
        numbers[piece.category] += 1
        piece_name = f"{piece.category}_{numbers[piece.category]:02d}"
        for part in build_piece(piece, plan.palette):
            label = f"{piece_name}_{part.label}" if part.label else piece_name
            entries.append((label, part.category or piece.category, part))
    objects = tuple(
        SceneObject(
            index, label, category, part.mesh, part.material, walkable=category in ("floor", "rug"), opaque=True
        )
        for index, (label, category, part) in enumerate(entries, start=1)
    )
    polygon_m = plan.floor.corners_m
    return Room(name, plan.kind, polygon_m, plan.height_m, objects, plan.lights, None, plan.sky)


def build_piece(piece: Piece, palette: Palette) -> list[Part]:
    """The parts of a piece where it stands in the room."""
    return [
        Part(part.label, turned(part.mesh, piece.turn, piece.position_m), part.material, part.category)
        for part in BUILDERS[piece.category](piece, palette)
    ]


def _shell(plan: RoomPlan) -> list[Part]:
    parts = [shell.build_floor(plan), shell.build_ceiling(plan)]
    parts += [shell.build_wall(plan, wall) for wall in range(len(plan.floor.walls))]
    parts += [shell.build_skirting(plan), *openings.build_door(plan)]
    return parts + [part for number in range(len(plan.windows)) for part in openings.build_window(plan, number)]
