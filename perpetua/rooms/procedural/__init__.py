"""Own furnished rooms, from bevelled, turned and soft parts by rules; no Blender, less than a second."""

from pathlib import Path

from perpetua.rooms.config import RoomsConfig
from perpetua.rooms.procedural.building import build_room
from perpetua.rooms.procedural.layout.sampling import sample_room
from perpetua.rooms.source import RoomRejected, RoomWish
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed


class ProceduralRooms:
    """Draws a plan (sizes, openings, furniture, materials, light), then builds it."""

    def draws(self, config: RoomsConfig) -> int | None:
        """Without end."""
        return None

    def make(self, wish: RoomWish, config: RoomsConfig, seed: StageSeed, attempt: int, scratch: Path) -> Room:
        """A room as wished; nothing is written to ``scratch``.

        Raises:
            RoomRejected: the furniture that the kind needs does not fit into the drawn floor.
        """
        plan = sample_room(seed.stream("procedural", attempt), wish)
        if plan is None:
            raise RoomRejected("furniture", f"what a {wish.kind} needs does not fit; raise rooms.min_side_m")
        return build_room(plan, f"{wish.kind}_{seed.room:06d}")
