"""What a room source is."""

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from perpetua.registry import Registry
from perpetua.rooms.config import Daytime, RoomKind, RoomsConfig
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

# By day lamps are on in this share of rooms.
LAMPS_BY_DAY = 0.6


@dataclass(frozen=True)
class RoomWish:
    """What one draw of a room should be.

    ``size_m`` holds the sides along x and y and the height, to the centimetre; ``lamps_on`` whether lamps shine.
    """

    kind: RoomKind
    size_m: tuple[float, float, float]
    daytime: Daytime
    lamps_on: bool


def draw_wish(kind: RoomKind, config: RoomsConfig, rng: np.random.Generator) -> RoomWish:
    """Size, time of day and lamps of a room, within what the config allows."""
    x_m, y_m = rng.uniform(config.min_side_m, config.max_side_m, size=2)
    height_m = rng.uniform(config.min_height_m, config.max_height_m)
    daytime = config.daytimes[int(rng.integers(len(config.daytimes)))]
    shining = daytime != "day" or bool(rng.uniform() < LAMPS_BY_DAY)
    lamps_on = shining if config.lamps == "drawn" else config.lamps == "on"
    return RoomWish(kind, (round(float(x_m), 2), round(float(y_m), 2), round(float(height_m), 2)), daytime, lamps_on)


class RoomRejected(Exception):
    """This draw of a room is no use, and another may be; ``rule`` is the short name under which it is counted."""

    def __init__(self, rule: str, message: str) -> None:
        super().__init__(message)
        self.rule = rule


class RoomSource(Protocol):
    """Makes one room; the same arguments give the same room, bit for bit."""

    def draws(self, config: RoomsConfig) -> int | None:
        """How many different draws there are; None where they never end.

        Raises:
            InputError: the config asks for what this source cannot make.
        """
        ...

    def make(self, wish: RoomWish, config: RoomsConfig, seed: StageSeed, attempt: int, scratch: Path) -> Room:
        """A room as wished.

        Args:
            wish: kind, size and light of the room; a source that cannot choose them leaves them aside.
            config: the rooms section of the config.
            seed: all randomness comes from ``seed.stream(..., attempt)``.
            attempt: 0 for the first draw, counted up for each rejected one.
            scratch: folder for files of the room; a .blend that the room keeps must lie in it.

        Raises:
            RoomRejected: this draw is no use and another may be.
            RoomError: no draw can succeed.
        """
        ...


ROOM_SOURCES: Registry[type[RoomSource]] = Registry(
    "rooms.source",
    "perpetua.room_sources",
    {
        "infinigen": "perpetua.rooms.infinigen:InfinigenRooms",
        "procedural": "perpetua.rooms.procedural:ProceduralRooms",
        "file": "perpetua.rooms.files.source:SceneFileRooms",
    },
)
