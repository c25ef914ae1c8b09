"""Floor, walls, ceiling and skirting of a room, around its openings."""

from perpetua.geometry.mesh import TriMesh, join
from perpetua.rooms.procedural.furniture.openings import FRAME_M, placed
from perpetua.rooms.procedural.furniture.parts import Part, block, prism
from perpetua.rooms.procedural.layout.plan import (
    SKIRTING_DEPTH_M,
    SKIRTING_HEIGHT_M,
    WALL_THICKNESS_M,
    FloorPlan,
    Opening,
    RoomPlan,
)

SLAB_M = 0.15
# A bevel too small to see: joints between the slabs of a wall stay invisible.
SEAM_M = 1e-5


def build_floor(plan: RoomPlan) -> Part:
    """The floor, reaching under the walls."""
    return Part("floor", _slab(plan.floor, -SLAB_M, 0.0), plan.palette.floor, "floor")


def build_ceiling(plan: RoomPlan) -> Part:
    """The ceiling, reaching over the walls."""
    return Part("ceiling", _slab(plan.floor, plan.height_m, plan.height_m + SLAB_M), plan.palette.ceiling, "ceiling")


def _slab(floor: FloorPlan, low_z_m: float, high_z_m: float) -> TriMesh:
    """A slab over the floor plan grown by the walls' thickness."""
    outline = floor.corners_m.copy()
    for index, wall in enumerate(floor.walls):
        # Every wall moves its own two corners outwards; each corner is moved by the two walls that meet there.
        outside = [wall.at(0.0, -WALL_THICKNESS_M)[axis] - wall.at(0.0, 0.0)[axis] for axis in range(2)]
        for corner in (index, (index + 1) % len(outline)):
            outline[corner] += outside
    # An L is in view as a whole from its inward corner.
    inward = [index for index, wall in enumerate(floor.walls) if not wall.starts_convex]
    return prism(outline, low_z_m, high_z_m, inward[0] if inward else 0)


def build_wall(plan: RoomPlan, wall: int) -> Part:
    """A wall of slabs around its openings; its thickness lies outside the room.

    At an outward corner a wall reaches back over the end of the one before it; at the inward corner of an L it leaves
    the corner to the other.
    """
    edge = plan.floor.walls[wall]
    reach = 0.5 * edge.length_m
    start = -reach - WALL_THICKNESS_M if edge.starts_convex else -reach + WALL_THICKNESS_M
    slabs = []
    for opening in openings_of(plan, wall):
        left, right = opening.middle_m - 0.5 * opening.width_m, opening.middle_m + 0.5 * opening.width_m
        slabs.append((start, left, 0.0, plan.height_m))
        slabs.append((left, right, opening.head_m, plan.height_m))
        if opening.sill_m > 0.0:
            slabs.append((left, right, 0.0, opening.sill_m))
        start = right
    slabs.append((start, reach, 0.0, plan.height_m))
    meshes = [block((x0, -WALL_THICKNESS_M, z0), (x1, 0.0, z1), SEAM_M) for x0, x1, z0, z1 in slabs]
    material = plan.palette.accent_wall if wall == plan.accent_wall else plan.palette.wall
    return Part(f"wall_{wall}", placed(plan, wall, join(meshes)), material, "wall")


def openings_of(plan: RoomPlan, wall: int) -> list[Opening]:
    """Door and windows of a wall, in order along it."""
    return sorted(
        (opening for opening in (plan.door, *plan.windows) if opening.wall == wall), key=lambda other: other.middle_m
    )


def build_skirting(plan: RoomPlan) -> Part:
    """Skirting along all walls but under the door: a board with a thinner lip above."""
    meshes = []
    for wall, edge in enumerate(plan.floor.walls):
        reach = 0.5 * edge.length_m
        # Every other wall leaves the corners to its neighbours; at the inward corner of an L both reach around it.
        ends_convex = plan.floor.walls[(wall + 1) % len(plan.floor.walls)].starts_convex
        start = -reach - (0.0 if edge.starts_convex else SKIRTING_DEPTH_M)
        stop = reach - (SKIRTING_DEPTH_M if ends_convex else 0.0)
        ends = [start, stop]
        if plan.door.wall == wall:
            half = 0.5 * plan.door.width_m + FRAME_M
            ends = [start, plan.door.middle_m - half, plan.door.middle_m + half, stop]
        for x0, x1 in zip(ends[::2], ends[1::2], strict=True):
            board = block((x0, 0.0, 0.0), (x1, SKIRTING_DEPTH_M, 0.8 * SKIRTING_HEIGHT_M), 0.003)
            lip = block((x0, 0.0, 0.78 * SKIRTING_HEIGHT_M), (x1, 0.6 * SKIRTING_DEPTH_M, SKIRTING_HEIGHT_M), 0.003)
            meshes.append(placed(plan, wall, join([board, lip])))
    return Part("skirting", join(meshes), plan.palette.trim, "skirting_board")
