"""Bathroom fittings, in each piece's own frame."""

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.finish.palette import Palette, cloth_of
from perpetua.rooms.procedural.furniture.kitchen import tap
from perpetua.rooms.procedural.furniture.parts import Part, bar, block, curve, lathe, loft, post, tube
from perpetua.rooms.procedural.furniture.soft import cushion
from perpetua.rooms.procedural.furniture.storage import cabinet
from perpetua.rooms.procedural.layout.plan import Piece

# Height in metres, and width, back and front edge as shares of half the width and of the depth, from the foot up.
TOILET = (
    (0.0, 0.56, 0.10, 0.62),
    (0.06, 0.52, 0.10, 0.60),
    (0.18, 0.62, 0.08, 0.72),
    (0.30, 0.88, 0.06, 0.93),
    (0.37, 0.97, 0.05, 0.985),
    (0.395, 0.97, 0.05, 0.985),
)


def build_toilet(piece: Piece, palette: Palette) -> list[Part]:
    """A toilet with its cistern at the wall and the lid closed."""
    width, depth, height = piece.size_m
    half = 0.5 * width
    rings = [_oval(half * wide, depth * back, depth * front, z) for z, wide, back, front in TOILET]
    lid = [
        _oval(half * wide, 0.21, depth * 0.992, z)
        for z, wide in ((0.396, 0.96), (0.40, 0.99), (0.42, 0.99), (0.43, 0.94))
    ]
    cistern = block((-half, 0.0, 0.37), (half, 0.185, height - 0.03), 0.03, 3)
    cover = block((-half, 0.0, height - 0.035), (half, 0.19, height - 0.006), 0.012, 2)
    button = post((0.0, 0.095), 0.028, height - 0.008, height, 18, 0.002)
    return [
        Part("", join([loft(np.stack(rings)), cistern, cover]), palette.ceramic),
        Part("lid", loft(np.stack(lid)), palette.trim),
        Part("button", button, palette.metal),
    ]


def _oval(half: float, back: float, front: float, z: float, sides: int = 28) -> np.ndarray:
    """A ring that is square at the back and round in front."""
    angles = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    power = np.where(np.sin(angles) < 0.0, 0.45, 0.9)
    x = half * np.sign(np.cos(angles)) * np.abs(np.cos(angles)) ** power
    y = 0.5 * (front - back) * np.sign(np.sin(angles)) * np.abs(np.sin(angles)) ** power
    return np.column_stack([x, 0.5 * (back + front) + y, np.full(sides, z)])


def _basin(half_x: float, low_y: float, high_y: float, levels: list[tuple[float, float]], sides: int = 40) -> TriMesh:
    """Rounded-off rectangular rings lofted through (inset, z): from the foot of the outside to the basin's floor."""
    angles = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    corner = [np.sign(wave(angles)) * np.abs(wave(angles)) ** 0.32 for wave in (np.cos, np.sin)]
    middle, half_y = 0.5 * (low_y + high_y), 0.5 * (high_y - low_y)
    rings = [
        np.column_stack([(half_x - inset) * corner[0], middle + (half_y - inset) * corner[1], np.full(sides, z)])
        for inset, z in levels
    ]
    return loft(np.stack(rings))


