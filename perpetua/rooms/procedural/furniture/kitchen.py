"""Kitchen fittings and appliances, in each piece's own frame."""

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.finish.palette import Palette
from perpetua.rooms.procedural.furniture.parts import Part, bar, block, hull, lathe, moved, post, tube
from perpetua.rooms.procedural.furniture.soft import cushion
from perpetua.rooms.procedural.furniture.storage import FRONT_M, HANDLE_M, cabinet
from perpetua.rooms.procedural.layout.counters import MODULE_M, SPLASH_M, hob_module, module_x_m, modules, sink_module
from perpetua.rooms.procedural.layout.plan import Piece
from perpetua.scene.room import Material

PLINTH_M = 0.1
WORKTOP_M = 0.04


def build_kitchen_counter(piece: Piece, palette: Palette) -> list[Part]:
    """A row of base cabinets and drawers under one worktop, with sink, tap, hob, oven, and tiles on the wall."""
    width, depth, height = piece.size_m
    half, top = 0.5 * width, height - WORKTOP_M
    hob, sink = hob_module(piece), sink_module(piece)
    bodies: list[TriMesh] = []
    fronts: list[TriMesh] = []
    handles: list[TriMesh] = []
    for module in range(modules(piece)):
        if module == hob:
            continue
        rows = 3 if module not in (hob, sink) and (piece.detail[2] + 0.37 * module) % 1.0 < 0.45 else 1
        unit = cabinet(width / modules(piece), depth - 0.02, PLINTH_M, top, 1, rows, palette.style)
        shift = (module_x_m(piece, module), 0.0, 0.0)
        for meshes, mesh in zip((bodies, fronts, handles), unit, strict=True):
            meshes.append(moved(mesh, shift))
    plinth = block((-half + 0.005, 0.02, 0.0), (half - 0.005, depth - 0.10, PLINTH_M + 0.002), 0.003)
    hob_x, sink_x = module_x_m(piece, hob), module_x_m(piece, sink)
    sink_half = 0.42 * width / modules(piece)
    splash = block((-half, 0.0, height - 0.002), (half, 0.012, height + SPLASH_M), 0.003)
    return [
        Part("", join([*bodies, plinth]), palette.trim),
        Part("fronts", join(fronts), palette.lacquer),
        Part("handles", join(handles), palette.handle),
        Part("worktop", _worktop(half, depth, top, height, sink_x, sink_half), palette.worktop),
        Part("sink", _sink(sink_x, sink_half, depth, height), palette.metal, "sink"),
        Part("tap", tap(sink_x, 0.095, height), palette.handle, "tap"),
        Part("splashback", splash, palette.splashback),
        *_hob(hob_x, depth, height, palette),
        *_oven(hob_x, 0.5 * width / modules(piece), depth, top, palette),
    ]


def _worktop(half: float, depth: float, low: float, high: float, sink_x: float, sink_half: float) -> TriMesh:
    """The worktop around the hole for the sink."""
    front, back = depth - 0.11, 0.14
    pieces = [(-half, sink_x - sink_half, 0.0, depth), (sink_x + sink_half, half, 0.0, depth)]
    pieces += [
        (sink_x - sink_half, sink_x + sink_half, 0.0, back),
        (sink_x - sink_half, sink_x + sink_half, front, depth),
    ]
    # So small a bevel that the seams stay unseen.
    return join([block((x0, y0, low), (x1, y1, high), 0.0008) for x0, x1, y0, y1 in pieces if x1 - x0 > 0.005])


def _sink(x: float, half: float, depth: float, z: float) -> TriMesh:
    """A rim and a basin as deep as the worktop allows without meeting the cabinet."""
    front, back, low = depth - 0.11, 0.14, z - WORKTOP_M + 0.001
    rim = 0.014
    walls = [
        block((x - half, back, low), (x + half, back + rim, z + 0.004), 0.004),
        block((x - half, front - rim, low), (x + half, front, z + 0.004), 0.004),
        block((x - half, back, low), (x - half + rim, front, z + 0.0035), 0.004),
        block((x + half - rim, back, low), (x + half, front, z + 0.0035), 0.004),
        block((x - half + 0.004, back + 0.004, low), (x + half - 0.004, front - 0.004, low + 0.006), 0.002),
        post((x, 0.5 * (front + back)), 0.035, low + 0.005, low + 0.011, 18, 0.002),
    ]
    return join(walls)


