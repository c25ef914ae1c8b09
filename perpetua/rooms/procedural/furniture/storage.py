"""Tables, cabinets and shelves, in each piece's own frame."""

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.finish.palette import Palette, Style, cloth_of
from perpetua.rooms.procedural.furniture.legs import leg_material, legs
from perpetua.rooms.procedural.furniture.parts import Part, Profile, bar, block, curve, lathe, moved, post, tilted, tube
from perpetua.rooms.procedural.furniture.soft import cushion
from perpetua.rooms.procedural.layout.plan import Piece

FRONT_M = 0.02
HANDLE_M = 0.024
# How deep a framed front's panel lies behind its frame.
RECESS_M = 0.006
PLINTH_M = 0.08


def build_table(piece: Piece, palette: Palette) -> list[Part]:
    """A rectangular table on four legs, or a round one on a turned foot where width and depth are equal."""
    width, depth, height = piece.size_m
    board = palette.wood if piece.detail[0] < 0.6 else palette.dark_wood
    if width == depth:
        return _round_table(piece, palette)
    half, thick = 0.5 * width, min(0.08, 0.045 + 0.035 * piece.detail[1])
    top = block((-half, 0.0, height - 0.032), (half, depth, height), 0.008, 2)
    inset, rail_z = 0.03, height - (0.11 if height > 0.6 else 0.08)
    rails = [
        block((-half + inset + 0.02, y, rail_z), (half - inset - 0.02, y + 0.02, height - 0.03))
        for y in (inset + 0.012, depth - inset - 0.032)
    ]
    rails += [
        block((x, inset + 0.03, rail_z), (x + 0.02, depth - inset - 0.03, height - 0.03))
        for x in (-half + inset + 0.012, half - inset - 0.032)
    ]
    stand = [legs(palette.style, width, depth, height - 0.03, thick, inset), *rails]
    if height < 0.6 and piece.detail[2] < 0.5:
        stand.append(block((-half + 0.05, 0.05, 0.13), (half - 0.05, depth - 0.05, 0.15), 0.005))
    top_material = palette.worktop if height < 0.6 and piece.detail[3] < 0.3 else board
    return [Part("", top, top_material), Part("legs", join(stand), leg_material(palette, board))]


def _round_table(piece: Piece, palette: Palette) -> list[Part]:
    width, depth, height = piece.size_m
    board = palette.wood if piece.detail[0] < 0.6 else palette.dark_wood
    centre, radius, under = (0.0, 0.5 * depth), 0.5 * width, height - 0.03
    top = post(centre, radius, under, height, 40, 0.008)
    if radius < 0.3 or piece.detail[1] < 0.35:
        foot: Profile = [
            (0.62 * radius, 0.0),
            (0.6 * radius, 0.018),
            (0.03, 0.04),
            (0.022, 0.5 * height),
            (0.05, under),
        ]
        stem = lathe([(0.0, 0.0), *foot, (0.0, under)], centre, 28)
        return [Part("", top, board), Part("foot", stem, palette.black)]
    shape: Profile = [
        (0.085, 0.10),
        (0.11, 0.18),
        (0.05, 0.30),
        (0.075, 0.45),
        (0.10, 0.58),
        (0.05, 0.68),
        (0.11, under),
    ]
    shape = [(r, z * height / 0.75 if z != under else under) for r, z in shape]
    parts = [lathe([(0.0, shape[0][1]), *curve(shape, 20), (0.0, under)], centre, 20)]
    for quarter in range(4):
        x, y = np.cos(0.5 * np.pi * quarter), np.sin(0.5 * np.pi * quarter)
        path = [(0.06, 0.20), (0.3 * radius, 0.16), (0.55 * radius, 0.06), (0.62 * radius, 0.03)]
        parts.append(tube([(r * x, centre[1] + r * y, z) for r, z in path], [0.035, 0.032, 0.028, 0.03], 10))
    return [Part("", top, board), Part("foot", join(parts), board)]


def cabinet(
    width_m: float, depth_m: float, low_z_m: float, high_z_m: float, columns: int, rows: int, style: Style
) -> tuple[TriMesh, TriMesh, TriMesh]:
    """Carcass, fronts and handles of a cabinet with a grid of doors or drawers towards +y, in the depth given."""
    half, front = 0.5 * width_m, depth_m - FRONT_M - HANDLE_M
    carcass = block((-half, 0.0, low_z_m), (half, front, high_z_m), 0.003)
    fronts, handles = [], []
    step_x, step_z = width_m / columns, (high_z_m - low_z_m) / rows
    for column in range(columns):
        for row in range(rows):
            x0, z0 = -half + column * step_x + 0.003, low_z_m + row * step_z + 0.003
            x1, z1 = x0 + step_x - 0.006, z0 + step_z - 0.006
            fronts.append(_front(x0, x1, z0, z1, front - 0.002, style))
            handles.append(_handle(x0, x1, z0, z1, front + FRONT_M, column % 2 == 0, style))
    return carcass, join(fronts), join(handles)