def build_bathtub(piece: Piece, palette: Palette) -> list[Part]:
    """A bathtub with rounded inside: built in behind an apron, or standing free on its own foot."""
    width, depth, height = piece.size_m
    half = 0.5 * width
    basin = [(0.075, height), (0.10, height - 0.02), (0.13, 0.30), (0.20, 0.20)]
    if piece.detail[0] < 0.5:
        apron = [
            block((-half, 0.0, 0.0), (half, 0.075, height - 0.012), 0.004),
            block((-half, depth - 0.05, 0.0), (half, depth - 0.012, height - 0.012), 0.004),
            block((-half, 0.06, 0.0), (-half + 0.06, depth - 0.03, height - 0.012), 0.004),
            block((half - 0.06, 0.06, 0.0), (half, depth - 0.03, height - 0.012), 0.004),
        ]
        shell = _rim(half, depth, height, 0.15, basin)
        body = [Part("", shell, palette.ceramic), Part("apron", join(apron), palette.splashback)]
    else:
        outside = [
            (0.16, 0.0),
            (0.15, 0.03),
            (0.07, 0.32),
            (0.015, height - 0.03),
            (0.0, height - 0.008),
            (0.012, height),
        ]
        shell = _basin(half, 0.0, depth, [*outside, (0.045, height), *basin[1:]])
        body = [Part("", shell, palette.ceramic)]
    side = 1.0 if piece.detail[1] < 0.5 else -1.0
    x = side * (half - 0.036)
    path = [
        (x, 0.5 * depth, height - 0.015),
        (x, 0.5 * depth, height + 0.16),
        (x - side * 0.05, 0.5 * depth, height + 0.2),
    ]
    path += [(x - side * 0.12, 0.5 * depth, height + 0.19), (x - side * 0.15, 0.5 * depth, height + 0.15)]
    knobs = [post((x, 0.5 * depth + dy), 0.02, height - 0.012, height + 0.05, 14, 0.004) for dy in (-0.11, 0.11)]
    return [*body, Part("tap", join([tube(path, 0.014, 10), *knobs]), palette.handle, "tap")]


def _rim(half: float, depth: float, height: float, low: float, basin: list[tuple[float, float]]) -> TriMesh:
    """A body from ``low`` up, with a rectangular rim that goes over into a rounded basin."""
    sides = 40
    inside = _basin(half, 0.0, depth, basin, sides).vertices_m[: sides * len(basin)].reshape(len(basin), sides, 3)
    angles = np.linspace(0.0, 2 * np.pi, sides, endpoint=False)
    reach = 1.0 / np.maximum(np.abs(np.cos(angles)), np.abs(np.sin(angles)))
    square = np.column_stack([np.cos(angles) * reach, np.sin(angles) * reach])
    rings = []
    for inset, z in (
        (0.02, low),
        (0.02, height - 0.035),
        (0.0, height - 0.033),
        (0.0, height - 0.003),
        (0.003, height),
    ):
        size = np.array([half - inset, 0.5 * depth - inset])
        rings.append(np.column_stack([square * size + np.array([0.0, 0.5 * depth]), np.full(sides, z)]))
    return loft(np.concatenate([np.stack(rings), inside]))


def build_vanity(piece: Piece, palette: Palette) -> list[Part]:
    """A cabinet with a worktop, one or two wash basins that stand on it, and their taps."""
    width, depth, height = piece.size_m
    half, top = 0.5 * width, height - 0.03
    body, fronts, handles = cabinet(
        width - 0.01, depth - 0.01, 0.14, top, max(1, round(width / 0.55)), 2, palette.style
    )
    plinth = block((-half + 0.03, 0.02, 0.0), (half - 0.03, depth - 0.10, 0.142), 0.003)
    places = (-0.25 * width, 0.25 * width) if width > 1.25 else (0.0,)
    round_basin = piece.detail[1] < 0.5
    basins = []
    for x in places:
        if round_basin:
            bowl = [(0.0, 0.0), (0.12, 0.0), (0.185, 0.07), (0.20, 0.125), (0.195, 0.13), (0.185, 0.12), (0.10, 0.03)]
            basins.append(lathe([(r, z + height) for r, z in [*bowl, (0.0, 0.025)]], (x, 0.56 * depth), 32))
        else:
            levels = [
                (0.03, height),
                (0.0, height + 0.10),
                (0.004, height + 0.115),
                (0.014, height + 0.115),
                (0.04, height + 0.03),
            ]
            levels = [*levels, (0.06, height + 0.022)]
            shell = _basin(0.24, 0.56 * depth - 0.16, 0.56 * depth + 0.16, levels)
            basins.append(join([TriMesh(shell.vertices_m + np.array([x, 0.0, 0.0]), shell.faces)]))
    wood = palette.wood if piece.detail[2] < 0.6 else palette.dark_wood
    return [
        Part("", join([body, plinth]), wood),
        Part("fronts", fronts, palette.lacquer if piece.detail[3] < 0.5 else wood),
        Part("handles", handles, palette.handle),
        Part("worktop", block((-half, 0.0, top), (half, depth, height), 0.006, 2), palette.worktop),
        Part("basin", join(basins), palette.ceramic, "sink"),
        Part("tap", join([tap(x, 0.04, height) for x in places]), palette.handle, "tap"),
    ]


