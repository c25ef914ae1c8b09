"""Who does what: an action description in plain words for each actor, and the paces it goes at."""

import logging
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import yaml

from perpetua.errors import ConfigError
from perpetua.motion.actions import stated_paces, wants_seat
from perpetua.motion.config import MotionConfig
from perpetua.resources import ACTION_FOLDER
from perpetua.routes.config import PaceShares
from perpetua.scene.actor import PACES
from perpetua.seeding import StageSeed

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Role:
    """What an actor does, in plain words; ``paces`` it may go at, of ``PACES``; whether it sits down."""

    description: str
    paces: tuple[str, ...]
    sits: bool


@dataclass(frozen=True)
class _Line:
    """A description, and what its words say of pace and sitting."""

    words: str
    paces: frozenset[str]
    sits: bool

    @classmethod
    def read(cls, words: str) -> "_Line":
        return cls(words, stated_paces(words), wants_seat(words))


def cast_actors(
    count: int, config: MotionConfig, fractions: PaceShares, seats: int, seed: StageSeed
) -> tuple[Role, ...]:
    """A role for each actor, no two alike while the list lasts.

    Each actor draws a pace by its share, then the next description of a shuffled list that states this pace, or none;
    where none is left, words win over shares. Descriptions given in ``config.descriptions`` are all used in turn.

    Args:
        count: number of actors.
        config: where descriptions come from.
        fractions: how often each pace is drawn.
        seats: how many actors can sit down in the room; no more get descriptions that ask for a seat.
        seed: all randomness comes from ``seed.stream("actions")`` and ``seed.stream("pace", actor)``.

    Raises:
        ConfigError: ``actors.motion.actions`` names no list of descriptions.
    """
    lines = [_Line.read(words) for words in action_descriptions(config)]
    order = seed.stream("actions").permutation(len(lines))
    waiting: list[_Line] = []
    roles: list[Role] = []
    for actor in range(count):
        waiting = waiting or [lines[index] for index in order]
        pace = _draw_pace(fractions, seed, actor)
        free_seats = seats - sum(role.sits for role in roles)
        line = waiting[0] if config.descriptions else _choose(waiting, pace, free_seats)
        waiting.remove(line)
        if line.sits and free_seats <= 0:
            logger.warning("no seat is left for '%s' in this room, so actor %d stays on its feet", line.words, actor)
        paces = tuple(name for name in PACES if name in line.paces) or (pace,)
        roles.append(Role(line.words, paces, line.sits and free_seats > 0))
    return tuple(roles)


def _draw_pace(fractions: PaceShares, seed: StageSeed, actor: int) -> str:
    weights = [getattr(fractions, pace) for pace in PACES]
    drawn = seed.stream("pace", actor).choice(len(PACES), p=[weight / sum(weights) for weight in weights])
    return PACES[int(drawn)]


def _choose(waiting: list[_Line], pace: str, free_seats: int) -> _Line:
    """The first line that suits; nobody jogs or stands about at what could be said of a walker."""
    possible = [line for line in waiting if free_seats > 0 or not line.sits] or waiting
    stating = [line for line in possible if pace in line.paces]
    silent = [line for line in possible if not line.paces]
    suitable = (stating or silent) if pace in ("stand", "jog") else stating + silent
    return min(suitable or possible, key=waiting.index)


def action_descriptions(config: MotionConfig) -> tuple[str, ...]:
    """The descriptions that actions are drawn from.

    Raises:
        ConfigError: ``actors.motion.actions`` names no list, or the list is not one of descriptions.
    """
    if config.descriptions:
        return config.descriptions
    lists = {path.stem: path for path in sorted(ACTION_FOLDER.glob("*.yaml"))}
    if config.actions not in lists:
        raise ConfigError(f"actors.motion.actions must be one of {list(lists)}, not '{config.actions}'")
    path = lists[config.actions]
    return _read_list(path, path.stat().st_mtime_ns)


@lru_cache
def _read_list(path: Path, changed_ns: int) -> tuple[str, ...]:
    """Every room's keys depend on a list: it is parsed once, not once per room."""
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    if not isinstance(content, list) or not content or not all(isinstance(line, str) for line in content):
        raise ConfigError(f"'{path}' must be a list of action descriptions in plain words, one a line")
    return tuple(content)
