"""Motion of people who look at the floor."""

from dataclasses import replace

from scipy.spatial.transform import Rotation

from perpetua.motion.config import MotionConfig
from perpetua.motion.source import MOTION_SOURCES
from perpetua.scene.actor import BODY_JOINTS, BodyMotion, Route, Skeleton
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

BOW_RAD = 0.2


class Bowed:
    """Walks of the built-in source, with the head bowed."""

    def check(self, config: MotionConfig) -> None:
        """Nothing is needed; a source that needs files raises AssetError here, before any work is done."""

    def make(
        self, route: Route, skeleton: Skeleton, room: Room, fps: float, config: MotionConfig, seed: StageSeed
    ) -> BodyMotion:
        """Motion of one actor, one frame per frame of the route."""
        motion = MOTION_SOURCES["procedural"]().make(route, skeleton, room, fps, config, seed)
        world_from_joint = motion.world_from_joint.copy()
        world_from_joint[:, BODY_JOINTS.index("head")] @= Rotation.from_euler("y", BOW_RAD).as_matrix()
        return replace(motion, world_from_joint=world_from_joint)
