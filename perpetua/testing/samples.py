"""What the conformance suites need to know of an implementation: the files and settings it works on, and its cost.

An implementation that works with the default settings needs no sample. Samples lie in tables by name, in a module with
any of ``ROOM_SAMPLES``, ``BODY_SAMPLES``, ``MOTION_SAMPLES`` and ``EXPORTER_SAMPLES``: for what comes with Perpetua
``perpetua.testing.built_in_samples``, for a package the module of its entry point.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import pytest

from perpetua.actors.config import ActorsConfig
from perpetua.motion.config import MotionConfig
from perpetua.rooms.config import RoomKind, RoomsConfig

# Each writes what an implementation reads into a folder, and returns the settings that use it.
BodySample = Callable[[Path], ActorsConfig]
MotionSample = Callable[[Path], MotionConfig]


def default_rooms(source: str, kind: RoomKind, folder: Path) -> RoomsConfig:
    """The default settings, for one source and kind."""
    return RoomsConfig(source=source, kinds=(kind,))


@dataclass(frozen=True)
class RoomSample:
    """Which kinds are made, with which config, and how costly that is.

    ``config`` gets the source's name, the kind, and a folder for what the source works on. ``made_kind`` is the kind of
    all rooms of a source that makes none of those that can be asked for: nothing says how these are furnished.
    ``many_draws``: drawing twice more is no burden.
    """

    kinds: tuple[RoomKind, ...] = get_args(RoomKind)
    config: Callable[[str, RoomKind, Path], RoomsConfig] = default_rooms
    marks: tuple[pytest.MarkDecorator, ...] = ()
    made_kind: str | None = None
    many_draws: bool = True


@dataclass(frozen=True)
class ExporterSample:
    """``repeatable``: equal sequences give equal bytes. ``marks`` say how costly it is."""

    repeatable: bool = True
    marks: tuple[pytest.MarkDecorator, ...] = ()