def _hob(x: float, depth: float, z: float, palette: Palette) -> list[Part]:
    plate = block((x - 0.28, 0.07, z - 0.001), (x + 0.28, depth - 0.06, z + 0.007), 0.003)
    rings = []
    for dx in (-0.14, 0.14):
        for y in (0.20, depth - 0.19):
            radius = 0.085 if (dx > 0) == (y < 0.3) else 0.065
            rings.append(post((x + dx, y), radius, z + 0.006, z + 0.009, 24))
    grey = Material("hob rings", (0.09, 0.09, 0.095), roughness=0.35)
    return [Part("hob", plate, palette.black, "oven"), Part("hob_rings", join(rings), grey, "oven")]


def _oven(x: float, half: float, depth: float, top: float, palette: Palette) -> list[Part]:
    """An oven under the hob: glass door, panel with knobs, bar handle."""
    front = depth - 0.02 - HANDLE_M
    body = block((x - half, 0.0, PLINTH_M), (x + half, front - FRONT_M, top - 0.001), 0.003)
    panel = block(
        (x - half + 0.003, front - FRONT_M - 0.002, top - 0.12), (x + half - 0.003, front, top - 0.003), 0.003
    )
    drawer = block((x - half + 0.003, front - FRONT_M - 0.002, PLINTH_M), (x + half - 0.003, front, 0.22), 0.003)
    glass = block((x - half + 0.003, front - FRONT_M - 0.002, 0.225), (x + half - 0.003, front, top - 0.125), 0.004)
    z = top - 0.16
    grip = [bar((x - 0.8 * half, front + 0.022, z), (x + 0.8 * half, front + 0.022, z), 0.008, 10)]
    grip += [
        bar((x + s * 0.7 * half, front - 0.002, z), (x + s * 0.7 * half, front + 0.022, z), 0.006, 8) for s in (-1, 1)
    ]
    knobs = [
        tube(
            [(x + dx * half, front - 0.002, top - 0.06), (x + dx * half, front + 0.02, top - 0.06)], [0.018, 0.015], 14
        )
        for dx in (-0.7, -0.45, 0.45, 0.7)
    ]
    return [
        Part("oven", join([body, panel, drawer]), palette.metal, "oven"),
        Part("oven_glass", glass, palette.black, "oven"),
        Part("oven_grip", join(grip + knobs), palette.handle, "oven"),
    ]


def tap(x_m: float, y_m: float, z_m: float) -> TriMesh:
    """A tap with an arched spout towards +y and a lever."""
    angles = np.linspace(0.0, 0.9 * np.pi, 9)
    path = [(x_m, y_m, z_m + 0.02), (x_m, y_m, z_m + 0.12), (x_m, y_m, z_m + 0.20)]
    path += [(x_m, float(y_m + 0.075 * (1 - np.cos(a))), float(z_m + 0.20 + 0.075 * np.sin(a))) for a in angles[1:]]
    lever = tube([(x_m + 0.015, y_m, z_m + 0.05), (x_m + 0.075, y_m, z_m + 0.075)], [0.008, 0.006], 8)
    return join([post((x_m, y_m), 0.025, z_m, z_m + 0.035, 18, 0.005), tube(path, 0.0115, 10), lever])


