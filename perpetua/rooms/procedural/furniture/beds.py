"""Beds, in each piece's own frame: the head is at y = 0."""

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.finish.palette import Palette
from perpetua.rooms.procedural.furniture.legs import leg_material, legs
from perpetua.rooms.procedural.furniture.parts import Part, block, moved, post, tilted
from perpetua.rooms.procedural.furniture.soft import blanket, cushion, pillow
from perpetua.rooms.procedural.layout.plan import Piece

BASE_M = 0.27
MATTRESS_M = 0.45
HEAD_M = 0.09


def build_bed(piece: Piece, palette: Palette) -> list[Part]:
    """A bed: frame, headboard, mattress, blanket with its edge turned back, pillows, and a throw at the foot."""
    width, depth, _ = piece.size_m
    half = 0.5 * width
    wood = palette.wood if piece.detail[3] < 0.6 else palette.dark_wood
    frame = block((-half + 0.01, 0.05, 0.14), (half - 0.01, depth, BASE_M), 0.02, 2)
    mattress = cushion(
        (-half + 0.04, HEAD_M + 0.005, BASE_M - 0.01), (half - 0.04, depth - 0.035, MATTRESS_M), 14.0, (16, 18, 5)
    )
    reach = 0.58 + 0.14 * piece.detail[0]
    cover = blanket((-half, reach, 0.21), (half, depth - 0.002, MATTRESS_M + 0.055), piece.detail[8:16])
    edge = cushion(
        (-half + 0.004, reach - 0.10, MATTRESS_M - 0.06),
        (half - 0.004, reach + 0.17, MATTRESS_M + 0.073),
        7.0,
        (14, 8, 5),
    )
    parts = [
        Part("", join([mattress]), palette.linen),
        Part("frame", frame, wood, "bed_frame"),
        Part("legs", legs(palette.style, width, depth, 0.15, 0.06, 0.06), leg_material(palette, wood), "bed_frame"),
        *_headboard(piece, palette),
        Part("blanket", cover, palette.blanket, "blanket"),
        Part("fold", edge, palette.linen, "blanket"),
    ]
    if piece.detail[5] < 0.55:
        low, high = (-half - 0.0, depth - 0.52, 0.24), (half + 0.0, depth - 0.12, MATTRESS_M + 0.066)
        throw = blanket(low, high, piece.detail[9:17])
        parts.append(Part("throw", throw, palette.second_upholstery, "blanket"))
    return parts + _pillows(piece, palette)


def _headboard(piece: Piece, palette: Palette) -> list[Part]:
    """Panels between posts, or buttoned cloth."""
    width, _, height = piece.size_m
    half = 0.5 * width
    wood = palette.wood if piece.detail[3] < 0.6 else palette.dark_wood
    if piece.detail[4] < 0.45:
        columns = max(3, round(width / 0.28))
        pitch = width / columns
        pads = [
            cushion((-half + k * pitch, 0.02, 0.28), (-half + (k + 1) * pitch, HEAD_M, height), 8.0, (5, 4, 8))
            for k in range(columns)
        ]
        board = block((-half + 0.005, 0.0, 0.0), (half - 0.005, 0.05, height - 0.01), 0.008)
        return [
            Part("headboard", board, palette.dark_wood, "bed_frame"),
            Part("headboard_cloth", join(pads), palette.upholstery, "bed_frame"),
        ]
    posts: list[TriMesh] = [post((x, 0.04), 0.032, 0.0, height, 16, 0.008) for x in (-half + 0.034, half - 0.034)]
    posts.append(block((-half + 0.05, 0.015, height - 0.14), (half - 0.05, 0.065, height - 0.03), 0.012, 2))
    posts.append(block((-half + 0.05, 0.02, 0.25), (half - 0.05, 0.06, 0.42), 0.008))
    if piece.detail[4] < 0.75:
        places = np.linspace(-half + 0.10, half - 0.10, max(5, round(width / 0.13)))
        posts += [block((float(x) - 0.014, 0.03, 0.41), (float(x) + 0.014, 0.05, height - 0.13), 0.004) for x in places]
    else:
        posts.append(block((-half + 0.05, 0.03, 0.41), (half - 0.05, 0.05, height - 0.13), 0.004))
    return [Part("headboard", join(posts), wood, "bed_frame")]


def _pillows(piece: Piece, palette: Palette) -> list[Part]:
    """Sleeping pillows against the head, and smaller ones before them on a wide bed."""
    width = piece.size_m[0]
    count = 2 if width > 1.2 else 1
    pitch = (width - 0.08) / count
    sleeping = []
    for index in range(count):
        x = (index - 0.5 * (count - 1)) * pitch
        upright = moved(pillow(min(0.68, pitch - 0.03), 0.44, 0.19), (x, HEAD_M + 0.14, MATTRESS_M + 0.21))
        sleeping.append(tilted(upright, 0.62, (HEAD_M + 0.30, MATTRESS_M)))
    parts = [Part("pillows", _settled(join(sleeping)), palette.linen, "pillow")]
    if piece.detail[6] < 0.6:
        small = tilted(
            moved(pillow(0.42, 0.36, 0.14), (0.0, HEAD_M + 0.47, MATTRESS_M + 0.17)), 0.50, (HEAD_M + 0.47, MATTRESS_M)
        )
        parts.append(Part("small_pillow", _settled(small), palette.second_upholstery, "pillow"))
    return parts


def _settled(mesh: TriMesh) -> TriMesh:
    """A soft object let down on the mattress, a little into it, and kept from the wall."""
    low = mesh.vertices_m.min(0)
    return moved(mesh, (0.0, max(0.0, HEAD_M - 0.01 - float(low[1])), MATTRESS_M - 0.018 - float(low[2])))
