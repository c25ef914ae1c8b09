"""What hangs on walls or lies on floors, in each piece's own frame."""

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.finish.palette import PICTURES, Palette
from perpetua.rooms.procedural.furniture.parts import Part, bar, block, lathe, moved, post, tube
from perpetua.rooms.procedural.furniture.soft import curtain
from perpetua.rooms.procedural.layout.plan import Piece


def frame(width_m: float, height_m: float, depth_m: float, edge_m: float) -> TriMesh:
    """Four bevelled bars around a rectangle that stands on z = 0 with its back on y = 0."""
    half = 0.5 * width_m
    return join(
        [
            block((-half, 0.0, 0.0), (half, depth_m, edge_m), 0.005),
            block((-half, 0.0, height_m - edge_m), (half, depth_m, height_m), 0.005),
            block((-half, 0.0, edge_m - 0.003), (-half + edge_m, depth_m, height_m - edge_m + 0.003), 0.005),
            block((half - edge_m, 0.0, edge_m - 0.003), (half, depth_m, height_m - edge_m + 0.003), 0.005),
        ]
    )


def build_picture(piece: Piece, palette: Palette) -> list[Part]:
    """A framed print or, by its category, a mirror."""
    width, depth, height = piece.size_m
    mirror = piece.category == "mirror"
    edge = 0.022 + 0.02 * piece.detail[2]
    half = 0.5 * width
    inner = block((-half + 0.5 * edge, 0.0, 0.5 * edge), (half - 0.5 * edge, 0.55 * depth, height - 0.5 * edge), 0.0005)
    face = palette.mirror if mirror else palette.pictures[int(PICTURES * piece.detail[0])]
    rim = (palette.black, palette.wood, palette.trim, palette.dark_wood, palette.warm_metal)[int(5 * piece.detail[1])]
    return [Part("", inner, face), Part("frame", frame(width, height, depth, edge), rim)]


def build_round_mirror(piece: Piece, palette: Palette) -> list[Part]:
    """A round mirror on the wall."""
    width, depth, height = piece.size_m
    radius = 0.5 * min(width, height)
    middle = (0.0, 0.0, 0.5 * height)
    glass = bar((0.0, 0.0, middle[2]), (0.0, 0.55 * depth, middle[2]), 0.97 * radius, 40)
    angles = np.linspace(0.0, 2 * np.pi, 49)
    ring = [
        (0.965 * radius * float(np.cos(a)), 0.5 * depth, middle[2] + 0.965 * radius * float(np.sin(a))) for a in angles
    ]
    rim = tube(ring, 0.035 * radius, 8)
    return [Part("", glass, palette.mirror), Part("frame", rim, palette.handle)]


def build_clock(piece: Piece, palette: Palette) -> list[Part]:
    """A round wall clock; its details settle the time."""
    width, depth, height = piece.size_m
    radius, z = 0.5 * width, 0.5 * height
    body = bar((0.0, 0.0, z), (0.0, 0.8 * depth, z), radius, 36)
    face = bar((0.0, 0.7 * depth, z), (0.0, 0.85 * depth, z), 0.88 * radius, 36)
    marks = []
    for hour in range(12):
        angle, long = 2 * np.pi * hour / 12, 0.14 if hour % 3 == 0 else 0.07
        inner, outer = (0.80 - long) * radius, 0.80 * radius
        x, h = float(np.sin(angle)), float(np.cos(angle))
        marks.append(bar((inner * x, 0.86 * depth, z + inner * h), (outer * x, 0.86 * depth, z + outer * h), 0.004, 6))
    for fraction, length, thick in ((piece.detail[0], 0.42, 0.006), ((12 * piece.detail[0]) % 1.0, 0.66, 0.0045)):
        x, h = float(np.sin(2 * np.pi * fraction)), float(np.cos(2 * np.pi * fraction))
        marks.append(bar((0.0, 0.9 * depth, z), (length * radius * x, 0.9 * depth, z + length * radius * h), thick, 6))
    rim = palette.black if piece.detail[1] < 0.5 else palette.wood
    return [Part("", body, rim), Part("face", face, palette.paper), Part("hands", join(marks), palette.black)]


def build_rug(piece: Piece, palette: Palette) -> list[Part]:
    """A flat rug."""
    half, depth, height = 0.5 * piece.size_m[0], piece.size_m[1], piece.size_m[2]
    if piece.size_m[0] == depth:
        return [Part("", post((0.0, half), half, 0.0, height, 48, 0.003), palette.rug)]
    return [Part("", block((-half, 0.0, 0.0), (half, depth, height), 0.004), palette.rug)]


def build_curtain(piece: Piece, palette: Palette) -> list[Part]:
    """A curtain beside a window."""
    width, depth, height = piece.size_m
    return [Part("", curtain(width, depth, height, max(3, round(width / 0.085)), piece.detail[0]), palette.curtain)]


