"""What a room source is, and the loop that draws rooms until one is acceptable."""

import importlib
import logging
from collections import Counter
from pathlib import Path
from typing import Protocol

from perpetua.errors import RoomError
from perpetua.navigation.config import NavigationConfig
from perpetua.registry import Registry
from perpetua.rooms.acceptance import RoomRejected, check_room
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed

logger = logging.getLogger(__name__)


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


def build_room(config: RoomsConfig, navigation: NavigationConfig, seed: StageSeed, scratch: Path) -> Room:
    """Draws rooms from the configured source until one passes ``check_room``.

    Raises:
        RoomError: ``rooms.max_redraws`` further draws were rejected too; the reasons are counted in the message.
    """
    _fill_registry()
    source = ROOM_SOURCES[config.source]()
    kind = config.kinds[int(seed.stream("kind").integers(len(config.kinds)))]
    reasons: Counter[str] = Counter()
    for attempt in range(config.max_redraws + 1):
        try:
            room = source.make(kind, config, seed, attempt, scratch)
            check_room(room, config, navigation)
            return room
        except RoomRejected as rejection:
            logger.info("room %d, draw %d of a %s rejected: %s", seed.room, attempt, kind, rejection)
            reasons[rejection.rule] += 1
    counts = ", ".join(f"{rule} ({count} x)" for rule, count in reasons.most_common())
    raise RoomError(
        f"none of {config.max_redraws + 1} draws of a {kind} was acceptable: {counts}; raise rooms.max_redraws or "
        "rooms.min_side_m, or lower rooms.min_free_floor_m2"
    )


def _fill_registry() -> None:
    """The sources that come with Perpetua; here and not on top, since each registers itself in this module."""
    importlib.import_module("perpetua.rooms.infinigen")
    importlib.import_module("perpetua.rooms.procedural")
