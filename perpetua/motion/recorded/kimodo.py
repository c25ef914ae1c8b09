"""The motion source "kimodo": NVIDIA's Kimodo makes motion from words along the route; its feet are planted."""

import numpy as np

from perpetua.errors import ActorError
from perpetua.motion.clock import make_clock
from perpetua.motion.config import KimodoConfig, MotionConfig
from perpetua.motion.path import RoutePath
from perpetua.motion.recorded.body import WarpedClip, body_along
from perpetua.motion.recorded.clip import Clip
from perpetua.motion.recorded.kimodo_files import KIMODO_FPS, LEAD_S, KimodoRequest, make_request
from perpetua.motion.recorded.kimodo_program import generate, kimodo_program
from perpetua.motion.recorded.reference import reference_facing
from perpetua.motion.recorded.retargeted import retarget
from perpetua.motion.recorded.time_warp import no_warp
from perpetua.scene.actor import BodyMotion, Route, Skeleton
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

_SEEDS = 2**31


class KimodoMotion:
    """Asks Kimodo for what is described along the route, and lays the answer on it.

    Kimodo (https://github.com/nv-tlabs/kimodo, Apache-2.0; its models have licences of their own) is installed and
    run by the user; about 17 GB of GPU memory are needed. Results are kept under ``cache/kimodo`` in the asset folder.
    """

    def check(self, config: MotionConfig) -> None:
        """The program must be there, and its model one whose motion can be read.

        Raises:
            AssetError: it is not.
        """
        kimodo_program(config.kimodo)

    def make(
        self, route: Route, skeleton: Skeleton, room: Room, fps: float, config: MotionConfig, seed: StageSeed
    ) -> BodyMotion:
        """See ``MotionSource.make``.

        Raises:
            AssetError: the program is missing, fails or takes too long, or its files cannot be used.
            ActorError: the generated path is too far from the route.
        """
        path = RoutePath(route, fps)
        request = make_request(route.description, path)
        clip = generate(request, config.kimodo, int(seed.stream("kimodo", route.actor).integers(_SEEDS)))
        _check_path(clip, request, route.actor, config.kimodo)
        # Whole frames within what was made beyond the ends of the route.
        margin_s = np.floor(LEAD_S * fps) / fps
        clock = make_clock(len(route.heading_rad), fps, margin_s, margin_s)
        retargeted, warp = retarget(clip, skeleton), no_warp(clock, LEAD_S)
        reference = reference_facing(path, clock, retargeted, warp.row)
        return body_along(WarpedClip(retargeted, None, warp), reference, clock, skeleton, route.actor)


def _check_path(clip: Clip, request: KimodoRequest, actor: int, config: KimodoConfig) -> None:
    """Raises ActorError where the pelvis strays from the path that was asked for."""
    frames = min(len(clip.pelvis), len(request.place_m))
    away_m = np.linalg.norm(clip.pelvis[:frames, :2] - request.place_m[:frames, :2], axis=1)
    farthest = int(away_m.argmax())
    if away_m[farthest] > config.max_path_error_m:
        raise ActorError(
            f"Kimodo's motion of actor {actor} strays {away_m[farthest]:.2f} m from its route "
            f"{farthest / KIMODO_FPS - LEAD_S:.1f} s after its beginning; at most {config.max_path_error_m:g} m is "
            "allowed: choose another seed, simpler words, or raise actors.motion.kimodo.max_path_error_m"
        )
