"""Small objects that stand on furniture, in each piece's own frame."""

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.finish.palette import PICTURES, Palette
from perpetua.rooms.procedural.furniture.decoration import frame
from perpetua.rooms.procedural.furniture.parts import (
    Part,
    Profile,
    block,
    curve,
    lathe,
    moved,
    post,
    tilted,
    tube,
    turned,
)
from perpetua.rooms.procedural.furniture.soft import cushion
from perpetua.rooms.procedural.layout.plan import Piece
from perpetua.scene.room import Material


def build_vase(piece: Piece, palette: Palette) -> list[Part]:
    """A vase, sometimes with dry twigs."""
    radius, height = 0.5 * piece.size_m[0], piece.size_m[2]
    centre = (0.0, 0.5 * piece.size_m[1])
    twigs = piece.detail[2] < 0.5
    tall = 0.5 * height if twigs else height
    shapes: tuple[Profile, ...] = (
        [(0.45, 0.0), (0.95, 0.4), (0.35, 0.85), (0.45, 1.0)],
        [(0.6, 0.0), (0.75, 0.5), (0.9, 0.75), (0.4, 1.0)],
        [(0.75, 0.0), (0.9, 0.25), (0.3, 0.6), (0.3, 0.9), (0.42, 1.0)],
    )
    outline = curve([(radius * r, tall * z) for r, z in shapes[int(3 * piece.detail[0])]], 18)
    mouth = outline[-1][0]
    body = lathe(
        [(0.0, 0.0), *outline, (0.85 * mouth, tall), (0.7 * mouth, 0.9 * tall), (0.0, 0.88 * tall)], centre, 24
    )
    parts = [Part("", body, palette.accents[int(5 * piece.detail[1])])]
    if twigs:
        parts.append(Part("twigs", _twigs(piece, centre, tall, height, mouth), palette.wicker))
    return parts


def _twigs(piece: Piece, centre: tuple[float, float], low: float, high: float, mouth: float) -> TriMesh:
    reach, meshes = 0.5 * piece.size_m[0], []
    for index in range(7):
        angle, fraction = 2.4 * index, piece.detail[4 + index]
        x, y = float(np.cos(angle)), float(np.sin(angle))
        top, out = low + (high - low) * (0.6 + 0.4 * fraction), reach * (0.4 + 0.55 * fraction)
        inner = 0.4 * mouth
        path = [
            (inner * x, centre[1] + inner * y, 0.88 * low),
            (0.5 * out * x, centre[1] + 0.5 * out * y, 0.5 * (low + top)),
            (out * x, centre[1] + out * y, top - 0.03),
        ]
        meshes.append(tube(path, [0.0022, 0.002, 0.0015], 5))
        tip = (0.94 * out * x, centre[1] + 0.94 * out * y)
        meshes.append(lathe([(0.0, top - 0.075), (0.010, top - 0.045), (0.006, top - 0.012), (0.0, top)], tip, 7))
    return join(meshes)


def build_bowl(piece: Piece, palette: Palette) -> list[Part]:
    """A bowl, sometimes with fruit."""
    radius, height = 0.5 * piece.size_m[0], piece.size_m[2]
    centre = (0.0, 0.5 * piece.size_m[1])
    outline: Profile = [(0.0, 0.0), (0.45 * radius, 0.0), (0.85 * radius, 0.45 * height), (radius, 0.8 * height)]
    outline += [
        (0.96 * radius, 0.8 * height),
        (0.78 * radius, 0.42 * height),
        (0.4 * radius, 0.14 * height),
        (0.0, 0.12 * height),
    ]
    parts = [Part("", lathe(outline, centre, 26), palette.accents[int(5 * piece.detail[1])])]
    if piece.detail[2] < 0.7:
        colors = ((0.45, 0.05, 0.02), (0.65, 0.28, 0.02), (0.32, 0.42, 0.05))
        fruit = Material("fruit", colors[int(3 * piece.detail[3])], roughness=0.35)
        size = 0.34 * radius
        balls = []
        for index in range(5):
            angle = 2 * np.pi * index / 4 + piece.detail[4]
            ring = 0.0 if index == 4 else 0.42 * radius
            z = (0.42 if index < 4 else 0.75) * height
            x, y = ring * float(np.cos(angle)), centre[1] + ring * float(np.sin(angle))
            balls.append(
                cushion((x - size, y - size, z - 0.9 * size), (x + size, y + size, z + 0.9 * size), 2.1, (5, 5, 5))
            )
        parts.append(Part("fruit", join(balls), fruit, "fruit"))
    return parts


