"""One actor with all that it is measured against."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from perpetua.actors.checks.penetration import Probe, make_probe
from perpetua.motion.kinematics import joint_positions
from perpetua.scene.actor import ActorMesh, BodyMotion, Route, Skeleton


@dataclass(frozen=True)
class CheckedActor:
    """One actor with all that it is measured against, and the vertices that are checked."""

    actor: ActorMesh
    motion: BodyMotion
    skeleton: Skeleton
    route: Route
    joint_m: Float64[np.ndarray, "T 22 3"]
    probe: Probe


def checked_actor(
    actor: ActorMesh, motion: BodyMotion, skeleton: Skeleton, route: Route, frames: Int64[np.ndarray, " K"], count: int
) -> CheckedActor:
    """An actor, and ``count`` of its vertices to be checked in some frames."""
    joint_m = joint_positions(motion, skeleton)
    return CheckedActor(actor, motion, skeleton, route, joint_m, make_probe(actor, joint_m, frames, count))
