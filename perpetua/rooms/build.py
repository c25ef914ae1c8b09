"""Draws rooms until one is acceptable."""

import logging
from collections import Counter
from pathlib import Path

from perpetua.errors import RoomError
from perpetua.navigation.config import NavigationConfig

# Each source enters itself in ROOM_SOURCES when it is imported.
from perpetua.rooms import infinigen, procedural  # noqa: F401
from perpetua.rooms.acceptance import RoomRejected, check_room
from perpetua.rooms.config import RoomsConfig
from perpetua.rooms.source import ROOM_SOURCES, draw_wish
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed

logger = logging.getLogger(__name__)


def build_room(config: RoomsConfig, navigation: NavigationConfig, seed: StageSeed, scratch: Path) -> Room:
    """Draws rooms from the configured source until one passes ``check_room``.

    Raises:
        RoomError: ``rooms.max_redraws`` further draws were rejected too; the reasons are counted in the message.
    """
    source = ROOM_SOURCES[config.source]()
    kind = config.kinds[int(seed.stream("kind").integers(len(config.kinds)))]
    reasons: Counter[str] = Counter()
    for attempt in range(config.max_redraws + 1):
        try:
            wish = draw_wish(kind, config, seed.stream("wish", attempt))
            room = source.make(wish, config, seed, attempt, scratch)
            check_room(room, config, navigation)
            return room
        except RoomRejected as rejection:
            logger.info("draw %d of a %s rejected: %s", attempt, kind, rejection)
            reasons[rejection.rule] += 1
    counts = ", ".join(f"{rule} ({count} x)" for rule, count in reasons.most_common())
    raise RoomError(
        f"none of {config.max_redraws + 1} draws of a {kind} was acceptable: {counts}; raise rooms.max_redraws or "
        "rooms.min_side_m, or lower rooms.min_free_floor_m2"
    )
