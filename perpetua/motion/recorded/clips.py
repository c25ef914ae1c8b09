"""The motion source "clips": recorded motion from a user's folder, bent along the route."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from perpetua.errors import AssetError
from perpetua.machine.assets import asset_folder, file_listing
from perpetua.motion.clock import MARGIN_S, make_clock
from perpetua.motion.config import ClipsConfig, MotionConfig
from perpetua.motion.path import RoutePath
from perpetua.motion.recorded.body import WarpedClip, body_along
from perpetua.motion.recorded.library import clip_files, load_clip, ranked_clips
from perpetua.motion.recorded.loop import neutral_pose, standing_part, stretched, walking_part
from perpetua.motion.recorded.reference import ReferenceTrajectory, reference_along
from perpetua.motion.recorded.retargeted import RetargetedClip, retarget
from perpetua.motion.recorded.time_warp import fit_time_warp, rows_needed
from perpetua.scene.actor import BodyMotion, Route, Skeleton
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

# A body goes where its speed, turns on the spot included, exceeds this.
_GOING_MPS = 0.13
# Clips, best match first, that are searched for a part that walks or stands.
_MOST_TRIED = 12
# Paces whose ratio is within this are one, as a natural logarithm: three quarters to four thirds.
_SAME_PACE = 0.29


@dataclass(frozen=True)
class _Chosen:
    """The part that is played along the route, and the one for pauses (None: a pose between strides)."""

    walking: RetargetedClip | None
    standing: RetargetedClip | None


class ClipMotion:
    """Cuts, loops, retimes and bends a recorded clip along the route, and plants its feet.

    The clip whose file name or index entry shares most words with the route's description is taken; of several, one
    drawn by the seed that walks about as fast as the route goes. Its longest walk carries the body along the route; its
    standing part, if it has one, is played while the route pauses.
    """

    def check(self, config: MotionConfig) -> None:
        """The folder must hold clips.

        Raises:
            AssetError: there is no folder, no clip in it, or its index is not valid.
        """
        clip_files(clip_folder(config.clips))

    def make(
        self, route: Route, skeleton: Skeleton, room: Room, fps: float, config: MotionConfig, seed: StageSeed
    ) -> BodyMotion:
        """See ``MotionSource.make``.

        Raises:
            AssetError: no folder, no clip, a clip that cannot be read, or none that walks although the route does.
        """
        from_start = config.clips.from_start
        clock = make_clock(len(route.heading_rad), fps, 0.0 if from_start else MARGIN_S)
        reference = reference_along(RoutePath(route, fps), clock)
        chosen = _choose(route, reference, skeleton, config.clips, seed.stream("clips", route.actor))
        part = chosen.walking if chosen.walking is not None else chosen.standing
        if part is None:
            raise AssetError(_nothing_fits(config.clips, "stands or walks"))
        start_fraction = 0.0 if from_start else float(seed.stream("clip start", route.actor).uniform())
        retargeted = stretched(part, rows_needed(reference, part, clock), skeleton, start_fraction)
        warp = fit_time_warp(retargeted, reference, clock)
        standing = neutral_pose(retargeted) if chosen.standing is None else chosen.standing
        return body_along(WarpedClip(retargeted, standing, warp), reference, clock, skeleton, route.actor)


def clip_folder(config: ClipsConfig) -> Path:
    """Where the clips are."""
    return Path(config.folder).expanduser() if config.folder else asset_folder() / "motion" / "clips"


def clip_listing(config: MotionConfig) -> list[str]:
    """Name, size and time of change of all that the source may read; empty for other sources or without a folder."""
    return file_listing(clip_folder(config.clips)) if config.source == "clips" else []


def _choose(
    route: Route, reference: ReferenceTrajectory, skeleton: Skeleton, config: ClipsConfig, rng: np.random.Generator
) -> _Chosen:
    """The first group of clips that fit equally well and hold what is needed decides, in it the nearest pace."""
    goes = reference.speed_mps[reference.speed_mps > _GOING_MPS]
    wanted_mps = float(np.median(goes)) if len(goes) > 0 else None
    walking: RetargetedClip | None = None
    standing: RetargetedClip | None = None
    nearest, left = np.inf, _MOST_TRIED
    for group in ranked_clips(clip_files(clip_folder(config)), route.description, rng):
        for path in group[:left]:
            left -= 1
            retargeted = retarget(load_clip(path, config.up), skeleton)
            standing = standing_part(retargeted) if standing is None else standing
            walk = walking_part(retargeted)
            apart = _pace_apart(walk, wanted_mps)
            walking, nearest = (walk, apart) if apart < nearest else (walking, nearest)
            if nearest < _SAME_PACE:
                return _Chosen(walking, standing)
        if walking is not None or left == 0 or (wanted_mps is None and standing is not None):
            break
    if wanted_mps is not None and walking is None:
        raise AssetError(_nothing_fits(config, "walks for a second, and the route of an actor does"))
    return _Chosen(walking, standing)


def _pace_apart(walk: RetargetedClip | None, wanted_mps: float | None) -> float:
    """Natural logarithm of the ratio of paces; infinite for what does not walk."""
    if walk is None:
        return float("inf")
    return 0.0 if wanted_mps is None else abs(float(np.log(np.median(walk.speed_mps) / wanted_mps)))


def _nothing_fits(config: ClipsConfig, what: str) -> str:
    return (
        f"none of the clips in '{clip_folder(config)}' that fit best {what}: add a clip of somebody walking, "
        "or choose another actors.motion.source"
    )
