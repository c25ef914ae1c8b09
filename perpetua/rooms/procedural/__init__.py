"""Own furnished rooms, from boxes and turned parts by rules; no Blender, less than a second."""

from pathlib import Path

from perpetua.rooms.acceptance import RoomRejected
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.rooms.procedural.building import build_room
from perpetua.rooms.procedural.sampling import sample_room
from perpetua.rooms.source import ROOM_SOURCES
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed


@ROOM_SOURCES.register("procedural")
class ProceduralRooms:
    """Draws a plan (sizes, openings, furniture, materials, light), then builds it."""

    def make(self, kind: RoomKind, config: RoomsConfig, seed: StageSeed, attempt: int, scratch: Path) -> Room:
        """A room of the kind; nothing is written to ``scratch``.

        Raises:
            RoomRejected: the furniture that the kind needs does not fit into the drawn floor.
        """
        plan = sample_room(seed.stream("procedural", attempt), kind, config)
        if plan is None:
            raise RoomRejected("furniture", f"what a {kind} needs does not fit; raise rooms.min_side_m")
        return build_room(plan, f"{kind}_{seed.room:06d}")
