"""Sofas, chairs, stools and benches. A builder makes the parts of a piece in the piece's own frame."""

import numpy as np
from scipy.interpolate import PchipInterpolator

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.finish.palette import Palette, cloth_of
from perpetua.rooms.procedural.furniture.legs import leg_material, legs
from perpetua.rooms.procedural.furniture.parts import Part, bar, block, curve, lathe, loft, moved, post, tilted, tube
from perpetua.rooms.procedural.furniture.soft import cushion, pillow
from perpetua.rooms.procedural.layout.plan import Piece
from perpetua.scene.room import Material

SEAT_M = 0.44
SEAT_SIDE_M = 0.72
FOOT_M, FOOT_INSET_M = 0.05, 0.05


def build_sofa(piece: Piece, palette: Palette) -> list[Part]:
    """A sofa or armchair: frame on feet, one seat and one back cushion per place, arm rests, throw pillows."""
    width, depth, height = piece.size_m
    arm, foot = 0.13 + 0.09 * piece.detail[0], 0.09 + 0.05 * piece.detail[3]
    places = max(1, round((width - 2 * arm) / SEAT_SIDE_M))
    half = 0.5 * width
    # Dowels run down inside the feet, so that the frame stands on the floor through them.
    seat = [_sofa_frame(piece, arm, foot), _dowels(width, depth, foot)]
    pitch = (width - 2 * arm) / places
    for place in range(places):
        x0 = -half + arm + place * pitch + 0.004
        x1 = x0 + pitch - 0.008
        seat.append(cushion((x0, 0.20, SEAT_M - 0.17), (x1, depth, SEAT_M + 0.006), 6.0, (8, 8, 6)))
        back = cushion((x0, 0.15, SEAT_M - 0.02), (x1, 0.34, height - 0.01), 4.0, (8, 6, 8))
        seat.append(tilted(back, 0.10, (0.18, SEAT_M)))
    cloth = palette.upholstery if piece.category == "sofa" else palette.second_upholstery
    parts = [
        Part("", join(seat), cloth),
        Part(
            "feet",
            legs(palette.style, width, depth, foot + 0.005, FOOT_M, FOOT_INSET_M),
            leg_material(palette, palette.dark_wood),
        ),
    ]
    throws = places > 1 or piece.detail[4] < 0.5
    return parts + (_throw_pillows(piece, arm, places, palette) if throws else [])


def _dowels(width: float, depth: float, foot: float) -> TriMesh:
    x, off = 0.5 * width - FOOT_INSET_M - 0.5 * FOOT_M, FOOT_INSET_M + 0.5 * FOOT_M
    places = [(side * x, y) for side in (-1.0, 1.0) for y in (off, depth - off)]
    return join([post(place, 0.006, 0.004, foot + 0.01, 6) for place in places])


def _sofa_frame(piece: Piece, arm_m: float, foot_m: float) -> TriMesh:
    """Base, back and arms; the arms are slabs or rolls."""
    width, depth, height = piece.size_m
    half, arm_z = 0.5 * width, 0.56 + 0.08 * piece.detail[1]
    base = block((-half + 0.012, 0.03, foot_m), (half - 0.012, depth - 0.012, SEAT_M - 0.14), 0.02, 2)
    back = block((-half + 0.02, 0.0, foot_m), (half - 0.02, 0.19, height - 0.04), 0.045, 3)
    parts = [base, back]
    for side in (-1.0, 1.0):
        x0, x1 = sorted((side * half, side * (half - arm_m)))
        if piece.detail[2] < 0.55:
            parts.append(block((x0, 0.01, foot_m), (x1, depth - 0.004, arm_z), 0.04, 3))
        else:
            radius = 0.5 * arm_m
            parts.append(block((x0 + 0.015, 0.01, foot_m), (x1 - 0.015, depth - 0.02, arm_z - radius), 0.015))
            middle = 0.5 * (x0 + x1)
            roll = bar((middle, 0.01, arm_z - radius), (middle, depth - 0.004, arm_z - radius), radius, 20)
            parts.append(roll)
    return join(parts)


