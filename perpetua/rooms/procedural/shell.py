"""Floor, walls, ceiling, door, windows and their daylight."""

import numpy as np

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.parts import Part, bar, block, turned
from perpetua.rooms.procedural.plan import (
    QUARTER_TURNS,
    SKIRTING_DEPTH_M,
    SKIRTING_HEIGHT_M,
    Opening,
    RoomPlan,
    at_wall,
    wall_distance_m,
    wall_length_m,
)
from perpetua.rooms.types import AreaLight

SLAB_M = 0.15
FRAME_M = 0.06
LAMP_SIZE_M = 0.5


def build_floor(plan: RoomPlan) -> Part:
    """The floor, reaching under the walls."""
    x, y = 0.5 * plan.width_m + plan.wall_thickness_m, 0.5 * plan.depth_m + plan.wall_thickness_m
    return Part("floor", block((-x, -y, -SLAB_M), (x, y, 0.0), 0.001), plan.palette.floor)


def build_ceiling(plan: RoomPlan) -> Part:
    """The ceiling, reaching over the walls."""
    x, y = 0.5 * plan.width_m + plan.wall_thickness_m, 0.5 * plan.depth_m + plan.wall_thickness_m
    mesh = block((-x, -y, plan.height_m), (x, y, plan.height_m + SLAB_M), 0.001)
    return Part("ceiling", mesh, plan.palette.ceiling)


def build_wall(plan: RoomPlan, wall: int) -> Part:
    """A wall of boxes around its openings; its thickness lies outside the room."""
    reach = 0.5 * wall_length_m(wall, plan.width_m, plan.depth_m)
    # Two of the walls fill the corners.
    reach += plan.wall_thickness_m if wall % 2 == 0 else 0.0
    blocks, start = [], -reach
    for opening in sorted(_openings(plan, wall), key=lambda other: other.middle_m):
        left, right = opening.middle_m - 0.5 * opening.width_m, opening.middle_m + 0.5 * opening.width_m
        blocks.append((start, left, 0.0, plan.height_m))
        blocks.append((left, right, opening.head_m, plan.height_m))
        if opening.sill_m > 0.0:
            blocks.append((left, right, 0.0, opening.sill_m))
        start = right
    blocks.append((start, reach, 0.0, plan.height_m))
    meshes = [_slab(x0, x1, -plan.wall_thickness_m, 0.0, z0, z1) for x0, x1, z0, z1 in blocks]
    return Part(f"wall_{wall}", _placed(plan, wall, join(meshes)), plan.palette.wall)


