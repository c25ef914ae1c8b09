"""The motion source "clips": recorded motion from a user's folder, bent along the route."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from perpetua.actors.config import ClipsConfig, MotionConfig
from perpetua.actors.motion.path import RoutePath
from perpetua.actors.motion.recorded.body import body_along
from perpetua.actors.motion.recorded.library import clip_files, load_clip, ranked_clips
from perpetua.actors.motion.recorded.loop import neutral_pose, standing_part, stretched, walking_part
from perpetua.actors.motion.recorded.ride import MARGIN_S, going_along, make_clock, ride_along, rows_needed
from perpetua.actors.motion.recorded.tape import Tape, make_tape
from perpetua.actors.motion.source import MOTION_SOURCES
from perpetua.actors.types import BodyMotion, Route, Skeleton
from perpetua.assets import asset_folder
from perpetua.errors import AssetError
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed

# A body goes where its speed, turns on the spot included, exceeds this.
_GOING_MPS = 0.13
# Clips, best match first, that are searched for a part that walks or stands.
_MOST_TRIED = 24


@dataclass(frozen=True)
class _Chosen:
    """The part that is played along the route, and the one for pauses (None: a pose between strides)."""

    walking: Tape | None
    standing: Tape | None


@MOTION_SOURCES.register("clips")
class ClipMotion:
    """Cuts, loops, retimes and bends a recorded clip along the route, and plants its feet.

    The clip whose file name or index entry shares most words with the route's description is taken, else one drawn by
    the seed. Its longest walk carries the body along the route; its standing part, else that of the next clip that has
    one, is played while the route pauses.
    """

    def make(
        self, route: Route, skeleton: Skeleton, room: Room, fps: float, config: MotionConfig, seed: StageSeed
    ) -> BodyMotion:
        """See ``MotionSource.make``.

        Raises:
            AssetError: no folder, no clip, a clip that cannot be read, or none that walks although the route does.
        """
        from_start = config.clips.from_start
        clock = make_clock(len(route.heading_rad), fps, 0.0 if from_start else MARGIN_S)
        going = going_along(RoutePath(route, fps), clock)
        goes = bool((going.speed_mps > _GOING_MPS).any())
        rng = seed.stream("clips", route.actor)
        chosen = _choose(route, goes, skeleton, config.clips, rng)
        part = chosen.walking if chosen.walking is not None else chosen.standing
        if part is None:
            raise AssetError(_nothing_fits(config.clips, "stands or walks"))
        share = 0.0 if from_start else float(rng.uniform())
        tape = stretched(part, rows_needed(going, part, clock), skeleton, share)
        ride = ride_along(tape, going, clock)
        standing = neutral_pose(tape) if chosen.standing is None else chosen.standing
        return body_along(tape, standing, ride, going, clock, skeleton, route.actor, fps)


def clip_folder(config: ClipsConfig) -> Path:
    """Where the clips are."""
    return Path(config.folder).expanduser() if config.folder else asset_folder() / "motion" / "clips"


def _choose(route: Route, goes: bool, skeleton: Skeleton, config: ClipsConfig, rng: np.random.Generator) -> _Chosen:
    ranked = ranked_clips(clip_files(clip_folder(config)), route.description, rng)[:_MOST_TRIED]
    walking: Tape | None = None
    standing: Tape | None = None
    for path in ranked:
        tape = make_tape(load_clip(path, config.up), skeleton)
        walking = walking_part(tape) if walking is None else walking
        standing = standing_part(tape) if standing is None else standing
        if (walking is not None or not goes) and (standing is not None or walking is not None):
            break
    if goes and walking is None:
        raise AssetError(_nothing_fits(config, "walks for a second, and the route of an actor does"))
    return _Chosen(walking, standing)


def _nothing_fits(config: ClipsConfig, what: str) -> str:
    return (
        f"none of the clips in '{clip_folder(config)}' that fit best {what}: add a clip of somebody walking, "
        "or choose another actors.motion.source"
    )
