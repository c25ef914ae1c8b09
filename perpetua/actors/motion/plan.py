"""Who does what: an action description for each actor, then its motion."""

from pathlib import Path

import yaml

from perpetua.actors.config import MotionConfig
from perpetua.actors.motion.source import MOTION_SOURCES
from perpetua.actors.types import BodyMotion, Route, Skeleton
from perpetua.errors import ConfigError
from perpetua.seeding import StageSeed

ACTION_FOLDER = Path(__file__).parents[3] / "configs" / "actions"


def draw_actions(actors: tuple[int, ...], config: MotionConfig, seed: StageSeed) -> tuple[str, ...]:
    """An action description for each actor, no two alike while the list lasts.

    Raises:
        ConfigError: ``actors.motion.actions`` names no list of descriptions.
    """
    descriptions = action_descriptions(config)
    order = seed.stream("actions").permutation(len(descriptions))
    return tuple(descriptions[order[actor % len(order)]] for actor in actors)


def make_motions(
    routes: tuple[Route, ...], skeletons: tuple[Skeleton, ...], fps: float, config: MotionConfig, seed: StageSeed
) -> tuple[BodyMotion, ...]:
    """The motion of every actor along its route.

    Args:
        routes: one per actor.
        skeletons: the bones of each actor's body, in the order of the routes.
        fps: frames per second of the routes.
        config: the motion section of the config.
        seed: actions are drawn from ``seed.stream("actions")``; sources draw for themselves.

    Raises:
        ConfigError: an unknown motion source or list of actions.
    """
    source = MOTION_SOURCES[config.source]()
    actions = draw_actions(tuple(route.actor for route in routes), config, seed)
    return tuple(
        source.make(route, skeleton, action, fps, config, seed)
        for route, skeleton, action in zip(routes, skeletons, actions, strict=True)
    )


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