def build_shower(piece: Piece, palette: Palette) -> list[Part]:
    """A shower: tray, low partition on one side, rail with a hand shower, and a large head."""
    width, depth, height = piece.size_m
    half = 0.5 * width
    side = 1.0 if piece.detail[0] < 0.5 else -1.0
    tray = _rim(half, depth, 0.10, 0.0, [(0.05, 0.10), (0.065, 0.085), (0.10, 0.062), (0.40 * width, 0.058)])
    low_x, high_x = sorted((side * half, side * (half - 0.055)))
    wall = block((low_x, 0.0, 0.098), (high_x, depth, height), 0.006)
    cap = block((low_x - 0.004, 0.0, height - 0.004), (high_x + 0.004, depth, height + 0.012), 0.003)
    head_z = height - 0.03
    path = [
        (0.0, 0.035, 1.0),
        (0.0, 0.035, head_z - 0.06),
        (0.0, 0.06, head_z - 0.01),
        (0.0, 0.12, head_z),
        (0.0, 0.40, head_z),
    ]
    head = lathe(
        [(0.0, head_z - 0.045), (0.125, head_z - 0.045), (0.125, head_z - 0.03), (0.02, head_z - 0.018), (0.0, head_z)],
        (0.0, 0.40),
        28,
    )
    box = bar((-0.12, 0.04, 1.02), (0.12, 0.04, 1.02), 0.022, 14)
    brackets = [bar((0.0, -0.0, z), (0.0, 0.036, z), 0.012, 8) for z in (1.02, head_z - 0.12)]
    hose = [(0.10, 0.05, 1.0), (0.15, 0.06, 0.7), (0.06, 0.07, 0.55), (0.012, 0.07, 0.8), (0.012, 0.06, 1.35)]
    fine = np.array(
        [[float(np.interp(t, range(5), [p[k] for p in hose])) for k in range(3)] for t in np.linspace(0, 4, 17)]
    )
    fine[1:-1] = (fine[:-2] + 2 * fine[1:-1] + fine[2:]) / 4
    hand = tube([(0.0, 0.05, 1.34), (0.0, 0.08, 1.46), (0.0, 0.11, 1.50)], [0.012, 0.014, 0.04], 14)
    metal = [
        tube(path, 0.012, 10),
        head,
        box,
        *brackets,
        tube([(float(x), float(y), float(z)) for x, y, z in fine], 0.007, 6),
        hand,
    ]
    return [
        Part("", tray, palette.ceramic),
        Part("partition", join([wall, cap]), palette.splashback),
        Part("pole", join(metal), palette.handle, "tap"),
    ]


def build_towel(piece: Piece, palette: Palette) -> list[Part]:
    """A towel over a rail on the wall."""
    width, depth, height = piece.size_m
    half = 0.5 * width
    y, z = 0.55 * depth, height - 0.028
    rail = [bar((-half, y, z), (half, y, z), 0.010)]
    rail += [bar((x, 0.0, z), (x, y, z), 0.013, 12) for x in (-half + 0.025, half - 0.025)]
    cloth = cushion((-0.34 * width, y - 0.028, 0.0), (0.34 * width, y + 0.028, height), 9.0, (10, 4, 10))
    stripe = cushion((-0.342 * width, y - 0.0295, 0.10), (0.342 * width, y + 0.0295, 0.15), 9.0, (10, 4, 3))
    color = palette.accents[int(5 * piece.detail[0])]
    return [
        Part("", cloth, cloth_of(color)),
        Part("stripe", stripe, palette.linen),
        Part("rail", join(rail), palette.handle),
    ]