def build_island(piece: Piece, palette: Palette) -> list[Part]:
    """A block of cabinets whose worktop reaches out on all sides."""
    width, depth, height = piece.size_m
    half, top = 0.5 * width, height - WORKTOP_M
    columns = max(2, round(width / MODULE_M))
    body, fronts, handles = cabinet(width - 0.08, depth - 0.06, PLINTH_M, top, columns, 1, palette.style)
    shift = (0.0, 0.03, 0.0)
    plinth = block((-half + 0.08, 0.07, 0.0), (half - 0.08, depth - 0.12, PLINTH_M + 0.002), 0.003)
    return [
        Part("", join([moved(body, shift), plinth]), palette.trim),
        Part("fronts", moved(fronts, shift), palette.lacquer),
        Part("handles", moved(handles, shift), palette.handle),
        Part("worktop", block((-half, 0.0, top), (half, depth, height), 0.007, 2), palette.worktop),
    ]


def build_wall_cabinet(piece: Piece, palette: Palette) -> list[Part]:
    """A row of kitchen cabinets that hang on the wall."""
    width, depth, height = piece.size_m
    body, fronts, handles = cabinet(width, depth, 0.0, height, max(1, round(width / 0.5)), 1, palette.style)
    return [
        Part("", body, palette.trim),
        Part("fronts", fronts, palette.lacquer),
        Part("handles", handles, palette.handle),
    ]


def build_tall_cabinet(piece: Piece, palette: Palette) -> list[Part]:
    """A tall kitchen cupboard with a built-in oven at chest height."""
    width, depth, height = piece.size_m
    half = 0.5 * width
    split_z, oven_z = 0.62, 1.22
    low = cabinet(width, depth, PLINTH_M, split_z, 1, 2, palette.style)
    high = cabinet(width, depth, oven_z, height, 1, 1, palette.style)
    front = depth - HANDLE_M
    middle = block((-half, 0.0, split_z), (half, front - FRONT_M, oven_z), 0.002)
    glass = block((-half + 0.03, front - FRONT_M - 0.01, split_z + 0.02), (half - 0.03, front, oven_z - 0.14), 0.004)
    panel = block((-half + 0.03, front - FRONT_M - 0.01, oven_z - 0.135), (half - 0.03, front, oven_z - 0.02), 0.004)
    grip = bar((-0.7 * half, front + 0.02, oven_z - 0.19), (0.7 * half, front + 0.02, oven_z - 0.19), 0.008, 10)
    plinth = block((-half + 0.005, 0.02, 0.0), (half - 0.005, depth - 0.09, PLINTH_M + 0.002), 0.003)
    return [
        Part("", join([low[0], middle, high[0], plinth]), palette.trim),
        Part("fronts", join([low[1], high[1]]), palette.lacquer),
        Part("handles", join([low[2], high[2], grip]), palette.handle),
        Part("oven", glass, palette.black, "oven"),
        Part("oven_panel", panel, palette.metal, "oven"),
    ]


def build_extractor(piece: Piece, palette: Palette) -> list[Part]:
    """A hood over the hob: a slanted skirt under a flue."""
    width, depth, height = piece.size_m
    half, flue = 0.5 * width, 0.15
    rim = block((-half, 0.0, 0.0), (half, depth, 0.05), 0.004)
    slope = [(x, y, 0.048) for x in (-half + 0.006, half - 0.006) for y in (0.002, depth - 0.006)]
    slope += [(x, y, 0.30) for x in (-flue, flue) for y in (0.002, 2 * flue)]
    chimney = block((-flue, 0.0, 0.29), (flue, 2 * flue, height), 0.004)
    return [Part("", join([rim, hull(np.array(slope)), chimney]), palette.metal)]


