"""Tables, cabinets, shelves and kitchen fittings, in each piece's own frame."""

import itertools

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.palette import Palette
from perpetua.rooms.procedural.parts import Part, bar, block, lathe, post
from perpetua.rooms.procedural.plan import Piece
from perpetua.rooms.procedural.seating import legs
from perpetua.rooms.types import Material

FRONT_M = 0.02
PLINTH_M = 0.07


def build_table(piece: Piece, palette: Palette) -> list[Part]:
    """A rectangular table on four legs, or a round one on a foot where width and depth are equal."""
    width, depth, height = piece.size_m
    board = palette.wood if piece.detail[0] < 0.6 else palette.dark_wood
    if width == depth:
        centre, radius = (0.0, 0.5 * depth), 0.5 * width
        top = lathe(
            [(0.0, height - 0.035), (radius - 0.02, height - 0.035), (radius, height), (0.0, height)], centre, 32
        )
        foot = [(0.0, 0.0), (0.6 * radius, 0.0), (0.55 * radius, 0.03), (0.05, 0.06), (0.05, height - 0.034)]
        stand = lathe([*foot, (0.0, height - 0.034)], centre)
        return [Part("", top, board), Part("foot", stand, palette.black)]
    half, leg = 0.5 * width, 0.035 + 0.03 * piece.detail[1]
    top = block((-half, 0.0, height - 0.035), (half, depth, height), 0.008, 2)
    rail_z = height - 0.10
    inset = 0.03 + 0.4 * leg
    rails = [
        block((-half + inset, y, rail_z), (half - inset, y + 0.02, height - 0.034))
        for y in (inset, depth - inset - 0.02)
    ]
    frame = join([legs(width, depth, height - 0.034, leg), *rails])
    metal_legs = piece.detail[2] < 0.3
    return [Part("", top, board), Part("legs", frame, palette.black if metal_legs else board)]


def cabinet(
    width_m: float, depth_m: float, low_z_m: float, high_z_m: float, columns: int, rows: int
) -> tuple[TriMesh, TriMesh, TriMesh]:
    """Carcass, fronts and handles of a cabinet with a grid of doors or drawers towards +y."""
    half, front = 0.5 * width_m, depth_m - FRONT_M - 0.025
    carcass = block((-half, 0.0, low_z_m), (half, front, high_z_m), 0.004)
    fronts, handles = [], []
    step_x, step_z = width_m / columns, (high_z_m - low_z_m) / rows
    for column in range(columns):
        for row in range(rows):
            x0, z0 = -half + column * step_x + 0.004, low_z_m + row * step_z + 0.004
            x1, z1 = x0 + step_x - 0.008, z0 + step_z - 0.008
            fronts.append(block((x0, front, z0), (x1, front + FRONT_M, z1), 0.005))
            handles.append(_handle(x0, x1, z0, z1, front + FRONT_M, column % 2 == 0))
    return carcass, join(fronts), join(handles)


def _handle(x0: float, x1: float, z0: float, z1: float, y: float, hinge_left: bool) -> TriMesh:
    if x1 - x0 > z1 - z0:
        middle, reach = 0.5 * (x0 + x1), min(0.08, 0.3 * (x1 - x0))
        z = z1 - min(0.06, 0.5 * (z1 - z0))
        return block((middle - reach, y, z - 0.006), (middle + reach, y + 0.022, z + 0.006), 0.004)
    x = x1 - 0.04 if hinge_left else x0 + 0.04
    middle, reach = 0.5 * (z0 + z1), min(0.09, 0.3 * (z1 - z0))
    return block((x - 0.006, y, middle - reach), (x + 0.006, y + 0.022, middle + reach), 0.004)


