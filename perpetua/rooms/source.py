"""What a room source is."""

from pathlib import Path
from typing import Protocol

from perpetua.registry import Registry
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed


class RoomSource(Protocol):
    """Makes one room; the same arguments give the same room, bit for bit."""

    def make(self, kind: RoomKind, config: RoomsConfig, seed: StageSeed, attempt: int, scratch: Path) -> Room:
        """A room of the kind.

        Args:
            kind: which kind of room.
            config: the rooms section of the config.
            seed: all randomness comes from ``seed.stream(..., attempt)``.
            attempt: 0 for the first draw, counted up for each rejected one.
            scratch: folder for files of the room; a .blend that the room keeps must lie in it.

        Raises:
            RoomRejected: this draw is no use and another may be.
            RoomError: no draw can succeed.
        """
        ...


ROOM_SOURCES: Registry[type[RoomSource]] = Registry("rooms.source")