def _front(x0: float, x1: float, z0: float, z1: float, y: float, style: Style) -> TriMesh:
    """A door or drawer front: a plain board, or a frame around a panel."""
    outer, rail = y + FRONT_M, 0.055
    if style.fronts == "flat" or min(x1 - x0, z1 - z0) < 0.2:
        return block((x0, y, z0), (x1, outer, z1), 0.004)
    return join(
        [
            block((x0 + 0.02, y, z0 + 0.02), (x1 - 0.02, outer - RECESS_M, z1 - 0.02), 0.002),
            block((x0, y, z0), (x0 + rail, outer, z1), 0.003),
            block((x1 - rail, y, z0), (x1, outer, z1), 0.003),
            block((x0 + rail - 0.004, y, z0), (x1 - rail + 0.004, outer - 0.0005, z0 + rail), 0.003),
            block((x0 + rail - 0.004, y, z1 - rail), (x1 - rail + 0.004, outer - 0.0005, z1), 0.003),
        ]
    )


def _handle(x0: float, x1: float, z0: float, z1: float, y: float, hinge_left: bool, style: Style) -> TriMesh:
    drawer = x1 - x0 > 1.2 * (z1 - z0)
    if drawer:
        x, z = 0.5 * (x0 + x1), z1 - min(0.075, 0.5 * (z1 - z0))
    else:
        x, z = x1 - 0.035 if hinge_left else x0 + 0.035, 0.5 * (z0 + z1)
    # Every handle begins behind the panel that it may stand on.
    back, reach = y - RECESS_M - 0.003, 0.5 * HANDLE_M
    if style.handles == "knob":
        path = [
            (x, back, z),
            (x, y + 0.010, z),
            (x, y + 0.012, z),
            (x, y + 0.018, z),
            (x, y + HANDLE_M - 0.001, z),
        ]
        return tube(path, [0.006, 0.006, 0.014, 0.015, 0.008], 12)
    if style.handles == "cup" and drawer:
        arch = [(x + 0.045 * np.cos(a), y + 0.002, z + 0.022 * np.sin(a)) for a in np.linspace(0.0, np.pi, 9)]
        return tube([(float(px), py, float(pz)) for px, py, pz in arch], 0.009, 8)
    span = min(0.09, 0.3 * max(x1 - x0, z1 - z0))
    (dx, dz) = (span, 0.0) if drawer else (0.0, span)
    rod = bar((x - dx, y + reach + 0.006, z - dz), (x + dx, y + reach + 0.006, z + dz), 0.0055, 8)
    feet = [
        bar(
            (x + s * 0.8 * dx, back, z + s * 0.8 * dz),
            (x + s * 0.8 * dx, y + reach + 0.006, z + s * 0.8 * dz),
            0.004,
            6,
        )
        for s in (-1.0, 1.0)
    ]
    return join([rod, *feet])


def build_cabinet(piece: Piece, palette: Palette) -> list[Part]:
    """Wardrobe, dresser, sideboard, nightstand, low cabinet: whatever has doors or drawers."""
    width, depth, height = piece.size_m
    half, tall = 0.5 * width, height > 1.2
    columns = max(1, round(width / (0.5 if tall else 0.6)))
    rows = 1 if tall else max(1, round((height - PLINTH_M) / 0.26))
    if piece.category in ("sideboard", "tv_bench") and piece.detail[3] < 0.6:
        rows = 1
    wood = palette.wood if piece.detail[0] < 0.5 else palette.dark_wood
    on_legs = not tall and height > 0.4 and piece.detail[4] < 0.6
    low = 0.15 if on_legs else PLINTH_M
    body, fronts, handles = cabinet(width - 0.02, depth - 0.004, low, height - 0.02, columns, rows, palette.style)
    top = block((-half, 0.0, height - 0.022), (half, depth - HANDLE_M + 0.004, height), 0.006, 2)
    if on_legs:
        foot = Part(
            "legs", legs(palette.style, width, depth - HANDLE_M, low + 0.002, 0.045, 0.03), leg_material(palette, wood)
        )
    else:
        foot = Part("plinth", block((-half + 0.02, 0.01, 0.0), (half - 0.02, depth - 0.09, low + 0.002), 0.003), wood)
    return [
        Part("", join([body, top]), wood),
        foot,
        Part("fronts", fronts, palette.lacquer if piece.detail[1] < 0.45 else wood),
        Part("handles", handles, palette.handle),
    ]


