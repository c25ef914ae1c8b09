"""The motion of every actor along its route."""

from perpetua.motion.arm_avoidance import clear_arms
from perpetua.motion.config import MotionConfig
from perpetua.motion.source import MOTION_SOURCES
from perpetua.scene.actor import BodyMotion, Route, Skeleton
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed


def make_motions(
    routes: tuple[Route, ...],
    skeletons: tuple[Skeleton, ...],
    room: Room,
    fps: float,
    config: MotionConfig,
    seed: StageSeed,
) -> tuple[BodyMotion, ...]:
    """The motion of every actor along its route, with arms kept off the room and each other.

    Args:
        routes: one per actor.
        skeletons: the bones of each actor's body, in the order of the routes.
        room: what the actors move in.
        fps: frames per second of the routes.
        config: the motion section of the config.
        seed: sources draw from streams of their own.

    Raises:
        ConfigError: an unknown motion source.
    """
    source = MOTION_SOURCES[config.source]()
    made = tuple(
        source.make(route, skeleton, room, fps, config, seed) for route, skeleton in zip(routes, skeletons, strict=True)
    )
    return clear_arms(made, skeletons, room)
