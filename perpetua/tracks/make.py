"""The track stage: draws points, follows them, finds where they are seen, keeps the best spread ones."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Int64

from perpetua.errors import TrackError
from perpetua.seeding import StageSeed
from perpetua.tracks.candidates import ActorSurfaces, StaticSurfaces
from perpetua.tracks.follow import TrackScene
from perpetua.tracks.motion import MOVING_M, travel_m
from perpetua.tracks.selection import seen_cells, spread
from perpetua.tracks.surface import SurfacePoints, join_points
from perpetua.tracks.types import SequenceTracks

# Usable points per track wanted, before drawing stops.
SPARE = 1.5
SCANNED_FRAMES = 32


def make_tracks(scene: TrackScene, seed: StageSeed) -> SequenceTracks:
    """Tracks of a sequence: rigid points that never move, and points on actors that move more than 5 cm.

    Exactly ``round(dynamic_share * count)`` tracks move; how far is the largest distance between two of a track's
    positions. Every track is visible in at least ``min_visible`` (view, frame) pairs. The order of the tracks is
    random, so that any first part of them is a fair sample.

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
        groups: list[SurfacePoints] = []
        seen: list[Bool[np.ndarray, "C S N"]] = []
        drawn = found = 0
        for attempt in range(self.config.max_draws):
            points = draw(int(np.ceil(self.config.candidates * wanted)), self.seed.stream(name, attempt))
            usable, visible = self._usable(points, moving)
            groups.append(points.take(usable))
            seen.append(visible[:, :, usable])
            drawn, found = drawn + len(points), found + len(usable)
            if found >= enough:
                break
        if found < wanted:
            raise TrackError(
                f"{wanted} {name} tracks are wanted, and of {drawn} points drawn only {found} are seen in at least "
                f"{self.config.min_visible} images{f' and move more than {MOVING_M} m' if moving else ''}: lower "
                "tracks.count, tracks.dynamic_share or tracks.min_visible, or raise tracks.max_draws"
            )
        return self._spread(name, wanted, join_points(groups), np.concatenate(seen, axis=2))

    def _usable(self, points: SurfacePoints, moving: bool) -> tuple[Int64[np.ndarray, " M"], Bool[np.ndarray, "C S N"]]:
        bound = self.scene.bind(points)
        visible = self.scene.look(bound, self.scanned).visible
        usable = visible.sum(axis=(0, 1)) >= self.config.min_visible
        if moving:
            usable &= travel_m(bound.position_m(self.scene.frames)) > MOVING_M
        return np.flatnonzero(usable), visible

    def _spread(
        self, name: str, wanted: int, points: SurfacePoints, visible: Bool[np.ndarray, "C S N"]
    ) -> SurfacePoints:
        cells = seen_cells(self.scene.bind(points), self.scene.cameras, self.scanned, visible)
        return points.take(spread(wanted, points.object_index, cells, self.seed.stream(name, "spread")))
