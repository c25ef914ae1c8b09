"""The track stage: draws points, follows them, finds where they are seen, keeps the best spread ones."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from perpetua.errors import TrackError
from perpetua.seeding import StageSeed
from perpetua.tracks.candidates import ActorSurfaces, StaticSurfaces
from perpetua.tracks.follow import TrackScene
from perpetua.tracks.motion import MOVING_M, is_fast, travel_m
from perpetua.tracks.selection import seen_cells, spread
from perpetua.tracks.surface import SurfacePoints, join_points
from perpetua.tracks.types import SequenceTracks

# Usable points per track wanted, before drawing stops.
SPARE = 1.5
SCANNED_FRAMES = 32
# Points whose positions at all frames are in memory at a time.
MOTION_BLOCK = 16_384


def make_tracks(scene: TrackScene, seed: StageSeed) -> SequenceTracks:
    """Tracks of a sequence: rigid points that never move, and points on actors that move more than 5 cm.

    Exactly ``round(dynamic_share * count)`` tracks move; how far is the largest distance between two of a track's
    positions. At least ``round(fast_share * count)`` of them are fast, or as many as were found. Every track is
    visible in at least ``min_visible`` (view, frame) pairs. The order of the tracks is random, so that any first part
    of them is a fair sample.

    Args:
        scene: what is followed, with the settings.
        seed: all randomness, the queries' own generator aside.

    Raises:
        TrackError: too few points are seen.
    """
    collector = _Collector(scene, seed)
    config = scene.config
    moving = round(config.dynamic_share * config.count) if scene.actors else 0
    surfaces = StaticSurfaces(scene.meshes, scene.cameras, scene.views)
    still = collector.collect("static", config.count - moving, False, surfaces.draw)
    dynamic = collector.collect("dynamic", moving, True, ActorSurfaces(scene.actors).draw)
    points = join_points([still, dynamic])
    return scene.follow(points.take(seed.stream("order").permutation(len(points))))


class _Collector:
    """Draws points of one class until enough are seen often enough, then keeps the best spread ones."""

    def __init__(self, scene: TrackScene, seed: StageSeed) -> None:
        self.scene, self.config, self.seed = scene, scene.config, seed
        # Candidates are looked at in some frames, even distances apart; what is seen often enough there, is.
        self.scanned = np.unique(np.linspace(0, scene.frames - 1, SCANNED_FRAMES).round().astype(np.int64))

    def collect(
        self,
        name: str,
        wanted: int,
        moving: bool,
        draw: Callable[[int, np.random.Generator], SurfacePoints],
    ) -> SurfacePoints:
        """``wanted`` points of a class.

        Raises:
            TrackError: ``tracks.max_draws`` rounds did not give enough.
        """
        if wanted == 0:
            return join_points([])
        enough = int(np.ceil(SPARE * wanted))
        groups: list[_Candidates] = []
        drawn = found = 0
        for attempt in range(self.config.max_draws):
            points = draw(int(np.ceil(self.config.candidates * wanted)), self.seed.stream(name, attempt))
            groups.append(self._usable(points, moving))
            drawn, found = drawn + len(points), found + len(groups[-1].points)
            if found >= enough:
                break
        if found < wanted:
            raise TrackError(
                f"{wanted} {name} tracks are wanted, and of {drawn} points drawn only {found} are seen in at least "
                f"{self.config.min_visible} images{f' and move more than {MOVING_M} m' if moving else ''}: lower "
                "tracks.count, tracks.dynamic_share or tracks.min_visible, or raise tracks.max_draws"
            )
        return self._spread(name, wanted, _Candidates.join(groups))

    def _usable(self, points: SurfacePoints, moving: bool) -> "_Candidates":
        visible = self.scene.look(self.scene.bind(points), self.scanned).visible
        usable = visible.sum(axis=(0, 1)) >= self.config.min_visible
        fast = np.zeros(len(points), bool)
        if moving:
            moves, fast = self._motion(points)
            usable &= moves
        return _Candidates(points.take(usable), visible[:, :, usable], fast[usable])

    def _motion(self, points: SurfacePoints) -> tuple[Bool[np.ndarray, " N"], Bool[np.ndarray, " N"]]:
        """Which points move, and which are fast."""
        moves, fast = np.zeros(len(points), bool), np.zeros(len(points), bool)
        for start in range(0, len(points), MOTION_BLOCK):
            block = slice(start, start + MOTION_BLOCK)
            position_m = self.scene.bind(points.take(np.arange(len(points))[block])).position_m(self.scene.frames)
            reach_m = travel_m(position_m)
            moves[block], fast[block] = reach_m > MOVING_M, is_fast(position_m, reach_m)
        return moves, fast

    def _spread(self, name: str, wanted: int, found: "_Candidates") -> SurfacePoints:
        points = found.points
        cells = seen_cells(self.scene.bind(points), self.scene.cameras, self.scanned, found.visible)
        least = round(self.config.fast_share * self.config.count)
        rng = self.seed.stream(name, "spread")
        return points.take(spread(wanted, points.object_index, cells, rng, found.fast, least))


@dataclass(frozen=True)
class _Candidates:
    """Points that may become tracks, where they were seen at the frames looked at, and which are fast."""

    points: SurfacePoints
    visible: Bool[np.ndarray, "C S N"]
    fast: Bool[np.ndarray, " N"]

    @classmethod
    def join(cls, groups: list["_Candidates"]) -> "_Candidates":
        return cls(
            join_points([group.points for group in groups]),
            np.concatenate([group.visible for group in groups], axis=2),
            np.concatenate([group.fast for group in groups]),
        )
