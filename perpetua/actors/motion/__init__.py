"""Full-body motion: importing this package enters every motion source in ``MOTION_SOURCES``."""

from perpetua.actors.motion import clips, kimodo, procedural
from perpetua.actors.motion.plan import make_motions
from perpetua.actors.motion.source import MOTION_SOURCES, MotionSource

__all__ = ["MOTION_SOURCES", "MotionSource", "clips", "kimodo", "make_motions", "procedural"]