def build_cup(piece: Piece, palette: Palette) -> list[Part]:
    """A cup with a handle."""
    width, depth, height = piece.size_m
    radius, y = 0.38 * width, 0.5 * depth
    body: Profile = [
        (0.0, 0.0),
        (0.75 * radius, 0.0),
        (0.95 * radius, 0.3 * height),
        (radius, height),
        (0.9 * radius, height),
    ]
    body += [(0.8 * radius, 0.2 * height), (0.0, 0.14 * height)]
    far = 0.5 * width - 0.005
    grip = [(0.9 * radius, 0.78), (0.5 * (radius + far), 0.84), (far, 0.62), (0.9 * far, 0.36), (0.85 * radius, 0.26)]
    handle = tube([(x - 0.1 * width, y, z * height) for x, z in grip], 0.0055, 7)
    return [
        Part(
            "",
            join([moved(lathe(body, (0.0, y), 20), (-0.1 * width, 0.0, 0.0)), handle]),
            palette.accents[int(5 * piece.detail[0])],
        )
    ]


def build_plates(piece: Piece, palette: Palette) -> list[Part]:
    """A laid place: plate, bowl, knife and fork."""
    width, depth, _ = piece.size_m
    radius, y = 0.36 * width, 0.5 * depth
    plate: Profile = [
        (0.0, 0.0),
        (0.6 * radius, 0.0),
        (radius, 0.014),
        (0.99 * radius, 0.017),
        (0.62 * radius, 0.006),
        (0.0, 0.005),
    ]
    cloth = block((-0.5 * width, 0.05 * depth, -0.0), (0.5 * width, 0.95 * depth, 0.003), 0.001)
    dish = moved(lathe(plate, (0.0, y), 28), (0.0, 0.0, 0.002))
    forks = [
        block((s * 0.43 * width - 0.007, 0.2 * depth, 0.002), (s * 0.43 * width + 0.007, 0.8 * depth, 0.006), 0.0015)
        for s in (-1, 1)
    ]
    return [
        Part("", cloth, palette.second_upholstery),
        Part("plate", dish, palette.ceramic),
        Part("cutlery", join(forks), palette.metal),
    ]


def build_books(piece: Piece, palette: Palette) -> list[Part]:
    """Books lying on each other, each turned a little."""
    width, depth, height = piece.size_m
    count = 2 + int(3 * piece.detail[10])
    parts = []
    for index in range(count):
        shrink = 1.0 - 0.22 * piece.detail[index] - 0.06 * index
        half, deep = 0.42 * width * shrink, 0.42 * depth * shrink
        low, high = height * index / count, height * (index + 1) / count
        book = join(
            [
                block((-half, -deep, low), (half, deep, low + 0.003), 0.001),
                block((-half, -deep, high - 0.003), (half, deep, high), 0.001),
                block((-half, -deep, low + 0.001), (-half + 0.004, deep, high - 0.001), 0.001),
            ]
        )
        pages = block((-half + 0.003, -deep + 0.004, low + 0.002), (half - 0.005, deep - 0.004, high - 0.002), 0.001)
        angle = 0.5 * (piece.detail[4 + index] - 0.5)
        turn, shift = (float(np.cos(angle)), float(np.sin(angle))), (0.0, 0.5 * depth, 0.0)
        color = palette.books[(index * 3 + int(7 * piece.detail[3])) % len(palette.books)]
        label = "" if index == 0 else f"{index}"
        parts.append(Part(label, turned(book, turn, shift), color))
        parts.append(Part(f"{index}_pages", turned(pages, turn, shift), palette.paper))
    return parts


def build_candles(piece: Piece, palette: Palette) -> list[Part]:
    """Candles of three heights on a tray."""
    width, depth, height = piece.size_m
    y = 0.5 * depth
    tray = lathe(
        [(0.0, 0.0), (0.47 * width, 0.0), (0.5 * width, 0.012), (0.47 * width, 0.008), (0.0, 0.006)], (0.0, y), 28
    )
    wax, wicks = [], []
    for index, fraction in enumerate((1.0, 0.7, 0.45)):
        angle = 2 * np.pi * (index / 3 + piece.detail[0])
        place = (0.24 * width * float(np.cos(angle)), y + 0.24 * width * float(np.sin(angle)))
        top = fraction * (height - 0.012)
        wax.append(post(place, 0.17 * width, 0.005, top, 18, 0.004))
        wicks.append(post(place, 0.0015, top - 0.002, top + 0.011, 6))
    return [
        Part("", tray, palette.handle),
        Part("wax", join(wax), palette.linen),
        Part("wicks", join(wicks), palette.black),
    ]