def _throw_pillows(piece: Piece, arm_m: float, places: int, palette: Palette) -> list[Part]:
    """A pillow in the corners, leaning against the back."""
    half, parts = 0.5 * piece.size_m[0], []
    sides = (-1.0, 1.0) if places > 1 and piece.detail[5] < 0.7 else (1.0,)
    for index, side in enumerate(sides if places > 1 else (0.0,)):
        size = 0.38 + 0.08 * piece.detail[6 + index]
        upright = moved(pillow(size, size, 0.15), (side * (half - arm_m - 0.28), 0.40, SEAT_M + 0.5 * size - 0.012))
        lean = tilted(upright, 0.30, (0.40, SEAT_M))
        material = _pick((*palette.accents, palette.second_upholstery, palette.linen), piece.detail[8 + index])
        parts.append(Part(f"pillow_{index}", lean, cloth_of(material), "pillow"))
    return parts


def _pick(choices: tuple[Material, ...], fraction: float) -> Material:
    return choices[int(len(choices) * fraction)]


def build_chair(piece: Piece, palette: Palette) -> list[Part]:
    """A chair whose sitter looks along +y; its manner goes by the details that chairs of one set share."""
    manner = int(4 * piece.detail[0])
    frame = palette.wood if piece.detail[1] < 0.6 else palette.dark_wood
    if manner == 3:
        return _shell_chair(piece, palette, frame)
    width, depth, height = piece.size_m
    half, seat_z = 0.5 * width, SEAT_M if manner == 1 else SEAT_M - 0.03
    wood = [
        legs(palette.style, width, depth, seat_z - 0.02, 0.042, 0.012),
        block((-half, 0.0, seat_z - 0.035), (half, depth, seat_z), 0.012, 2),
    ]
    wood += _back_posts(half, seat_z, height)
    if manner == 0:
        levels = np.linspace(seat_z + 0.16, height - 0.09, 3)
        wood += [_slat(half - 0.03, float(z), 0.055) for z in levels]
    elif manner == 1:
        wood.append(_slat(half - 0.03, height - 0.10, 0.09))
        wood += [_spindle(x, seat_z, height - 0.06) for x in np.linspace(-half + 0.08, half - 0.08, 5)]
    else:
        panel = cushion((-half + 0.03, 0.0, seat_z + 0.14), (half - 0.03, 0.062, height - 0.01), 6.0, (6, 4, 6))
        wood.append(_slat(half - 0.03, height - 0.08, 0.05))
        back = Part("back", panel, palette.second_upholstery)
        return [Part("", join(wood), frame), back, _seat_pad(half, depth, seat_z, palette)]
    pads = [] if manner == 1 else [_seat_pad(half, depth, seat_z, palette)]
    return [Part("", join(wood), frame), *pads]


def _back_posts(half: float, seat_z: float, height: float) -> list[TriMesh]:
    posts = []
    for x in (-half + 0.033, half - 0.033):
        path = [(x, 0.040, seat_z - 0.02), (x, 0.036, seat_z + 0.1), (x, 0.018, height)]
        posts.append(tube([path[0], path[1], path[2]], [0.019, 0.018, 0.013], 10))
    return posts


def _slat(reach: float, z: float, tall: float) -> TriMesh:
    """A board across the back, bent backwards in its middle."""
    x = np.linspace(-reach, reach, 9)
    y = 0.012 + 0.016 * (x / reach) ** 2
    ring = np.array([(0.0, -0.5), (1.0, -0.5), (1.0, 0.5), (0.0, 0.5)])
    rings = np.stack(
        [
            np.column_stack([np.full(4, at), back + 0.014 * ring[:, 0], z + tall * ring[:, 1]])
            for at, back in zip(x, y, strict=True)
        ]
    )
    return loft(rings)


def _spindle(x: float, low_z: float, high_z: float) -> TriMesh:
    return tube(
        [(x, 0.03, low_z - 0.01), (x, 0.026, 0.5 * (low_z + high_z)), (x, 0.02, high_z)], [0.006, 0.01, 0.006], 8
    )


def _seat_pad(half: float, depth: float, seat_z: float, palette: Palette) -> Part:
    pad = cushion((-half + 0.015, 0.04, seat_z - 0.004), (half - 0.015, depth - 0.004, seat_z + 0.045), 5.0, (7, 7, 4))
    return Part("cushion", pad, palette.second_upholstery)


