"""Sofas, chairs and beds. A builder makes the parts of a piece in the piece's own frame."""

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.palette import Palette
from perpetua.rooms.procedural.parts import Part, block, post
from perpetua.rooms.procedural.plan import Piece


def legs(width_m: float, depth_m: float, height_m: float, thickness_m: float, inset_m: float = 0.03) -> TriMesh:
    """Four square legs under a rectangle whose back edge is y = 0."""
    meshes = []
    for x in (-0.5 * width_m + inset_m, 0.5 * width_m - inset_m - thickness_m):
        for y in (inset_m, depth_m - inset_m - thickness_m):
            meshes.append(block((x, y, 0.0), (x + thickness_m, y + thickness_m, height_m)))
    return join(meshes)


def build_sofa(piece: Piece, palette: Palette) -> list[Part]:
    """A sofa or armchair: frame on legs, one seat and one back cushion per place, arm rests, throw pillows."""
    width, depth, height = piece.size_m
    arm = 0.14 + 0.08 * piece.detail[0]
    arm_height = 0.52 + 0.10 * piece.detail[1]
    places = max(1, round((width - 2 * arm) / 0.7))
    half, seat_z = 0.5 * width, 0.28
    frame = [
        block((-half, 0.0, 0.10), (half, 0.18, height), 0.04, 3),
        block((-half + 0.01, 0.02, 0.10), (half - 0.01, depth - 0.02, seat_z), 0.02, 2),
        block((-half, 0.02, 0.10), (-half + arm, depth, arm_height), 0.05, 3),
        block((half - arm, 0.02, 0.10), (half, depth, arm_height), 0.05, 3),
    ]
    cushions, pitch = [], (width - 2 * arm) / places
    for place in range(places):
        x0 = -half + arm + place * pitch + 0.005
        x1 = x0 + pitch - 0.01
        cushions.append(block((x0, 0.19, seat_z), (x1, depth - 0.01, seat_z + 0.16), 0.05, 3))
        cushions.append(block((x0, 0.17, seat_z + 0.15), (x1, 0.34, height - 0.02), 0.06, 3))
    pillow_x = half - arm - 0.42
    pillow = block((pillow_x, 0.34, seat_z + 0.16), (pillow_x + 0.40, 0.48, seat_z + 0.52), 0.065, 3)
    feet = legs(width, depth, 0.11, 0.05, 0.06)
    return [
        Part("", join(frame), palette.upholstery),
        Part("cushions", join(cushions), palette.upholstery),
        Part("pillow", pillow, palette.accents[int(5 * piece.detail[2])]),
        Part("legs", feet, palette.dark_wood),
    ]


def build_chair(piece: Piece, palette: Palette) -> list[Part]:
    """A chair with a slatted or a solid back; the sitter looks along +y."""
    width, depth, height = piece.size_m
    half, seat_z, leg = 0.5 * width, 0.46, 0.035
    wood = [legs(width, depth, seat_z - 0.03, leg, 0.005), _seat_plate(half, depth, seat_z)]
    for x in (-half + 0.005, half - 0.005 - leg):
        wood.append(block((x, 0.005, seat_z), (x + leg, 0.005 + leg, height)))
    if piece.detail[0] < 0.5:
        wood.append(block((-half + leg, 0.012, height - 0.32), (half - leg, 0.03, height - 0.02), 0.008, 2))
    else:
        for slat in range(3):
            z = seat_z + 0.12 + slat * 0.3 * (height - seat_z - 0.1)
            wood.append(block((-half + leg, 0.012, z), (half - leg, 0.03, z + 0.055), 0.006))
    cushion = block((-half + 0.02, 0.05, seat_z), (half - 0.02, depth - 0.01, seat_z + 0.045), 0.02, 3)
    frame = palette.wood if piece.detail[1] < 0.6 else palette.dark_wood
    return [Part("", join(wood), frame), Part("cushion", cushion, palette.upholstery)]


def _seat_plate(half: float, depth: float, seat_z: float) -> TriMesh:
    return block((-half, 0.0, seat_z - 0.03), (half, depth, seat_z), 0.01, 2)


def build_stool(piece: Piece, palette: Palette) -> list[Part]:
    """A round stool on one foot or a soft pouf."""
    radius, height = 0.5 * min(piece.size_m[:2]), piece.size_m[2]
    centre = (0.0, 0.5 * piece.size_m[1])
    if piece.detail[0] < 0.5:
        half, depth = 0.5 * piece.size_m[0], piece.size_m[1]
        return [Part("", block((-half, 0.0, 0.0), (half, depth, height), 0.09, 4), palette.rug)]
    base = join([post(centre, 0.8 * radius, 0.0, 0.025), post(centre, 0.03, 0.025, height - 0.06)])
    seat = post(centre, radius, height - 0.06, height, 24)
    return [Part("", seat, palette.upholstery), Part("foot", base, palette.metal)]


def build_bed(piece: Piece, palette: Palette) -> list[Part]:
    """A bed, its head at the wall: frame, headboard, mattress, blanket and pillows."""
    width, depth, height = piece.size_m
    half = 0.5 * width
    frame = [
        legs(width, depth, 0.14, 0.07, 0.05),
        block((-half, 0.05, 0.13), (half, depth, 0.30), 0.015),
        block((-half, 0.0, 0.0), (half, 0.06, height), 0.02, 2),
    ]
    mattress = block((-half + 0.03, 0.07, 0.30), (half - 0.03, depth - 0.03, 0.50), 0.05, 3)
    reach = 0.62 + 0.2 * piece.detail[0]
    blanket = block((-half + 0.01, reach, 0.32), (half - 0.01, depth - 0.005, 0.55), 0.05, 3)
    fold = block((-half + 0.012, reach - 0.22, 0.40), (half - 0.012, reach + 0.04, 0.57), 0.04, 3)
    pillows = []
    count = 2 if width > 1.3 else 1
    for index in range(count):
        centre = (index - 0.5 * (count - 1)) * 0.48 * width
        pillows.append(block((centre - 0.31, 0.09, 0.49), (centre + 0.31, 0.50, 0.63), 0.065, 4))
    cover = palette.accents[int(5 * piece.detail[1])] if piece.detail[2] < 0.4 else palette.upholstery
    return [
        Part("", join(frame), palette.wood if piece.detail[3] < 0.6 else palette.dark_wood),
        Part("mattress", mattress, palette.linen),
        Part("blanket", blanket, cover),
        Part("fold", fold, palette.linen),
        Part("pillows", join(pillows), palette.linen),
    ]
