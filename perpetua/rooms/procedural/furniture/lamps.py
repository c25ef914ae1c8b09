"""Lamps, in each piece's own frame."""

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.finish.palette import Palette
from perpetua.rooms.procedural.furniture.parts import Part, Profile, bar, curve, lathe, post, tube
from perpetua.rooms.procedural.layout.plan import Piece


def _open_shade(low: float, high: float, foot: float, top: float, centre: tuple[float, float]) -> TriMesh:
    """A shade that is open below and above, with a spider that holds it in its middle."""
    thick = 0.004
    outside: Profile = [(foot, low), (top, high), (top - thick, high), (foot - thick, low)]
    rings = []
    angles = np.linspace(0.0, 2 * np.pi, 28, endpoint=False)
    for radius, z in outside:
        circle = np.column_stack([centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles)])
        rings.append(np.column_stack([circle, np.full(len(angles), z)]))
    count, sides = len(rings), len(angles)
    here, there = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = []
    for ring in range(count):
        one, two = ring * sides, (ring + 1) % count * sides
        faces += [
            np.stack([one + here, one + there, two + there], 1),
            np.stack([one + here, two + there, two + here], 1),
        ]
    return TriMesh(np.concatenate(rings), np.concatenate(faces).astype(np.int32))


def build_lamp(piece: Piece, palette: Palette) -> list[Part]:
    """A table or floor lamp: foot, stem and a shade, open below and above."""
    width, depth, height = piece.size_m
    radius, centre = 0.5 * width, (0.0, 0.5 * depth)
    tall = height > 0.9
    shade_m = 0.27 if tall else 0.45 * height
    base = height - shade_m
    top = (0.55 + 0.4 * piece.detail[0]) * radius
    body = palette.handle if piece.detail[1] < 0.45 else palette.accents[int(5 * piece.detail[2])]
    stand = _floor_stand(piece, centre, base, radius) if tall else [_belly(piece, centre, base, radius)]
    bulb_z = base + 0.45 * shade_m
    stem = [post(centre, 0.009, (0.02 if tall else base - 0.02), bulb_z - 0.03, 10)]
    spider = [
        bar((0.0, centre[1], bulb_z - 0.035), (0.93 * x, centre[1] + 0.93 * y, bulb_z - 0.035), 0.003, 6)
        for x, y in _spokes(radius + (top - radius) * 0.45 * 0.87)
    ]
    bulb = lathe(
        [
            (0.0, bulb_z - 0.04),
            *curve([(0.015, bulb_z - 0.04), (0.033, bulb_z + 0.01), (0.012, bulb_z + 0.05)], 8),
            (0.0, bulb_z + 0.052),
        ],
        centre,
        14,
    )
    return [
        Part("", join([*stand, *stem, *spider]), body),
        Part("shade", _open_shade(base, height, radius, top, centre), palette.lamp_shade),
        Part("bulb", bulb, palette.lamp_shade),
    ]


def _spokes(radius: float) -> list[tuple[float, float]]:
    return [(radius * float(np.cos(a)) / 0.93, radius * float(np.sin(a)) / 0.93) for a in np.arange(3) * 2 * np.pi / 3]


def _belly(piece: Piece, centre: tuple[float, float], base: float, radius: float) -> TriMesh:
    shapes: tuple[Profile, ...] = (
        [(0.50, 0.0), (0.72, 0.3), (0.62, 0.55), (0.20, 0.85), (0.13, 1.0)],
        [(0.60, 0.0), (0.16, 0.12), (0.30, 0.35), (0.14, 0.6), (0.24, 0.8), (0.12, 1.0)],
        [(0.35, 0.0), (0.66, 0.45), (0.35, 0.9), (0.13, 1.0)],
    )
    shape = shapes[int(3 * piece.detail[3])]
    outline = curve([(radius * r, base * z) for r, z in shape], 18)
    return lathe([(0.0, 0.0), *outline, (0.0, base)], centre, 22)


def _floor_stand(piece: Piece, centre: tuple[float, float], base: float, radius: float) -> list[TriMesh]:
    if piece.detail[3] < 0.5:
        return [
            lathe(
                [(0.0, 0.0), (0.68 * radius, 0.0), (0.66 * radius, 0.015), (0.1 * radius, 0.03), (0.0, 0.03)],
                centre,
                28,
            )
        ]
    joint_z = 0.9 * base
    feet = [
        tube([(0.86 * x, centre[1] + 0.86 * y, 0.006), (0.06 * x, centre[1] + 0.06 * y, joint_z)], [0.011, 0.015], 10)
        for x, y in _spokes(radius)
    ]
    return [*feet, post(centre, 0.03, joint_z - 0.03, joint_z + 0.02, 14, 0.005)]


def build_ceiling_lamp(piece: Piece, palette: Palette) -> list[Part]:
    """A dish under the ceiling; the piece's top is the ceiling."""
    radius, height = 0.5 * piece.size_m[0], piece.size_m[2]
    centre = (0.0, 0.5 * piece.size_m[1])
    glow = [(0.55 * radius, 0.006), (0.85 * radius, 0.03), (0.96 * radius, 0.06), (0.97 * radius, height - 0.03)]
    dish = lathe([(0.0, 0.0), *glow, (0.0, height - 0.03)], centre, 32)
    rim = lathe(
        [
            (0.0, height - 0.04),
            (radius, height - 0.04),
            (radius, height - 0.012),
            (0.8 * radius, height),
            (0.0, height),
        ],
        centre,
        32,
    )
    return [Part("", dish, palette.lamp_shade), Part("mount", rim, palette.handle)]


def build_pendant(piece: Piece, palette: Palette) -> list[Part]:
    """A lamp on a cord from the ceiling; the piece's top is the ceiling."""
    radius, height = 0.5 * piece.size_m[0], piece.size_m[2]
    centre = (0.0, 0.5 * piece.size_m[1])
    tall = 0.26
    cord = [post(centre, 0.005, tall - 0.01, height - 0.02, 8), post(centre, 0.05, height - 0.025, height, 20, 0.006)]
    cap = lathe(
        [(0.0, tall - 0.03), (0.12 * radius, tall - 0.03), (0.10 * radius, tall + 0.03), (0.0, tall + 0.03)], centre, 16
    )
    if piece.detail[0] < 0.5:
        outline = curve(
            [
                (0.3 * radius, 0.0),
                (0.82 * radius, 0.03),
                (radius, 0.13),
                (0.75 * radius, 0.22),
                (0.1 * radius, tall - 0.01),
            ],
            16,
        )
        shade = lathe([(0.0, 0.0), *outline, (0.0, tall - 0.01)], centre, 30)
        return [Part("", shade, palette.lamp_shade), Part("cord", join([*cord, cap]), palette.black)]
    outside = curve([(radius, 0.02), (0.9 * radius, 0.10), (0.4 * radius, 0.20), (0.1 * radius, tall)], 12)
    inside = [(0.94 * radius, 0.025), (0.84 * radius, 0.10), (0.3 * radius, 0.19)]
    bell = lathe([(0.0, 0.185), *inside[::-1], *outside, (0.0, tall)], centre, 30)
    bulb = lathe([(0.0, 0.06), *curve([(0.02, 0.06), (0.045, 0.10), (0.02, 0.185)], 7), (0.0, 0.19)], centre, 16)
    shell = palette.accents[int(5 * piece.detail[1])] if piece.detail[2] < 0.6 else palette.black
    return [
        Part("", bell, shell),
        Part("bulb", bulb, palette.lamp_shade),
        Part("cord", join([*cord, cap]), palette.black),
    ]