def build_cabinet(piece: Piece, palette: Palette) -> list[Part]:
    """Wardrobe, dresser, sideboard, nightstand, wall cabinet: whatever has doors or drawers."""
    width, depth, height = piece.size_m
    tall = height > 1.2
    columns = max(1, round(width / (0.5 if tall else 0.55)))
    rows = 1 if tall else max(1, round((height - PLINTH_M) / 0.24))
    body, fronts, handles = cabinet(width, depth, PLINTH_M, height, columns, rows)
    half = 0.5 * width
    plinth = block((-half + 0.02, 0.01, 0.0), (half - 0.02, depth - 0.08, PLINTH_M), 0.003)
    wood = palette.wood if piece.detail[0] < 0.5 else palette.dark_wood
    return [
        Part("", join([body, plinth]), wood),
        Part("fronts", fronts, palette.lacquer if piece.detail[1] < 0.5 else wood),
        Part("handles", handles, palette.metal if piece.detail[2] < 0.6 else palette.black),
    ]


def build_wall_cabinet(piece: Piece, palette: Palette) -> list[Part]:
    """A kitchen cabinet that hangs on the wall."""
    width, depth, height = piece.size_m
    body, fronts, handles = cabinet(width, depth, 0.0, height, max(1, round(width / 0.5)), 1)
    return [
        Part("", body, palette.trim),
        Part("fronts", fronts, palette.lacquer),
        Part("handles", handles, palette.metal),
    ]


def build_bookshelf(piece: Piece, palette: Palette) -> list[Part]:
    """An open shelf with rows of books, each filled to a different length."""
    width, depth, height = piece.size_m
    half, board = 0.5 * width, 0.022
    levels = max(2, round((height - 0.08) / 0.36))
    pitch = (height - board - 0.06) / levels
    boards = [block((x, 0.0, 0.0), (x + board, depth, height), 0.003) for x in (-half, half - board)]
    boards.append(block((-half + board, 0.0, 0.06), (half - board, 0.012, height), 0.002))
    for level in range(levels + 1):
        z = 0.06 + level * pitch
        boards.append(block((-half + board, 0.0, z), (half - board, depth - 0.004, z + board), 0.003))
    wood = palette.wood if piece.detail[0] < 0.5 else palette.dark_wood
    parts = [Part("", join(boards), wood)]
    books: list[list[TriMesh]] = [[] for _ in palette.accents]
    for level in range(levels):
        z = 0.06 + level * pitch + board
        _fill_with_books(books, piece.detail[1 + level], (-half + board, half - board), z, pitch - board, depth)
    for index, (row, material) in enumerate(zip(books, palette.accents, strict=True)):
        if row:
            parts.append(Part(f"books_{index}", join(row), material))
    return parts


def _fill_with_books(
    books: list[list[TriMesh]],
    detail: float,
    reach_m: tuple[float, float],
    z_m: float,
    height_m: float,
    depth_m: float,
) -> None:
    """Adds one row of books to the meshes of their colours; ``detail`` settles how full and how varied it is."""
    x, end = reach_m[0] + 0.01, reach_m[1] - 0.05
    end -= 0.6 * detail * (end - x)
    count = 0
    while x < end:
        # Multiples of irrational numbers spread evenly over [0, 1) (Weyl 1916), so a row looks varied.
        vary = [(detail + (count + 1) * step) % 1.0 for step in (0.618034, 0.414214, 0.732051)]
        thick, tall = 0.018 + 0.032 * vary[0], (0.6 + 0.3 * vary[1]) * height_m
        deep = min(depth_m - 0.03, 0.14 + 0.06 * vary[2])
        book = block((x, 0.02, z_m), (x + thick, 0.02 + deep, z_m + tall), 0.003)
        books[int(len(books) * ((detail + count * 0.236068) % 1.0))].append(book)
        x += thick + 0.002
        count += 1


def build_tv(piece: Piece, palette: Palette) -> list[Part]:
    """A television on a foot, its screen towards +y."""
    width, depth, height = piece.size_m
    half, middle = 0.5 * width, 0.5 * depth
    screen = block((-half, middle - 0.02, 0.07), (half, middle + 0.015, height), 0.006)
    foot = [block((-0.25 * width, 0.0, 0.0), (0.25 * width, depth, 0.012), 0.004)]
    foot.append(block((-0.06, middle - 0.015, 0.01), (0.06, middle + 0.01, 0.08), 0.004))
    return [Part("", screen, palette.black), Part("foot", join(foot), palette.metal)]


