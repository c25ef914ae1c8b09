"""Lamps, plants, pictures, cloth and small things, in each piece's own frame."""

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.palette import Palette
from perpetua.rooms.procedural.parts import Part, bar, block, folds, hull, lathe, post
from perpetua.rooms.procedural.plan import Piece

Profile = list[tuple[float, float]]


def build_lamp(piece: Piece, palette: Palette) -> list[Part]:
    """A table or floor lamp: foot, stem and a glowing shade."""
    width, depth, height = piece.size_m
    radius, centre = 0.5 * width, (0.0, 0.5 * depth)
    shade_height = min(0.28, 0.5 * height)
    base = height - shade_height
    if height > 0.9:
        stand = [post(centre, 0.7 * radius, 0.0, 0.025, 24), post(centre, 0.012, 0.02, base + 0.1)]
    else:
        belly: Profile = [(0.0, 0.0), (0.5 * radius, 0.0), (0.62 * radius, 0.35 * base), (0.25 * radius, 0.8 * base)]
        stand = [
            lathe([*belly, (0.1 * radius, base), (0.0, base)], centre),
            post(centre, 0.008, base - 0.01, base + 0.1),
        ]
    shade = lathe(
        [(0.0, base), (radius, base), ((0.6 + 0.3 * piece.detail[0]) * radius, height), (0.0, height)], centre, 28
    )
    material = palette.metal if piece.detail[1] < 0.5 else palette.accents[int(5 * piece.detail[2])]
    return [Part("", join(stand), material), Part("shade", shade, palette.lamp_shade)]


def build_ceiling_lamp(piece: Piece, palette: Palette) -> list[Part]:
    """A flat dish under the ceiling; the piece's top is the ceiling."""
    radius, height = 0.5 * piece.size_m[0], piece.size_m[2]
    centre = (0.0, 0.5 * piece.size_m[1])
    dish = lathe(
        [(0.0, 0.0), (0.7 * radius, 0.01), (radius, 0.05), (radius, height - 0.02), (0.0, height - 0.02)], centre, 32
    )
    return [
        Part("", dish, palette.lamp_shade),
        Part("mount", post(centre, 0.8 * radius, height - 0.02, height, 24), palette.metal),
    ]


def build_pendant(piece: Piece, palette: Palette) -> list[Part]:
    """A lamp on a cord from the ceiling; the piece's top is the ceiling."""
    radius, height = 0.5 * piece.size_m[0], piece.size_m[2]
    centre = (0.0, 0.5 * piece.size_m[1])
    shade: Profile = [(0.0, 0.0), (0.9 * radius, 0.0), (radius, 0.02), (0.45 * radius, 0.20), (0.1, 0.24), (0.0, 0.24)]
    cord = [post(centre, 0.006, 0.23, height - 0.02, 8), post(centre, 0.05, height - 0.02, height)]
    return [Part("", lathe(shade, centre, 30), palette.lamp_shade), Part("cord", join(cord), palette.black)]


def build_plant(piece: Piece, palette: Palette) -> list[Part]:
    """A pot with leaves that arch outwards from the middle."""
    width, depth, height = piece.size_m
    reach, centre = 0.5 * min(width, depth), np.array([0.0, 0.5 * depth])
    pot_height = min(0.32, 0.34 * height)
    pot_radius = min(0.6 * reach, 0.17)
    pot: Profile = [(0.0, 0.0), (0.72 * pot_radius, 0.0), (pot_radius, pot_height), (0.9 * pot_radius, pot_height)]
    pot += [(0.88 * pot_radius, pot_height - 0.02), (0.0, pot_height - 0.02)]
    soil_z = pot_height - 0.025
    leaves = [
        _leaf(centre, soil_z, height, reach, 2.4 * index, piece.detail[index % len(piece.detail)])
        for index in range(14)
    ]
    place = (float(centre[0]), float(centre[1]))
    soil = post(place, 0.86 * pot_radius, soil_z, pot_height - 0.005)
    return [
        Part("", lathe(pot, place, 24), palette.accents[int(5 * piece.detail[0])]),
        Part("soil", soil, palette.soil),
        Part("leaves", join([mesh for leaf in leaves for mesh in leaf]), palette.leaf),
    ]


def _leaf(
    centre: np.ndarray, soil_z: float, height: float, reach: float, angle: float, detail: float
) -> tuple[TriMesh, TriMesh]:
    """A stalk from the soil and a flat pointed blade at its end."""
    outward = np.array([np.cos(angle), np.sin(angle)])
    side = np.array([-outward[1], outward[0]])
    rise = (0.45 + 0.5 * detail) * (height - soil_z)
    joint = np.append(centre + (0.25 + 0.25 * (1 - detail)) * reach * outward, soil_z + 0.6 * rise)
    tip = np.append(centre + (0.7 + 0.28 * (1 - detail)) * reach * outward, soil_z + rise)
    middle = 0.5 * (joint + tip) + np.array([0.0, 0.0, 0.08 * height])
    half = 0.13 * reach + 0.02
    edge = np.append(half * side, 0.0)
    thick = np.array([0.0, 0.0, 0.004])
    blade = np.stack([joint, joint + thick, middle - edge, middle + edge, middle + 2 * thick, tip, tip + thick])
    root = np.append(centre + 0.02 * outward, soil_z)
    stalk = bar((root[0], root[1], root[2]), (joint[0], joint[1], joint[2] + 0.002), 0.006, 6)
    return stalk, hull(blade)