def build_bookshelf(piece: Piece, palette: Palette) -> list[Part]:
    """An open shelf: rows of books of many sizes, upright and lying, among vases and boxes."""
    width, depth, height = piece.size_m
    half, board = 0.5 * width, 0.022
    levels = max(2, round((height - 0.08) / 0.36))
    pitch = (height - board - 0.06) / levels
    boards = [block((x, 0.0, 0.0), (x + board, depth, height), 0.003) for x in (-half, half - board)]
    boards.append(block((-half + 0.5 * board, 0.0, 0.05), (half - 0.5 * board, 0.012, height - 0.002), 0.002))
    for level in range(levels + 1):
        z = 0.06 + level * pitch
        boards.append(block((-half + 0.5 * board, 0.0, z), (half - 0.5 * board, depth - 0.004, z + board), 0.003))
    wood = palette.wood if piece.detail[0] < 0.5 else palette.dark_wood
    rows = ShelfRows(palette)
    for level in range(levels):
        z = 0.06 + level * pitch + board
        rows.fill(piece.detail[1 + level], (-half + board, half - board), z, pitch - board, depth)
    return [Part("", join(boards), wood), *rows.parts()]


class ShelfRows:
    """What stands on shelves, gathered by material."""

    def __init__(self, palette: Palette) -> None:
        self._materials = (*palette.books, *palette.accents[:3], palette.wicker)
        self._meshes: list[list[TriMesh]] = [[] for _ in self._materials]
        self._books = len(palette.books)

    def parts(self) -> list[Part]:
        """One part for each material that was used."""
        pairs = zip(self._meshes, self._materials, strict=True)
        return [
            Part(f"things_{k}", join(meshes), material, "books") for k, (meshes, material) in enumerate(pairs) if meshes
        ]

    def fill(self, detail: float, reach_m: tuple[float, float], z_m: float, height_m: float, depth_m: float) -> None:
        """Fills one level from ``reach_m[0]`` on; ``detail`` settles with what, and how full."""
        x, end, turn = reach_m[0] + 0.012, reach_m[1] - 0.015, 0
        while x < end - 0.05:
            fraction = (detail + 0.618034 * (turn + 1)) % 1.0
            if fraction < 0.55:
                x = self._upright(fraction / 0.55, x, min(end, x + 0.18 + 0.3 * fraction), z_m, height_m, depth_m)
            elif fraction < 0.72:
                x = self._lying(fraction, x, end, z_m, height_m, depth_m)
            elif fraction < 0.9:
                x = self._object(fraction, x, end, z_m, height_m, depth_m)
            else:
                x += 0.10
            x += 0.02
            turn += 1

    def _upright(self, detail: float, x: float, end: float, z: float, height: float, depth: float) -> float:
        count = 0
        while x < end - 0.05:
            # Multiples of irrational numbers spread evenly over [0, 1) (Weyl 1916), so a row looks varied.
            vary = [(detail + (count + 1) * step) % 1.0 for step in (0.618034, 0.414214, 0.732051)]
            thick, tall = 0.016 + 0.030 * vary[0], (0.55 + 0.36 * vary[1]) * height
            deep = min(depth - 0.06, 0.13 + 0.07 * vary[2])
            front = depth - 0.025 - 0.02 * vary[1]
            self._add(detail + count * 0.236068, block((x, front - deep, z), (x + thick, front, z + tall), 0.003))
            x += thick + 0.0015
            count += 1
        return x

    def _lying(self, detail: float, x: float, end: float, z: float, height: float, depth: float) -> float:
        wide = min(0.24, end - x)
        for count in range(2 + int(6 * detail) % 3):
            thick, inset = 0.022 + 0.012 * ((detail + 0.41 * count) % 1.0), 0.02 * ((detail + 0.73 * count) % 1.0)
            if thick > height - 0.05:
                break
            book = block((x + inset, 0.04 + inset, z), (x + wide, min(depth - 0.02, 0.22), z + thick), 0.003)
            self._add(detail + 0.3 * count, book)
            z += thick
            height -= thick
        return x + wide

    def _object(self, detail: float, x: float, end: float, z: float, height: float, depth: float) -> float:
        radius = min(0.07 + 0.03 * ((7 * detail) % 1.0), 0.5 * (end - x), 0.42 * depth)
        tall = min(0.8 * height, 2.4 * radius)
        middle = (x + radius, 0.5 * depth)
        slot = self._books + int(13 * detail) % (len(self._meshes) - self._books)
        if slot == len(self._meshes) - 1:
            box = block((x, 0.5 * depth - radius, z), (x + 2 * radius, 0.5 * depth + radius, z + 0.7 * tall), 0.012, 2)
            self._meshes[slot].append(box)
        else:
            shape = curve(
                [(0.55 * radius, 0.0), (radius, 0.4 * tall), (0.4 * radius, 0.8 * tall), (0.5 * radius, tall)], 12
            )
            profile = [(0.0, 0.0), *shape, (0.4 * radius, tall - 0.005), (0.0, 0.75 * tall)]
            self._meshes[slot].append(moved(lathe(profile, middle, 18), (0.0, 0.0, z)))
        return x + 2 * radius

    def _add(self, detail: float, mesh: TriMesh) -> None:
        self._meshes[int(self._books * (detail % 1.0))].append(mesh)


