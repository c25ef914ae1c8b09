"""What a motion source is."""

from typing import Protocol

from perpetua.motion.config import MotionConfig
from perpetua.registry import Registry
from perpetua.scene.actor import BodyMotion, Route, Skeleton
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed


class MotionSource(Protocol):
    """Makes full-body motion along a route; the same arguments give the same motion, bit for bit."""

    def check(self, config: MotionConfig) -> None:
        """Passes a config that motion can be made with; nothing is made.

        Raises:
            AssetError: files or a program that it needs are missing.
        """
        ...

    def make(
        self, route: Route, skeleton: Skeleton, room: Room, fps: float, config: MotionConfig, seed: StageSeed
    ) -> BodyMotion:
        """Motion of one actor, one frame per frame of the route.

        Args:
            route: the floor path of the body's axis, its heading, what the actor does in plain words, its pauses.
            skeleton: the bones of the body that will carry the motion.
            room: what the actor moves in: the floor under its feet, seats to sit on.
            fps: frames per second of the route.
            config: the motion section of the config.
            seed: all randomness comes from ``seed.stream(..., route.actor)``.
        """
        ...


MOTION_SOURCES: Registry[type[MotionSource]] = Registry(
    "actors.motion.source",
    "perpetua.motion_sources",
    {
        "procedural": "perpetua.motion.procedural:ProceduralMotion",
        "clips": "perpetua.motion.recorded.clips:ClipMotion",
        "kimodo": "perpetua.motion.recorded.kimodo:KimodoMotion",
    },
)