def build_fridge(piece: Piece, palette: Palette) -> list[Part]:
    """A tall fridge with a freezer door below."""
    width, depth, height = piece.size_m
    half, split, front = 0.5 * width, 0.36 * height, depth - 0.045
    body = block((-half, 0.0, 0.02), (half, front - 0.055, height), 0.01)
    doors = [
        block((-half + 0.003, front - 0.056, low), (half - 0.003, front, high), 0.014, 3)
        for low, high in ((0.06, split - 0.004), (split + 0.004, height - 0.004))
    ]
    x, grips = half - 0.06, []
    for low, high in ((split - 0.38, split - 0.06), (split + 0.06, split + 0.5)):
        grips.append(bar((x, front + 0.035, low), (x, front + 0.035, high), 0.009, 10))
        grips += [bar((x, front - 0.002, z), (x, front + 0.035, z), 0.006, 8) for z in (low + 0.03, high - 0.03)]
    feet = [post((sx * (half - 0.05), y), 0.02, 0.0, 0.03) for sx in (-1, 1) for y in (0.06, front - 0.12)]
    skin = palette.metal if piece.detail[0] < 0.5 else palette.ceramic
    return [
        Part("", join([body, *doors]), skin),
        Part("handles", join(grips), palette.handle),
        Part("feet", join(feet), palette.black),
    ]


def build_kettle(piece: Piece, palette: Palette) -> list[Part]:
    """A kettle with handle and spout, or a pot where it is low."""
    width, depth, height = piece.size_m
    radius, y = 0.36 * width, 0.5 * depth
    body = [
        (0.0, 0.0),
        (0.92 * radius, 0.0),
        (radius, 0.03),
        (0.72 * radius, 0.78 * height),
        (0.5 * radius, 0.86 * height),
    ]
    lid = [(0.18 * radius, 0.88 * height), (0.14 * radius, 0.95 * height), (0.0, 0.95 * height)]
    spout = tube(
        [(0.8 * radius, y, 0.5 * height), (1.25 * radius, y, 0.68 * height), (1.35 * radius, y, 0.76 * height)],
        [0.018, 0.012, 0.01],
        8,
    )
    arc = [
        (-0.75 * radius, 0.7),
        (-1.2 * radius, 0.72),
        (-1.3 * radius, 0.45),
        (-1.15 * radius, 0.25),
        (-0.9 * radius, 0.22),
    ]
    grip = tube([(x, y, fraction * height) for x, fraction in arc], 0.009, 8)
    shell = palette.metal if piece.detail[0] < 0.5 else palette.accents[int(5 * piece.detail[1])]
    return [Part("", join([lathe([*body, *lid], (0.0, y), 24), spout]), shell), Part("grip", grip, palette.black)]


def build_chopping_board(piece: Piece, palette: Palette) -> list[Part]:
    """A board that lies on the worktop with a loaf on it."""
    width, depth, height = piece.size_m
    half = 0.5 * width
    loaf = cushion((-0.6 * half, 0.25 * depth, 0.016), (0.5 * half, 0.75 * depth, height), 3.0, (10, 8, 6))
    crust = Material("crust", (0.42, 0.22, 0.08), (0.30, 0.13, 0.04), 0.8, pattern="fabric", scale_m=0.06)
    board = block((-half, 0.0, 0.0), (half, depth, 0.02), 0.006, 2)
    return [Part("", board, palette.wood), Part("bread", loaf, crust)]


def build_bottles(piece: Piece, palette: Palette) -> list[Part]:
    """A few bottles and jars side by side."""
    width, depth, height = piece.size_m
    glass = Material("bottle glass", (0.02, 0.06, 0.03), roughness=0.08)
    oil = Material("oil", (0.30, 0.19, 0.03), roughness=0.1)
    parts = []
    for index, material in enumerate((glass, oil, palette.ceramic)):
        tall = height * (1.0, 0.86, 0.55)[index] * (0.9 + 0.1 * piece.detail[index])
        radius = 0.15 * width * (1.0, 0.85, 1.2)[index]
        x = (index - 1) * 0.33 * width
        neck = 0.35 if index < 2 else 0.85
        shape = [
            (0.0, 0.0),
            (radius, 0.0),
            (radius, 0.6 * tall),
            (neck * radius, 0.78 * tall),
            (neck * radius, tall),
            (0.0, tall),
        ]
        parts.append(Part("" if index == 0 else f"{index}", lathe(shape, (x, 0.5 * depth), 16), material))
    return parts
