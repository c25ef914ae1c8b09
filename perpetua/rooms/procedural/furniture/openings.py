"""Doors and windows: leaf, frames, glazing bars, handles, sill."""

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.furniture.parts import Part, bar, block, tube, turned
from perpetua.rooms.procedural.layout.plan import QUARTER_TURNS, WALL_THICKNESS_M, Opening, RoomPlan

FRAME_M = 0.07
FRAME_FRONT_M = 0.018


def placed(plan: RoomPlan, wall: int, mesh: TriMesh) -> TriMesh:
    """A mesh drawn with the wall's inner face at y = 0 and the room towards +y, put where the wall is."""
    edge = plan.floor.walls[wall]
    return turned(mesh, QUARTER_TURNS[edge.quarters], (*edge.at(0.0, 0.0), 0.0))


def build_door(plan: RoomPlan) -> list[Part]:
    """A closed panelled door in its opening, with frame, hinges and handle."""
    door = plan.door
    half, middle, head = 0.5 * door.width_m, door.middle_m, door.head_m - 0.022
    inner = half - 0.022
    leaf = [block((middle - inner, -0.07, 0.004), (middle + inner, -0.036, head), 0.002)]
    stile, rails = 0.11, (0.004, 0.24, 0.92, 1.06, head - 0.12, head)
    for side in (-1.0, 1.0):
        x0, x1 = sorted((middle + side * inner, middle + side * (inner - stile)))
        leaf.append(block((x0, -0.04, 0.004), (x1, -0.022, head), 0.004))
    for low, high in ((rails[0], rails[1]), (rails[2], rails[3]), (rails[4], rails[5])):
        leaf.append(
            block((middle - inner + stile - 0.002, -0.04, low), (middle + inner - stile + 0.002, -0.0225, high), 0.004)
        )
    for low, high in ((rails[1], rails[2]), (rails[3], rails[4])):
        leaf.append(
            block(
                (middle - inner + stile + 0.035, -0.04, low + 0.035),
                (middle + inner - stile - 0.035, -0.0265, high - 0.035),
                0.009,
            )
        )
    x = middle + inner - 0.06
    handle = [block((x - 0.02, -0.024, 0.92), (x + 0.02, -0.016, 1.12), 0.004)]
    handle.append(bar((x, -0.02, 1.05), (x, 0.03, 1.05), 0.009))
    handle.append(
        tube([(x + 0.008, 0.03, 1.05), (x - 0.05, 0.034, 1.05), (x - 0.12, 0.03, 1.052)], [0.009, 0.0095, 0.008])
    )
    hinges = [
        bar((middle - inner - 0.004, -0.018, z), (middle - inner - 0.004, -0.018, z + 0.09), 0.008)
        for z in (0.25, head - 0.4)
    ]
    panel = plan.palette.trim if plan.palette.style.fronts == "framed" else plan.palette.wood
    return [
        Part("door", placed(plan, door.wall, join(leaf)), panel, "door"),
        Part("door_frame", placed(plan, door.wall, _frame(door, sill=False)), plan.palette.trim, "door_frame"),
        Part("door_handle", placed(plan, door.wall, join(handle + hinges)), plan.palette.handle, "door_handle"),
    ]


def _frame(opening: Opening, sill: bool) -> TriMesh:
    """Boards that line an opening, and a moulding of two steps around it on the wall."""
    middle, half, low, high = opening.middle_m, 0.5 * opening.width_m, opening.sill_m, opening.head_m
    deep, lining = -WALL_THICKNESS_M, 0.022
    boards = [
        block((middle - half, deep, high - lining), (middle + half, FRAME_FRONT_M, high), 0.003),
        block((middle - half, deep, low), (middle - half + lining, FRAME_FRONT_M, high - lining + 0.001), 0.003),
        block((middle + half - lining, deep, low), (middle + half, FRAME_FRONT_M, high - lining + 0.001), 0.003),
    ]
    for reach, front in ((FRAME_M, 0.5 * FRAME_FRONT_M), (0.6 * FRAME_M, FRAME_FRONT_M)):
        for side in (-1.0, 1.0):
            x0, x1 = sorted((middle + side * half, middle + side * (half + reach)))
            boards.append(block((x0, -0.002, low), (x1, front, high + reach), 0.003))
        boards.append(block((middle - half, -0.002, high), (middle + half, front - 0.0004, high + reach), 0.003))
    if sill:
        edge = half + FRAME_M
        boards.append(block((middle - half + lining, deep, low), (middle + half - lining, 0.0, low + lining), 0.002))
        boards.append(
            block((middle - edge - 0.02, -0.002, low - 0.035), (middle + edge + 0.02, 0.11, low + 0.002), 0.008, 2)
        )
    return join(boards)


def build_window(plan: RoomPlan, number: int) -> list[Part]:
    """Frame, sill and sashes of a window; it has no pane, so depth and identity stay well defined."""
    window = plan.windows[number]
    half, middle = 0.5 * window.width_m - 0.022, window.middle_m
    y0, y1 = -0.62 * WALL_THICKNESS_M - 0.025, -0.62 * WALL_THICKNESS_M + 0.025
    low, high = window.sill_m + 0.022, window.head_m - 0.022
    sashes = max(1, round(window.width_m / 0.75))
    pitch, edge, bars = 2 * half / sashes, 0.05, []
    for sash in range(sashes):
        x0, x1 = middle - half + sash * pitch + 0.001, middle - half + (sash + 1) * pitch - 0.001
        bars += [
            block((x0, y0, low), (x0 + edge, y1, high), 0.005),
            block((x1 - edge, y0, low), (x1, y1, high), 0.005),
            block((x0 + edge - 0.002, y0, low), (x1 - edge + 0.002, y1, low + edge + 0.01), 0.005),
            block((x0 + edge - 0.002, y0, high - edge), (x1 - edge + 0.002, y1, high), 0.005),
        ]
        if plan.palette.style.fronts == "framed":
            z = low + 0.68 * (high - low)
            bars.append(
                block((x0 + edge - 0.002, y0 + 0.012, z - 0.013), (x1 - edge + 0.002, y1 - 0.012, z + 0.013), 0.004)
            )
    handles = []
    for sash in range(sashes):
        x = middle - half + sash * pitch + (pitch - 0.025 if sash % 2 == 0 else 0.025)
        z = 0.5 * (low + high)
        handles.append(block((x - 0.012, y1 - 0.001, z - 0.035), (x + 0.012, y1 + 0.01, z + 0.035), 0.003))
        handles.append(
            tube([(x, y1, z), (x, y1 + 0.03, z), (x, y1 + 0.035, z - 0.03), (x, y1 + 0.03, z - 0.11)], 0.007, 8)
        )
    return [
        Part(
            f"window_{number}",
            placed(plan, window.wall, join([_frame(window, sill=True), *bars])),
            plan.palette.trim,
            "window",
        ),
        Part(f"window_{number}_handles", placed(plan, window.wall, join(handles)), plan.palette.handle, "window"),
    ]


def outward(plan: RoomPlan, window: Opening) -> np.ndarray:
    """The direction out of the room through a window."""
    cosine, sine = QUARTER_TURNS[plan.floor.walls[window.wall].quarters]
    return np.array([sine, -cosine])