def _slab(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> TriMesh:
    # A bevel too small to see: joints between the slabs of a wall stay invisible.
    return block((x0, y0, z0), (x1, y1, z1), 1e-5)


def _openings(plan: RoomPlan, wall: int) -> list[Opening]:
    return [opening for opening in (plan.door, *plan.windows) if opening.wall == wall]


def _placed(plan: RoomPlan, wall: int, mesh: TriMesh) -> TriMesh:
    """A mesh drawn with the wall's inner face at y = 0 and the room towards +y, put where the wall is."""
    x, y = at_wall(wall, 0.0, 0.0, plan.width_m, plan.depth_m)
    return turned(mesh, 0.5 * np.pi * wall, (x, y, 0.0))


def build_skirting(plan: RoomPlan) -> Part:
    """Skirting along all walls but under the door."""
    meshes = []
    for wall in range(4):
        reach = 0.5 * wall_length_m(wall, plan.width_m, plan.depth_m)
        # Two of the walls leave the corners to the others.
        reach -= 0.0 if wall % 2 == 0 else SKIRTING_DEPTH_M
        ends = [-reach, reach]
        if plan.door.wall == wall:
            half = 0.5 * plan.door.width_m + FRAME_M
            ends = [-reach, plan.door.middle_m - half, plan.door.middle_m + half, reach]
        boards = [
            block((x0, 0.0, 0.0), (x1, SKIRTING_DEPTH_M, SKIRTING_HEIGHT_M), 0.003)
            for x0, x1 in zip(ends[::2], ends[1::2], strict=True)
        ]
        meshes.append(_placed(plan, wall, join(boards)))
    return Part("skirting", join(meshes), plan.palette.trim)


def build_door(plan: RoomPlan) -> list[Part]:
    """A closed door in its opening: leaf with two panels, frame around it, handle."""
    door, thickness = plan.door, plan.wall_thickness_m
    half, middle = 0.5 * door.width_m, door.middle_m
    leaf = [block((middle - half, -0.07, 0.002), (middle + half, -0.03, door.head_m), 0.002)]
    for low, high in ((0.18, 0.92), (1.08, door.head_m - 0.16)):
        leaf.append(block((middle - half + 0.14, -0.031, low), (middle + half - 0.14, -0.018, high), 0.008))
    frame = _frame(middle, half, 0.0, door.head_m, thickness, sill=False)
    x = middle + half - 0.09
    handle = [block((x - 0.02, -0.03, 0.94), (x + 0.02, -0.022, 1.14), 0.004)]
    handle += [
        bar((x, -0.024, 1.04), (x, 0.03, 1.04), 0.009),
        bar((x + 0.009, 0.03, 1.04), (x - 0.12, 0.03, 1.04), 0.009),
    ]
    return [
        Part("door", _placed(plan, door.wall, join(leaf)), plan.palette.wood),
        Part("door_frame", _placed(plan, door.wall, frame), plan.palette.trim),
        Part("door_handle", _placed(plan, door.wall, join(handle)), plan.palette.metal),
    ]


def _frame(middle: float, half: float, low_z: float, high_z: float, thickness: float, sill: bool) -> TriMesh:
    """A frame that lines an opening and stands a little out of the wall."""
    front, lining = 0.015, 0.02
    boards = [
        block((middle - half - FRAME_M, 0.0, low_z), (middle - half, front, high_z + FRAME_M), 0.003),
        block((middle + half, 0.0, low_z), (middle + half + FRAME_M, front, high_z + FRAME_M), 0.003),
        block((middle - half, 0.0, high_z), (middle + half, front, high_z + FRAME_M), 0.003),
        block((middle - half, -thickness, high_z - lining), (middle + half, front, high_z), 0.002),
        block((middle - half, -thickness, low_z), (middle - half + lining, front, high_z - lining), 0.002),
        block((middle + half - lining, -thickness, low_z), (middle + half, front, high_z - lining), 0.002),
    ]
    if sill:
        edge = half + FRAME_M
        boards.append(block((middle - half + lining, -thickness, low_z), (middle + half - lining, 0.0, low_z + lining)))
        boards.append(block((middle - edge, 0.0, low_z - 0.03), (middle + edge, 0.12, low_z), 0.006))
    return join(boards)


def build_window(plan: RoomPlan, number: int, window: Opening) -> Part:
    """Lining, sill and glazing bars of a window; it has no pane, so depth and identity stay well defined."""
    half, middle, thickness = 0.5 * window.width_m, window.middle_m, plan.wall_thickness_m
    frame = _frame(middle, half, window.sill_m, window.head_m, thickness, sill=True)
    y0, y1 = -0.6 * thickness - 0.02, -0.6 * thickness + 0.02
    low, high = window.sill_m + 0.02, window.head_m - 0.02
    sashes = max(1, round(window.width_m / 0.75))
    bars = []
    for x in np.linspace(middle - half + 0.04, middle + half - 0.04, sashes + 1):
        bars.append(block((float(x) - 0.025, y0, low), (float(x) + 0.025, y1, high), 0.004))
    for z in (low, high - 0.05):
        bars.append(block((middle - half + 0.02, y0 + 0.002, z), (middle + half - 0.02, y1 - 0.002, z + 0.05), 0.004))
    return Part(f"window_{number}", _placed(plan, window.wall, join([frame, *bars])), plan.palette.trim)


def daylight(plan: RoomPlan, window: Opening) -> AreaLight:
    """The light that comes in through a window, from a rectangle a little outside it."""
    x, y = at_wall(window.wall, window.middle_m, -plan.wall_thickness_m - 0.35, plan.width_m, plan.depth_m)
    inward = (float(-QUARTER_TURNS[window.wall][1]), float(QUARTER_TURNS[window.wall][0]))
    height_m = window.head_m - window.sill_m
    return AreaLight(
        position_m=(x, y, window.sill_m + 0.65 * height_m),
        direction=(0.93 * inward[0], 0.93 * inward[1], -0.37),
        size_m=(1.1 * window.width_m, height_m),
        power_w=plan.daylight_power_w * window.width_m * height_m,
        color=plan.daylight_color,
    )


def lamp_light(plan: RoomPlan, x_m: float, y_m: float, z_m: float) -> AreaLight:
    """The light of a lamp, shining down from just below it."""
    return AreaLight(
        (x_m, y_m, z_m - 0.02), (0.0, 0.0, -1.0), (LAMP_SIZE_M, LAMP_SIZE_M), plan.lamp_power_w, plan.lamp_color
    )


def floor_polygon_m(plan: RoomPlan) -> np.ndarray:
    """The inner edge of the walls, counter-clockwise."""
    x = wall_distance_m(1, plan.width_m, plan.depth_m)
    y = wall_distance_m(0, plan.width_m, plan.depth_m)
    return np.array([[-x, -y], [x, -y], [x, y], [-x, y]])