def build_photo(piece: Piece, palette: Palette) -> list[Part]:
    """A small framed picture that leans back on its stand."""
    width, depth, height = piece.size_m
    half, tall = 0.5 * width, 0.98 * height
    edge, y = 0.014, depth - 0.015
    glass = block((-half + 0.5 * edge, 0.0, 0.5 * edge), (half - 0.5 * edge, 0.007, tall - 0.5 * edge), 0.0005)
    rim = frame(width, tall, 0.012, edge)
    stand = block((-0.15 * half, 0.0, 0.0), (0.15 * half, 0.004, 0.8 * tall), 0.001)
    lean = min(0.22, 0.5 * depth / height)
    place = (0.0, y - 0.012, 0.0)
    tilt = [tilted(moved(mesh, place), lean, (y, 0.0)) for mesh in (glass, rim)]
    foot = tilted(moved(stand, (0.0, max(0.004, y - 0.75 * depth), 0.0)), -0.1, (0.02, 0.0))
    lows = [float(mesh.vertices_m[:, 2].min()) for mesh in (*tilt, foot)]
    return [
        Part("", moved(tilt[1], (0.0, 0.0, -lows[1])), palette.wood if piece.detail[1] < 0.5 else palette.handle),
        Part(
            "photo", moved(tilt[0], (0.0, 0.0, -lows[1])), palette.pictures[int(PICTURES * piece.detail[0])], "picture"
        ),
        Part("stand", moved(foot, (0.0, 0.0, -lows[2])), palette.black),
    ]


def build_monitor(piece: Piece, palette: Palette) -> list[Part]:
    """A screen with a keyboard in front of it."""
    width, depth, height = piece.size_m
    half, middle = 0.46 * width, 0.09
    grey = Material("keys", (0.10, 0.10, 0.105), roughness=0.5)
    screen = block((-half, middle - 0.012, 0.10), (half, middle + 0.012, height), 0.006)
    stand = join(
        [
            post((0.0, middle - 0.01), 0.018, 0.005, 0.16, 14),
            block((-0.11, middle - 0.085, 0.0), (0.11, middle + 0.075, 0.01), 0.004),
        ]
    )
    keyboard = [block((-0.20, depth - 0.15, 0.0), (0.20, depth - 0.015, 0.012), 0.004)]
    for row in range(4):
        y = depth - 0.145 + 0.032 * row
        keyboard += [
            block((-0.19 + 0.038 * k, y, 0.011), (-0.156 + 0.038 * k, y + 0.027, 0.017), 0.003) for k in range(10)
        ]
    mouse = cushion((0.235, depth - 0.12, 0.0), (0.29, depth - 0.03, 0.032), 2.5, (6, 6, 4))
    return [
        Part("", join([screen, stand]), palette.black),
        Part("keyboard", join([*keyboard, mouse]), grey, "keyboard"),
    ]


def build_tray(piece: Piece, palette: Palette) -> list[Part]:
    """A tray with a jug and glasses that are opaque: glazed clay."""
    width, depth, height = piece.size_m
    half, y = 0.5 * width, 0.5 * depth
    board = join(
        [
            block((-half, 0.0, 0.0), (half, depth, 0.012), 0.004),
            *(
                block((s * half - 0.008 * (s > 0), 0.0, 0.0), (s * half + 0.008 * (s < 0), depth, 0.035), 0.003)
                for s in (-1, 1)
            ),
        ]
    )
    jug = curve([(0.045, 0.0), (0.065, 0.35 * height), (0.035, 0.75 * height), (0.045, 0.96 * height)], 14)
    body = moved(
        lathe([(0.0, 0.0), *jug, (0.035, 0.96 * height), (0.0, 0.8 * height)], (-0.22 * width, y), 20),
        (0.0, 0.0, 0.0115),
    )
    cups = [
        moved(
            lathe([(0.0, 0.0), (0.026, 0.0), (0.034, 0.08), (0.03, 0.08), (0.024, 0.01), (0.0, 0.01)], (x, place), 16),
            (0.0, 0.0, 0.0115),
        )
        for x, place in ((0.10 * width, 0.32 * depth), (0.26 * width, 0.66 * depth))
    ]
    clay = palette.accents[int(5 * piece.detail[0])]
    return [Part("", board, palette.wood), Part("jug", body, clay), Part("cups", join(cups), palette.ceramic)]
