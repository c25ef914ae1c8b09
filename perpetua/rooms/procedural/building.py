"""Builds a room from its plan."""

from collections import Counter
from collections.abc import Callable

from perpetua.geometry.mesh import TriMesh
from perpetua.rooms.procedural import bath, decoration, seating, shell, storage
from perpetua.rooms.procedural.palette import Palette
from perpetua.rooms.procedural.parts import Part, turned
from perpetua.rooms.procedural.plan import Piece, RoomPlan
from perpetua.rooms.types import AreaLight, Room, SceneObject

BUILDERS: dict[str, Callable[[Piece, Palette], list[Part]]] = {
    "armchair": seating.build_sofa,
    "basket": bath.build_basket,
    "bathroom_cabinet": bath.build_vanity,
    "bathtub": bath.build_bathtub,
    "bed": seating.build_bed,
    "books": decoration.build_books,
    "bookshelf": storage.build_bookshelf,
    "bowl": decoration.build_bowl,
    "cabinet": storage.build_cabinet,
    "ceiling_lamp": decoration.build_ceiling_lamp,
    "chair": seating.build_chair,
    "coffee_table": storage.build_table,
    "cup": decoration.build_cup,
    "curtain": decoration.build_curtain,
    "curtain_rod": decoration.build_curtain_rod,
    "desk": storage.build_table,
    "dining_table": storage.build_table,
    "dresser": storage.build_cabinet,
    "floor_lamp": decoration.build_lamp,
    "fridge": storage.build_fridge,
    "kitchen_cabinet": storage.build_cabinet,
    "kitchen_counter": storage.build_kitchen_counter,
    "mirror": decoration.build_picture,
    "nightstand": storage.build_cabinet,
    "pendant": decoration.build_pendant,
    "picture": decoration.build_picture,
    "plant": decoration.build_plant,
    "rug": decoration.build_rug,
    "shelf": storage.build_bookshelf,
    "shower": bath.build_shower,
    "side_table": storage.build_table,
    "sideboard": storage.build_cabinet,
    "small_plant": decoration.build_plant,
    "sofa": seating.build_sofa,
    "stool": seating.build_stool,
    "table": storage.build_table,
    "table_lamp": decoration.build_lamp,
    "toilet": bath.build_toilet,
    "towel": bath.build_towel,
    "tv": storage.build_tv,
    "tv_bench": storage.build_cabinet,
    "vase": decoration.build_vase,
    "wall_cabinet": storage.build_wall_cabinet,
    "wardrobe": storage.build_cabinet,
}

SHELL_CATEGORIES = ("floor", "ceiling", "wall", "skirting", "door", "window")


def build_room(plan: RoomPlan, name: str) -> Room:
    """The room of a plan."""
    entries = [(part.label, _shell_category(part.label), part) for part in _shell(plan)]
    numbers: Counter[str] = Counter()
    for piece in plan.pieces:
        numbers[piece.category] += 1
        piece_name = f"{piece.category}_{numbers[piece.category]:02d}"
        for part in build_piece(piece, plan.palette):
            label = f"{piece_name}_{part.label}" if part.label else piece_name
            entries.append((label, piece.category, part))
    objects = tuple(
        SceneObject(
            index, label, category, part.mesh, part.material, walkable=category in ("floor", "rug"), opaque=True
        )
        for index, (label, category, part) in enumerate(entries, start=1)
    )
    return Room(name, plan.kind, shell.floor_polygon_m(plan), plan.height_m, objects, _lights(plan), None)


def build_piece(piece: Piece, palette: Palette) -> list[Part]:
    """The parts of a piece where it stands in the room."""
    return [
        Part(part.label, _stand(part.mesh, piece), part.material) for part in BUILDERS[piece.category](piece, palette)
    ]


def _stand(mesh: TriMesh, piece: Piece) -> TriMesh:
    return turned(mesh, piece.turn_rad, piece.position_m)


def _shell(plan: RoomPlan) -> list[Part]:
    parts = [shell.build_floor(plan), shell.build_ceiling(plan)]
    parts += [shell.build_wall(plan, wall) for wall in range(4)]
    parts += [shell.build_skirting(plan), *shell.build_door(plan)]
    return parts + [shell.build_window(plan, number, window) for number, window in enumerate(plan.windows)]


def _shell_category(label: str) -> str:
    return next(category for category in SHELL_CATEGORIES if label.startswith(category))


def _lights(plan: RoomPlan) -> tuple[AreaLight, ...]:
    lights = [shell.daylight(plan, window) for window in plan.windows]
    for piece in plan.pieces:
        if piece.category in ("ceiling_lamp", "pendant"):
            x, y = piece.to_world(0.0, 0.5 * piece.size_m[1])
            lights.append(shell.lamp_light(plan, x, y, piece.position_m[2]))
    return tuple(lights)
