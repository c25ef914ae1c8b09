"""Which rooms are good enough to go on with; a room that is not is drawn again."""

from dataclasses import dataclass

import numpy as np

from perpetua.errors import NavigationError
from perpetua.navigation.config import NavigationConfig
from perpetua.navigation.grid import build_nav_grid
from perpetua.rooms.acceptance.support import find_faults
from perpetua.rooms.config import RoomsConfig
from perpetua.rooms.source import RoomRejected
from perpetua.scene.room import Room

# For each kind, the furniture it is recognised by: of every group at least one category must be in the room.
REQUIRED_FURNITURE: dict[str, tuple[frozenset[str], ...]] = {
    "bathroom": (frozenset({"toilet", "bathtub", "shower"}), frozenset({"sink", "bathroom_cabinet"})),
    "bedroom": (frozenset({"bed"}),),
    "diningroom": (frozenset({"dining_table", "table"}), frozenset({"chair"})),
    "kitchen": (frozenset({"kitchen_counter", "kitchen_cabinet", "kitchen_island"}),),
    "livingroom": (frozenset({"sofa", "armchair"}),),
}

MAX_OBJECT_INDEX = np.iinfo(np.uint16).max


@dataclass(frozen=True)
class RoomFigures:
    """What was measured of an accepted room."""

    triangles: int
    free_floor_m2: float


def check_room(room: Room, config: RoomsConfig, navigation: NavigationConfig) -> RoomFigures:
    """Passes a room that has what the later stages need.

    Raises:
        RoomRejected: object indices clash or do not fit 16 bits, a vertex is not finite, the room has too many
            triangles, its kind's furniture is missing, too little connected floor is free, or something
            floats or is sunk.
    """
    _check_object_indices(room)
    _check_vertices(room)
    triangles = _check_triangles(room, config.max_triangles)
    # Of a scene that a user brings nobody has said what it should be, and what hangs in it may be meant to.
    described = room.kind in REQUIRED_FURNITURE
    if described:
        _check_furniture(room)
    free_floor_m2 = _check_free_floor(room, config.min_free_floor_m2, navigation)
    if described:
        _check_support(room)
    return RoomFigures(triangles, free_floor_m2)


def _check_object_indices(room: Room) -> None:
    indices = [obj.object_index for obj in room.objects]
    if len(set(indices)) != len(indices):
        twice = sorted({index for index in indices if indices.count(index) > 1})
        raise RoomRejected("object indices", f"object indices must be unique, but {twice[:5]} occur more than once")
    outside = [index for index in indices if not 1 <= index <= MAX_OBJECT_INDEX]
    if outside:
        raise RoomRejected("object indices", f"object indices must lie in 1..{MAX_OBJECT_INDEX}, not {outside[:5]}")


def _check_vertices(room: Room) -> None:
    for obj in room.objects:
        if not np.isfinite(obj.mesh.vertices_m).all():
            raise RoomRejected("finite vertices", f"every vertex must be finite, but some of '{obj.name}' are not")


def _check_triangles(room: Room, max_triangles: int) -> int:
    triangles = sum(len(obj.mesh.faces) for obj in room.objects)
    if triangles > max_triangles:
        raise RoomRejected("triangles", f"the room has {triangles} triangles; rooms.max_triangles is {max_triangles}")
    return triangles


def _check_furniture(room: Room) -> None:
    present = {obj.category for obj in room.objects}
    for group in REQUIRED_FURNITURE[room.kind]:
        if present.isdisjoint(group):
            wanted = " or ".join(f"'{category}'" for category in sorted(group))
            raise RoomRejected("furniture", f"a {room.kind} needs {wanted}, and this one has none")


def _check_free_floor(room: Room, min_free_floor_m2: float, navigation: NavigationConfig) -> float:
    try:
        free_floor_m2 = build_nav_grid(room, navigation).free_floor_m2
    except NavigationError as error:
        raise RoomRejected("free floor", str(error)) from error
    if free_floor_m2 < min_free_floor_m2:
        raise RoomRejected(
            "free floor",
            f"{free_floor_m2:.1f} square metres of connected floor are free; "
            f"rooms.min_free_floor_m2 is {min_free_floor_m2:.1f}",
        )
    return free_floor_m2


def _check_support(room: Room) -> None:
    faults = find_faults(room.objects)
    if faults:
        more = f", and {len(faults) - 1} more like it" if len(faults) > 1 else ""
        raise RoomRejected("support", f"{faults[0]}{more}")
