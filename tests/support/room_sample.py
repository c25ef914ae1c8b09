"""What the conformance suite asks of a room source: all kinds with the defaults, unless the source brings a sample.

A source that needs something to work on, or time, has a module ``room_sample_<its name>`` beside this one, with a
``SAMPLE``.
"""

import importlib
import importlib.util
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import pytest

from perpetua.rooms.config import RoomKind, RoomsConfig


def _defaults(source: str, kind: RoomKind, folder: Path) -> RoomsConfig:
    return RoomsConfig(source=source, kinds=(kind,))


@dataclass(frozen=True)
class RoomSample:
    """Which kinds are made, with which config, and how costly that is.

    ``config`` gets the source's name, the kind, and a folder for what the source works on. ``many_draws``: drawing
    twice more is no burden.
    """

    kinds: tuple[RoomKind, ...] = get_args(RoomKind)
    config: Callable[[str, RoomKind, Path], RoomsConfig] = _defaults
    marks: tuple[pytest.MarkDecorator, ...] = ()
    many_draws: bool = True


def sample_of(source: str) -> RoomSample:
    """The source's own sample, or the usual one."""
    name = f"room_sample_{source}"
    if importlib.util.find_spec(name) is None:
        return RoomSample()
    sample = importlib.import_module(name).SAMPLE
    assert isinstance(sample, RoomSample)
    return sample
