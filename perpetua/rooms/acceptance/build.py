"""Draws rooms until one is acceptable."""

import logging
from collections import Counter
from dataclasses import asdict
from pathlib import Path

from perpetua.errors import InputError, PerpetuaError, RoomError
from perpetua.io.files import read_json, write_json
from perpetua.navigation.config import NavigationConfig
from perpetua.rooms.acceptance.checks import RoomFigures, check_room
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.rooms.infinigen import COLLIDER_GAP_FILE
from perpetua.rooms.source import ROOM_SOURCES, RoomRejected, RoomWish, draw_wish
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

logger = logging.getLogger(__name__)

# Figures of the room that was accepted and the reasons of those that were not, in the folder of its stage.
REPORT_FILE = "report.json"


def check_source(config: RoomsConfig) -> None:
    """Passes a config whose source exists and has what it needs.

    Raises:
        InputError: there is no such source, or it cannot make what is asked for.
    """
    ROOM_SOURCES[config.source]().draws(config)


def build_room(config: RoomsConfig, navigation: NavigationConfig, seed: StageSeed, scratch: Path) -> Room:
    """Draws rooms from the configured source until one passes ``check_room``.

    Raises:
        RoomError: ``rooms.max_redraws`` further draws were rejected too; the reasons are counted in the message.
        InputError: the user gave the source a number of scenes, and each was rejected; the message says why.
    """
    source = ROOM_SOURCES[config.source]()
    limit = source.draws(config)
    attempts = config.max_redraws + 1 if limit is None else min(limit, config.max_redraws + 1)
    kind = config.kinds[int(seed.stream("kind").integers(len(config.kinds)))]
    rejections: list[RoomRejected] = []
    for attempt in range(attempts):
        wish = draw_wish(kind, config, seed.stream("wish", attempt))
        try:
            room = source.make(wish, config, seed, attempt, scratch)
            figures = check_room(room, config, navigation)
        except RoomRejected as rejection:
            logger.info("draw %d of a %s rejected: %s", attempt, kind, rejection)
            rejections.append(rejection)
            continue
        _write_report(scratch, room, wish, figures, rejections)
        return room
    raise _give_up(rejections, kind, limit)


def _write_report(
    scratch: Path, room: Room, wish: RoomWish, figures: RoomFigures, rejections: list[RoomRejected]
) -> None:
    """What a person wants to know of a finished room, in its stage's folder."""
    report = {
        "kind": room.kind,
        "wish": asdict(wish),
        "objects": len(room.objects),
        **asdict(figures),
        "redraws": [{"rule": rejection.rule, "reason": str(rejection)} for rejection in rejections],
    }
    gap = scratch / COLLIDER_GAP_FILE
    if gap.is_file():
        report["collider_gap"] = read_json(gap)
        gap.unlink()
    write_json(scratch / REPORT_FILE, report)


def _give_up(rejections: list[RoomRejected], kind: RoomKind, limit: int | None) -> PerpetuaError:
    if limit is not None:
        reasons = "\n".join(str(rejection) for rejection in rejections)
        return InputError(f"no room came of {len(rejections)} of {limit} scene(s):\n{reasons}")
    counted = Counter(rejection.rule for rejection in rejections).most_common()
    counts = ", ".join(f"{rule} ({count} x)" for rule, count in counted)
    return RoomError(
        f"none of {len(rejections)} draws of a {kind} was acceptable: {counts}; raise rooms.max_redraws or "
        "rooms.min_side_m, or lower rooms.min_free_floor_m2"
    )