def build_picture(piece: Piece, palette: Palette) -> list[Part]:
    """A framed picture or, by its category, a mirror."""
    width, depth, height = piece.size_m
    half, edge = 0.5 * width, 0.03
    frame = [
        block((-half, 0.0, 0.0), (half, depth, edge)),
        block((-half, 0.0, height - edge), (half, depth, height)),
        block((-half, 0.0, edge), (-half + edge, depth, height - edge)),
        block((half - edge, 0.0, edge), (half, depth, height - edge)),
    ]
    inner = block((-half + edge, 0.0, edge), (half - edge, 0.6 * depth, height - edge), 0.001)
    face = palette.mirror if piece.category == "mirror" else palette.pictures[int(4 * piece.detail[0])]
    rim = palette.black if piece.detail[1] < 0.5 else palette.wood
    return [Part("", inner, face), Part("frame", join(frame), rim)]


def build_rug(piece: Piece, palette: Palette) -> list[Part]:
    """A flat rug."""
    half, depth, height = 0.5 * piece.size_m[0], piece.size_m[1], piece.size_m[2]
    return [Part("", block((-half, 0.0, 0.0), (half, depth, height), 0.004), palette.rug)]


def build_curtain(piece: Piece, palette: Palette) -> list[Part]:
    """A curtain beside a window."""
    width, depth, height = piece.size_m
    return [Part("", folds(width, depth, 0.0, height, max(2, round(width / 0.09))), palette.curtain)]


def build_curtain_rod(piece: Piece, palette: Palette) -> list[Part]:
    """The rod that curtains hang from, with its brackets."""
    width, depth, height = piece.size_m
    half, y, z = 0.5 * width, 0.5 * depth, 0.5 * height
    rod = [bar((-half, y, z), (half, y, z), 0.012)]
    rod += [block((x - 0.01, 0.0, z - 0.01), (x + 0.01, y, z + 0.01)) for x in (-half + 0.03, half - 0.03)]
    return [Part("", join(rod), palette.black)]


def build_vase(piece: Piece, palette: Palette) -> list[Part]:
    """A vase."""
    radius, height = 0.5 * piece.size_m[0], piece.size_m[2]
    waist = 0.4 + 0.4 * piece.detail[0]
    outline: Profile = [(0.0, 0.0), (0.6 * radius, 0.0), (radius, 0.4 * height), (waist * radius, 0.8 * height)]
    outline += [(0.7 * radius, height), (0.6 * radius, height), (0.0, 0.9 * height)]
    return [Part("", lathe(outline, (0.0, 0.5 * piece.size_m[1]), 24), palette.accents[int(5 * piece.detail[1])])]


def build_bowl(piece: Piece, palette: Palette) -> list[Part]:
    """A bowl."""
    radius, height = 0.5 * piece.size_m[0], piece.size_m[2]
    outline: Profile = [(0.0, 0.0), (0.45 * radius, 0.0), (0.85 * radius, 0.5 * height), (radius, height)]
    outline += [(0.94 * radius, height), (0.5 * radius, 0.25 * height), (0.0, 0.2 * height)]
    return [Part("", lathe(outline, (0.0, 0.5 * piece.size_m[1]), 24), palette.accents[int(5 * piece.detail[1])])]


def build_cup(piece: Piece, palette: Palette) -> list[Part]:
    """A cup with a handle."""
    width, depth, height = piece.size_m
    radius, y = 0.38 * width, 0.5 * depth
    body: Profile = [(0.0, 0.0), (0.8 * radius, 0.0), (radius, height), (0.88 * radius, height)]
    body += [(0.7 * radius, 0.15 * height), (0.0, 0.12 * height)]
    grip_x = 0.5 * width - 0.006
    grip = [
        block((0.8 * radius, y - 0.005, 0.70 * height), (grip_x, y + 0.005, 0.82 * height), 0.002),
        block((0.75 * radius, y - 0.005, 0.25 * height), (grip_x, y + 0.005, 0.37 * height), 0.002),
        block((grip_x - 0.01, y - 0.005, 0.25 * height), (grip_x, y + 0.005, 0.82 * height), 0.002),
    ]
    return [Part("", join([lathe(body, (0.0, y), 20), *grip]), palette.accents[int(5 * piece.detail[0])])]


def build_books(piece: Piece, palette: Palette) -> list[Part]:
    """Books lying on each other."""
    width, depth, height = piece.size_m
    parts, count = [], 3
    for index in range(count):
        shrink = 1.0 - 0.25 * piece.detail[index]
        half, deep = 0.5 * width * shrink, depth * shrink
        low, high = height * index / count, height * (index + 1) / count
        book = block((-half, 0.5 * (depth - deep), low), (half, 0.5 * (depth + deep), high), 0.004)
        parts.append(
            Part("" if index == 0 else f"{index}", book, palette.accents[(index + int(5 * piece.detail[3])) % 5])
        )
    return parts