def build_towel_stack(piece: Piece, palette: Palette) -> list[Part]:
    """Folded towels on each other."""
    width, depth, height = piece.size_m
    parts, count = [], 3
    for index in range(count):
        low, high = height * index / count, height * (index + 1) / count + 0.006 * (index < count - 1)
        half = 0.5 * width * (1.0 - 0.06 * piece.detail[index])
        towel = cushion((-half, 0.0, low), (half, depth, high), 6.0, (8, 7, 4))
        material = palette.linen if index % 2 else palette.accents[int(5 * piece.detail[4])]
        parts.append(Part("" if index == 0 else f"{index}", towel, material))
    return parts


def build_basket(piece: Piece, palette: Palette) -> list[Part]:
    """A wicker basket with a rolled rim, and cloth in it."""
    width, depth, height = piece.size_m
    radius, centre = 0.5 * min(width, depth), (0.0, 0.5 * depth)
    rim_z = height - 0.04
    outline = curve([(0.80 * radius, 0.0), (0.95 * radius, 0.4 * rim_z), (0.96 * radius, rim_z)], 8)
    body = lathe(
        [(0.0, 0.0), *outline, (0.90 * radius, rim_z), (0.86 * radius, rim_z - 0.1), (0.0, rim_z - 0.1)], centre, 30
    )
    angles = np.linspace(0.0, 2 * np.pi, 33)
    ring = tube(
        [(0.94 * radius * float(np.cos(a)), centre[1] + 0.94 * radius * float(np.sin(a)), rim_z) for a in angles],
        0.016,
        8,
    )
    cloth = cushion(
        (-0.78 * radius, centre[1] - 0.78 * radius, rim_z - 0.13),
        (0.78 * radius, centre[1] + 0.78 * radius, height),
        2.6,
        (10, 10, 6),
    )
    return [Part("", join([body, ring]), palette.wicker), Part("cloth", cloth, palette.linen)]


def build_soap(piece: Piece, palette: Palette) -> list[Part]:
    """A soap dispenser beside a beaker with toothbrushes."""
    width, depth, height = piece.size_m
    y, radius = 0.5 * depth, 0.2 * width
    bottle = [
        (0.0, 0.0),
        (radius, 0.0),
        (radius, 0.62 * height),
        (0.3 * radius, 0.72 * height),
        (0.3 * radius, 0.86 * height),
        (0.0, 0.86 * height),
    ]
    x = -0.26 * width
    pump = tube([(x, y, 0.85 * height), (x, y, 0.97 * height), (x, y + 0.03, 0.975 * height)], 0.006, 8)
    beaker = [
        (0.0, 0.0),
        (0.9 * radius, 0.0),
        (radius, 0.55 * height),
        (0.9 * radius, 0.55 * height),
        (0.8 * radius, 0.1 * height),
        (0.0, 0.1 * height),
    ]
    brush = tube([(0.24 * width, y, 0.1 * height), (0.24 * width + 0.6 * radius, y, 0.95 * height)], 0.004, 6)
    return [
        Part("", lathe(bottle, (x, y), 18), palette.accents[int(5 * piece.detail[0])]),
        Part("pump", pump, palette.handle),
        Part("beaker", lathe(beaker, (0.24 * width, y), 18), palette.ceramic),
        Part("brush", brush, palette.accents[int(5 * piece.detail[1])]),
    ]


def build_paper_roll(piece: Piece, palette: Palette) -> list[Part]:
    """A roll of paper on a holder on the wall."""
    width, depth, height = piece.size_m
    half, y, z = 0.5 * width, depth - 0.055, 0.5 * height
    roll = bar((-0.4 * width, y, z), (0.4 * width, y, z), 0.05, 24)
    rod = [bar((-half, y, z), (half, y, z), 0.008, 8), bar((-half + 0.008, 0.0, z), (-half + 0.008, y, z), 0.008, 8)]
    return [Part("", roll, palette.linen), Part("holder", join(rod), palette.handle)]