def _shell_chair(piece: Piece, palette: Palette, wood: Material) -> list[Part]:
    """A moulded seat on splayed legs."""
    width, depth, height = piece.size_m
    half = 0.5 * width
    profile = [(depth - 0.035, SEAT_M - 0.035), (depth - 0.07, SEAT_M - 0.012), (0.6 * depth, SEAT_M - 0.03)]
    profile += [
        (0.28 * depth, SEAT_M - 0.03),
        (0.13 * depth, SEAT_M + 0.03),
        (0.07 * depth, SEAT_M + 0.16),
        (0.0, height),
    ]
    widths = [0.84, 0.97, 1.0, 0.98, 0.96, 0.95, 0.72]
    shell = _shell(profile, [half * fraction for fraction in widths])
    x, stand = 0.72 * half, []
    for side in (-1.0, 1.0):
        for y0, y1 in ((0.30 * depth, 0.06 * depth), (0.68 * depth, depth - 0.03)):
            stand.append(
                tube([(side * (half - 0.016), y1, 0.005), (side * 0.5 * x, y0, SEAT_M - 0.045)], [0.011, 0.017], 10)
            )
    color = palette.accents[int(5 * piece.detail[2])]
    return [Part("", shell, color), Part("legs", join(stand), wood)]


def _shell(profile: list[tuple[float, float]], half_widths: list[float]) -> TriMesh:
    """A thick curved sheet along a profile of (y, z), its sides curling up."""
    knots = np.arange(len(profile))
    fine = np.linspace(0, len(profile) - 1, 19)
    y, z, half = (PchipInterpolator(knots, values)(fine) for values in (*np.array(profile).T, np.array(half_widths)))
    tangent = np.stack([np.gradient(y), np.gradient(z)], axis=1)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    u = np.linspace(-1.0, 1.0, 9)
    rings = []
    for k in range(len(fine)):
        lift = 0.035 * np.abs(u) ** 3
        upper = np.column_stack([half[k] * u, y[k] + lift * normal[k, 0], z[k] + lift * normal[k, 1]])
        lower = upper - 0.012 * np.array([0.0, normal[k, 0], normal[k, 1]])
        rings.append(np.concatenate([lower, upper[::-1]]))
    return loft(np.stack(rings))


def build_stool(piece: Piece, palette: Palette) -> list[Part]:
    """A pouf, or a round stool on legs."""
    width, depth, height = piece.size_m
    radius, centre = 0.5 * min(width, depth), (0.0, 0.5 * depth)
    if piece.detail[0] < 0.4:
        outline = curve(
            [
                (0.86 * radius, 0.0),
                (0.99 * radius, 0.22 * height),
                (radius, 0.6 * height),
                (0.94 * radius, 0.9 * height),
            ],
            9,
        )
        top = [(0.82 * radius, 0.975 * height), (0.5 * radius, height)]
        return [Part("", lathe([(0.0, 0.0), *outline, *top, (0.0, height)], centre, 28), palette.second_upholstery)]
    wood = palette.wood if piece.detail[1] < 0.5 else palette.dark_wood
    seat = post(centre, radius, height - 0.045, height, 28, 0.012)
    stand = []
    for quarter in range(4):
        x, y = np.cos(0.5 * np.pi * quarter + 0.785), np.sin(0.5 * np.pi * quarter + 0.785)
        foot = (0.9 * radius * x, centre[1] + 0.9 * radius * y, 0.006)
        stand.append(
            tube([foot, (0.62 * radius * x, centre[1] + 0.62 * radius * y, height - 0.04)], [0.012, 0.017], 10)
        )
    ring = [
        (0.80 * radius * np.cos(a), centre[1] + 0.80 * radius * np.sin(a), 0.3 * height)
        for a in np.linspace(0, 2 * np.pi, 17)
    ]
    stand.append(tube(ring, 0.007, 6))
    return [Part("", seat, wood), Part("legs", join(stand), leg_material(palette, wood))]


def build_bench(piece: Piece, palette: Palette) -> list[Part]:
    """A bench with a padded seat."""
    width, depth, height = piece.size_m
    half, seat_z = 0.5 * width, height - 0.07
    wood = palette.wood if piece.detail[0] < 0.5 else palette.dark_wood
    frame = [
        legs(palette.style, width, depth, seat_z - 0.02, 0.05, 0.03),
        block((-half, 0.0, seat_z - 0.04), (half, depth, seat_z), 0.008, 2),
    ]
    places = max(1, round(width / 0.6))
    pitch = width / places
    pads = [
        cushion(
            (-half + k * pitch + 0.006, 0.01, seat_z - 0.005),
            (-half + (k + 1) * pitch - 0.006, depth - 0.01, height),
            6.0,
        )
        for k in range(places)
    ]
    return [Part("", join(pads), palette.upholstery), Part("frame", join(frame), wood)]
