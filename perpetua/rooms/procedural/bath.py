"""Bathroom fittings, in each piece's own frame."""

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.palette import Palette
from perpetua.rooms.procedural.parts import Part, bar, block, lathe, post
from perpetua.rooms.procedural.plan import Piece
from perpetua.rooms.procedural.storage import cabinet, sink_basin, tap


def build_toilet(piece: Piece, palette: Palette) -> list[Part]:
    """A toilet with its cistern at the wall and the lid closed."""
    width, depth, height = piece.size_m
    half, bowl_y, radius = 0.5 * width, depth - 0.5 * width, 0.5 * width
    foot = lathe(
        [(0.0, 0.0), (0.62 * radius, 0.0), (0.55 * radius, 0.12), (0.95 * radius, 0.36), (radius, 0.40), (0.0, 0.40)],
        (0.0, bowl_y),
        28,
    )
    neck = block((-0.6 * half, 0.10, 0.0), (0.6 * half, bowl_y, 0.39), 0.03, 2)
    cistern = block((-half, 0.0, 0.36), (half, 0.19, height), 0.025, 3)
    lid = join(
        [
            post((0.0, bowl_y), radius, 0.40, 0.43, 28),
            block((-0.85 * half, 0.20, 0.401), (0.85 * half, bowl_y, 0.427), 0.01),
        ]
    )
    button = post((0.0, 0.095), 0.025, height, height + 0.008)
    return [
        Part("", join([foot, neck, cistern]), palette.ceramic),
        Part("lid", lid, palette.trim),
        Part("button", button, palette.metal),
    ]


def build_bathtub(piece: Piece, palette: Palette) -> list[Part]:
    """A built-in bathtub: four walls around a basin, with a tap at one end."""
    width, depth, height = piece.size_m
    half, rim = 0.5 * width, 0.07
    shell = [
        block((-half, 0.0, 0.0), (half, rim, height), 0.015, 2),
        block((-half, depth - rim, 0.0), (half, depth, height), 0.015, 2),
        block((-half, rim - 0.01, 0.0), (-half + rim, depth - rim + 0.01, height), 0.015, 2),
        block((half - rim, rim - 0.01, 0.0), (half, depth - rim + 0.01, height), 0.015, 2),
        block((-half + rim - 0.01, rim - 0.01, 0.0), (half - rim + 0.01, depth - rim + 0.01, 0.16), 0.01),
    ]
    side = 1.0 if piece.detail[0] < 0.5 else -1.0
    spout_x = side * (half - 0.035)
    spout = [
        post((spout_x, 0.5 * depth), 0.016, height, height + 0.14),
        bar((spout_x, 0.5 * depth, height + 0.13), (spout_x - side * 0.13, 0.5 * depth, height + 0.10), 0.014),
    ]
    return [Part("", join(shell), palette.ceramic), Part("tap", join(spout), palette.metal)]


def build_vanity(piece: Piece, palette: Palette) -> list[Part]:
    """A cabinet with a worktop, a wash basin and a tap."""
    width, depth, height = piece.size_m
    half, top = 0.5 * width, height - 0.03
    body, fronts, handles = cabinet(width, depth - 0.02, 0.12, top, max(1, round(width / 0.5)), 2)
    plinth = block((-half + 0.03, 0.02, 0.0), (half - 0.03, depth - 0.10, 0.12), 0.003)
    return [
        Part("", join([body, plinth]), palette.wood),
        Part("fronts", fronts, palette.lacquer),
        Part("handles", handles, palette.metal),
        Part("worktop", block((-half, 0.0, top), (half, depth, height), 0.006), palette.worktop),
        Part("basin", sink_basin(0.0, 0.55 * depth, height), palette.ceramic),
        Part("tap", tap(0.0, 0.035, height), palette.metal),
    ]


def build_shower(piece: Piece, palette: Palette) -> list[Part]:
    """A shower: tray, a partition on one side, pole and head."""
    width, depth, height = piece.size_m
    half = 0.5 * width
    side = 1.0 if piece.detail[0] < 0.5 else -1.0
    tray = block((-half, 0.0, 0.0), (half, depth, 0.12), 0.02, 2)
    low_x, high_x = sorted((side * half, side * (half - 0.05)))
    wall = block((low_x, 0.0, 0.12), (high_x, depth, height), 0.004)
    pole: list[TriMesh] = [
        post((0.0, 0.05), 0.012, 0.118, height - 0.02),
        bar((0.0, 0.05, height - 0.03), (0.0, 0.38, height - 0.03), 0.012),
        lathe([(0.0, height - 0.08), (0.11, height - 0.08), (0.10, height - 0.06), (0.0, height - 0.03)], (0.0, 0.38)),
    ]
    return [
        Part("", tray, palette.ceramic),
        Part("partition", wall, palette.lacquer),
        Part("pole", join(pole), palette.metal),
    ]


def build_towel(piece: Piece, palette: Palette) -> list[Part]:
    """A towel over a rail on the wall."""
    width, depth, height = piece.size_m
    half = 0.5 * width
    y, z = 0.5 * depth, height - 0.03
    rail = [bar((-half, y, z), (half, y, z), 0.010)]
    rail += [block((x - 0.01, 0.0, z - 0.012), (x + 0.01, y, z + 0.012)) for x in (-half + 0.02, half - 0.02)]
    cloth = block((-0.36 * width, y - 0.018, 0.0), (0.36 * width, y + 0.018, z + 0.016), 0.012, 2)
    return [Part("", cloth, palette.accents[int(5 * piece.detail[0])]), Part("rail", join(rail), palette.metal)]


def build_basket(piece: Piece, palette: Palette) -> list[Part]:
    """A laundry basket with a lid."""
    radius, height = 0.5 * min(piece.size_m[:2]), piece.size_m[2]
    centre = (0.0, 0.5 * piece.size_m[1])
    body = lathe([(0.0, 0.0), (0.8 * radius, 0.0), (0.97 * radius, height - 0.04), (0.0, height - 0.04)], centre, 26)
    lid = lathe([(0.0, height - 0.04), (radius, height - 0.04), (0.9 * radius, height), (0.0, height)], centre, 26)
    return [Part("", body, palette.linen), Part("lid", lid, palette.wood)]