def build_kitchen_counter(piece: Piece, palette: Palette) -> list[Part]:
    """A row of base cabinets under one worktop, with a sink, a tap, a stove and an oven door."""
    width, depth, height = piece.size_m
    half, top = 0.5 * width, height - 0.04
    body, fronts, handles = cabinet(width, depth - 0.03, 0.1, top, max(2, round(width / 0.6)), 1)
    plinth = block((-half + 0.02, 0.02, 0.0), (half - 0.02, depth - 0.10, 0.1), 0.003)
    worktop = block((-half, 0.0, top), (half, depth, height), 0.006)
    stove_x, sink_x = (1 if piece.detail[0] < 0.5 else -1) * 0.27 * width, 0.0
    sink_x = -stove_x
    hob = block((stove_x - 0.29, 0.06, height), (stove_x + 0.29, depth - 0.06, height + 0.008), 0.003)
    rings = [
        post((stove_x + x, y), 0.075, height + 0.008, height + 0.011, 20)
        for x in (-0.14, 0.14)
        for y in (0.19, depth - 0.19)
    ]
    oven_front = depth - 0.055
    oven = block((stove_x - 0.29, oven_front, 0.16), (stove_x + 0.29, oven_front + 0.028, top - 0.06), 0.005)
    grip = bar((stove_x - 0.2, depth - 0.018, top - 0.09), (stove_x + 0.2, depth - 0.018, top - 0.09), 0.009)
    return [
        Part("", join([body, plinth]), palette.trim),
        Part("fronts", fronts, palette.lacquer),
        Part("handles", join([handles, grip]), palette.metal),
        Part("worktop", worktop, palette.worktop),
        Part("sink", sink_basin(sink_x, 0.5 * depth, height), palette.metal),
        Part("tap", tap(sink_x, 0.09, height), palette.metal),
        Part("hob", hob, palette.black),
        Part("rings", join(rings), palette.metal),
        Part("oven", oven, palette.black),
    ]


def sink_basin(x_m: float, y_m: float, z_m: float) -> TriMesh:
    """A rim that stands on a worktop and frames a shallow basin."""
    rim = [(0.0, z_m), (0.21, z_m), (0.215, z_m + 0.03), (0.195, z_m + 0.035), (0.17, z_m + 0.006), (0.0, z_m + 0.004)]
    return lathe(rim, (x_m, y_m), 28)


def tap(x_m: float, y_m: float, z_m: float) -> TriMesh:
    """A tap with an arched spout towards +y."""
    angles = np.linspace(0.0, 0.75 * np.pi, 7)
    arch = [(x_m, y_m + 0.07 * (1 - np.cos(a)), z_m + 0.20 + 0.07 * np.sin(a)) for a in angles]
    pieces = [post((x_m, y_m), 0.022, z_m, z_m + 0.03), post((x_m, y_m), 0.012, z_m + 0.03, z_m + 0.20)]
    pieces += [bar(start, end, 0.011) for start, end in itertools.pairwise(arch)]
    return join(pieces)


def build_fridge(piece: Piece, palette: Palette) -> list[Part]:
    """A tall fridge with a freezer door below."""
    width, depth, height = piece.size_m
    half, split = 0.5 * width, 0.36 * height
    body = block((-half, 0.0, 0.0), (half, depth - 0.08, height), 0.01)
    doors = [
        block((-half + 0.003, depth - 0.08, low), (half - 0.003, depth - 0.03, high), 0.012, 2)
        for low, high in ((0.05, split - 0.004), (split + 0.004, height - 0.005))
    ]
    x = half - 0.06
    grips = [
        block((x - 0.012, depth - 0.03, low), (x + 0.012, depth, high), 0.006)
        for low, high in ((split - 0.35, split - 0.05), (split + 0.05, split + 0.45))
    ]
    skin: Material = palette.metal if piece.detail[0] < 0.5 else palette.trim
    return [Part("", join([body, *doors]), skin), Part("handles", join(grips), palette.black)]