def build_curtain_rod(piece: Piece, palette: Palette) -> list[Part]:
    """The rod that curtains hang from, with brackets, rings and knobs at its ends."""
    width, depth, height = piece.size_m
    half, y, z = 0.5 * width, 0.5 * depth, 0.5 * height
    parts = [bar((-half + 0.03, y, z), (half - 0.03, y, z), 0.011, 12)]
    for side in (-1.0, 1.0):
        x = side * (half - 0.09)
        parts += [bar((x, 0.0, z), (x, y, z), 0.008, 8), bar((x, 0.0, z), (x, 0.012, z), 0.02, 14)]
        path = [
            (side * (half - 0.045), y, z),
            (side * (half - 0.03), y, z),
            (side * (half - 0.015), y, z),
            (side * half, y, z),
        ]
        parts.append(
            tube(
                path if side > 0 else path[::-1],
                [0.012, 0.02, 0.02, 0.006] if side > 0 else [0.006, 0.02, 0.02, 0.012],
                12,
            )
        )
    return [Part("", join(parts), palette.handle)]


def build_radiator(piece: Piece, palette: Palette) -> list[Part]:
    """A ribbed radiator on the wall, with a pipe to the floor."""
    width, depth, height = piece.size_m
    half, low = 0.5 * width, 0.12
    ribs = max(4, round(width / 0.075))
    pitch = width / ribs
    one = block((-0.42 * pitch, 0.03, low + 0.03), (0.42 * pitch, depth, height - 0.03), 0.02, 2)
    parts = [moved(one, (-half + (k + 0.5) * pitch, 0.0, 0.0)) for k in range(ribs)]
    for z in (low + 0.08, height - 0.08):
        parts.append(bar((-half, 0.5 * depth, z), (half, 0.5 * depth, z), 0.022, 10))
    parts += [
        block((x - 0.02, 0.0, z), (x + 0.02, 0.5 * depth, z + 0.04), 0.004)
        for x in (-0.6 * half, 0.6 * half)
        for z in (low + 0.1, height - 0.14)
    ]
    x = half - 0.012
    pipe = tube([(x, 0.5 * depth, 0.0), (x, 0.5 * depth, low + 0.08)], 0.011, 10)
    knob = post((x, 0.5 * depth), 0.022, low - 0.03, low + 0.03, 14, 0.004)
    return [Part("", join(parts), palette.trim), Part("pipe", join([pipe, knob]), palette.metal)]


def build_tv(piece: Piece, palette: Palette) -> list[Part]:
    """A television on two feet, its screen towards +y."""
    width, depth, height = piece.size_m
    half, middle = 0.5 * width, 0.5 * depth
    body = block((-half, middle - 0.022, 0.06), (half, middle + 0.010, height), 0.006)
    bulge = block((-0.6 * half, middle - 0.06, 0.12), (0.6 * half, middle - 0.02, 0.6 * height), 0.015)
    screen = block((-half + 0.012, middle + 0.006, 0.078), (half - 0.012, middle + 0.0125, height - 0.012), 0.001)
    feet = []
    for side in (-1.0, 1.0):
        x = side * 0.65 * half
        for y in (0.012, depth - 0.012):
            feet.append(tube([(x, y, 0.008), (x, middle, 0.075)], 0.008, 8))
    dark = palette.black
    return [Part("", join([body, bulge]), dark), Part("screen", screen, dark), Part("feet", join(feet), dark)]


def build_umbrella_stand(piece: Piece, palette: Palette) -> list[Part]:
    """A tall jar with an umbrella."""
    radius, height = 0.5 * min(piece.size_m[:2]), piece.size_m[2]
    centre = (0.0, 0.5 * piece.size_m[1])
    jar_z = 0.62 * height
    jar = [(0.0, 0.0), (0.85 * radius, 0.0), (radius, 0.1 * jar_z), (radius, jar_z), (0.92 * radius, jar_z)]
    jar += [(0.90 * radius, 0.05 * jar_z), (0.0, 0.05 * jar_z)]
    cloth = lathe(
        [(0.0, 0.05), (0.015, 0.06), (0.045, 0.5 * height), (0.02, 0.8 * height), (0.0, 0.82 * height)], centre, 14
    )
    hook = [(0.0, 0.8), (0.0, 0.93), (0.02, 0.985), (0.05, 0.995), (0.065, 0.96)]
    grip = tube([(x, centre[1], z * height) for x, z in hook], 0.009, 8)
    return [
        Part("", lathe(jar, centre, 24), palette.ceramic if piece.detail[0] < 0.5 else palette.metal),
        Part("umbrella", cloth, palette.accents[int(5 * piece.detail[1])]),
        Part("grip", grip, palette.wood),
    ]