def build_wall_shelf(piece: Piece, palette: Palette) -> list[Part]:
    """A board on brackets with a few objects on it."""
    width, depth, height = piece.size_m
    half, board_z = 0.5 * width, 0.16
    board = block((-half, 0.0, board_z), (half, depth, board_z + 0.025), 0.006)
    brackets = []
    for x in (-0.7 * half, 0.7 * half):
        path = [(x, 0.008, 0.02), (x, 0.008, board_z - 0.005), (x, 0.85 * depth, board_z - 0.005)]
        brackets.append(tube([path[0], path[1]], 0.008, 8))
        brackets.append(bar(path[1], path[2], 0.007, 8))
        brackets.append(bar((x, 0.008, 0.035), (x, 0.75 * depth, board_z - 0.006), 0.005, 8))
    rows = ShelfRows(palette)
    rows.fill(piece.detail[1], (-half + 0.03, half - 0.03), board_z + 0.025, height - board_z - 0.03, depth)
    wood = palette.wood if piece.detail[0] < 0.5 else palette.dark_wood
    return [Part("", board, wood), Part("brackets", join(brackets), palette.black), *rows.parts()]


def build_coat_rack(piece: Piece, palette: Palette) -> list[Part]:
    """A rail with hooks on the wall, and a coat or bag on it."""
    width, _, height = piece.size_m
    half, z = 0.5 * width, height - 0.07
    wood = palette.wood if piece.detail[0] < 0.5 else palette.dark_wood
    rail = block((-half, 0.0, z - 0.045), (half, 0.022, z + 0.045), 0.008, 2)
    hooks, places = [], np.linspace(-half + 0.07, half - 0.07, max(3, round(width / 0.18)))
    for x in places:
        arc = [(0.0, 0.0), (0.05, -0.01), (0.075, -0.02), (0.08, 0.0), (0.078, 0.03)]
        hooks.append(tube([(float(x), 0.015 + y, z + h) for y, h in arc], 0.006, 8))
    x = float(places[1])
    coat = tilted(cushion((x - 0.2, 0.03, 0.0), (x + 0.2, 0.13, z + 0.015), 3.0, (8, 5, 12)), 0.0, (0.0, 0.0))
    cloth = palette.second_upholstery if piece.detail[1] < 0.5 else palette.upholstery
    return [
        Part("", rail, wood),
        Part("hooks", join(hooks), palette.handle),
        Part("coat", coat, cloth, "clothes"),
    ]


def build_linen_shelf(piece: Piece, palette: Palette) -> list[Part]:
    """An open shelf with folded towels and jars."""
    width, depth, height = piece.size_m
    half, post_m = 0.5 * width, 0.03
    levels = max(2, round(height / 0.4))
    frame = [
        block((x, y, 0.0), (x + post_m, y + post_m, height - 0.01), 0.004)
        for x in (-half, half - post_m)
        for y in (0.0, depth - post_m)
    ]
    heights = [0.1 + level * (height - 0.125) / (levels - 1) for level in range(levels)]
    frame += [block((-half, 0.0, z), (half, depth, z + 0.025), 0.005) for z in heights]
    wood = palette.wood if piece.detail[0] < 0.5 else palette.dark_wood
    piles: list[list[TriMesh]] = [[], [], []]
    for level, z in enumerate(heights[:-1]):
        for slot in range(2):
            fraction = (piece.detail[1 + level] + 0.618034 * slot) % 1.0
            if fraction < 0.75:
                x = (slot - 0.5) * 0.48 * width
                for fold in range(1 + int(4 * fraction)):
                    low = z + 0.024 + 0.055 * fold
                    reach = 0.19 * width
                    towel = cushion((x - reach, 0.04, low), (x + reach, depth - 0.03, low + 0.061), 6.0, (8, 7, 4))
                    piles[(slot + level) % 3].append(towel)
    cloths = (palette.linen, cloth_of(palette.accents[0]), cloth_of(palette.accents[1]))
    towels = [
        Part(f"towels_{k}", join(pile), cloth, "towels")
        for k, (pile, cloth) in enumerate(zip(piles, cloths, strict=True))
        if pile
    ]
    return [Part("", join(frame), wood), *towels]
