"""Who does what: an action description in plain words for each actor."""

from pathlib import Path

import yaml

from perpetua.actors.config import MotionConfig
from perpetua.errors import ConfigError
from perpetua.seeding import StageSeed

ACTION_FOLDER = Path(__file__).parents[2] / "configs" / "actions"


def draw_descriptions(count: int, config: MotionConfig, seed: StageSeed) -> tuple[str, ...]:
    """An action description for each actor, no two alike while the list lasts.

    Raises:
        ConfigError: ``actors.motion.actions`` names no list of descriptions.
    """
    descriptions = action_descriptions(config)
    order = seed.stream("actions").permutation(len(descriptions))
    return tuple(descriptions[order[actor % len(order)]] for actor in range(count))


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
    content = yaml.safe_load(lists[config.actions].read_text(encoding="utf-8"))
    if not isinstance(content, list) or not content or not all(isinstance(line, str) for line in content):
        path = lists[config.actions]
        raise ConfigError(f"'{path}' must be a list of action descriptions in plain words, one a line")
    return tuple(content)
