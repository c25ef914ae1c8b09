"""The track stage: draws points, follows them, finds where they are seen, keeps the best spread ones."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Int64

from perpetua.actors.types import ActorMesh
from perpetua.cameras.types import CameraPath
from perpetua.errors import TrackError
from perpetua.rendering.types import RenderedView
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed
from perpetua.tracks.candidates import ActorSurfaces, StaticSurfaces
from perpetua.tracks.config import TracksConfig
from perpetua.tracks.motion import MOVING_M, travel_m
from perpetua.tracks.queries import draw_queries, project_tracks
from perpetua.tracks.selection import seen_cells, spread
from perpetua.tracks.sides import SideTable
from perpetua.tracks.sight import HairFaces, SceneSight, hair_faces
from perpetua.tracks.surface import BoundPoints, SceneMeshes, SurfacePoints, bind, join_points
from perpetua.tracks.types import PointTracks, SequenceTracks
from perpetua.tracks.visibility import Sightings, visible_in_views

# Usable points per track wanted, before drawing stops.
SPARE = 1.5
SCANNED_FRAMES = 32


def make_tracks(
    room: Room,
    actors: tuple[ActorMesh, ...],
    cameras: tuple[CameraPath, ...],
    views: tuple[RenderedView, ...],
    config: TracksConfig,
    seed: StageSeed,
) -> SequenceTracks:
    """Tracks of a sequence: rigid points that never move, and points on actors that move more than 5 cm.

    Exactly ``round(config.dynamic_share * config.count)`` tracks move; how far is the largest distance between two of
    a track's positions. Every track is visible in at least ``config.min_visible`` (view, frame) pairs. The order of
    the tracks is random, so that any first part of them is a fair sample.

    Args:
        room: its meshes as rendered.
        actors: their meshes as rendered.
        cameras: one per view, in the order of the views.
        views: the rendered frames; arrays may lie on disk, and are read frame by frame.
        config: the tracks section of the config.
        seed: all randomness, the queries' own generator aside.

    Raises:
        TrackError: too few points are seen.
    """
    meshes = SceneMeshes.of(room, actors)
    collector = _Collector(meshes, hair_faces(actors), cameras, views, config, seed)
    moving = round(config.dynamic_share * config.count) if actors else 0
    surfaces = StaticSurfaces(meshes, cameras, views)
    still = collector.collect("static", config.count - moving, False, surfaces.draw)
    dynamic = collector.collect("dynamic", moving, True, ActorSurfaces(actors).draw)
    points = join_points([still, dynamic])
    points = points.take(seed.stream("order").permutation(len(points)))
    bound = bind(meshes, points)
    position_m = bound.position_m(len(views[0].depth_m))
    sightings = collector.look(bound, np.arange(len(position_m)))
    seen = project_tracks(position_m, cameras, sightings.visible)
    tracks = PointTracks(position_m, points.object_index, points.face, points.barycentric)
    return SequenceTracks(tracks, seen, draw_queries(seen), sightings.report)


class _Collector:
    """Draws points of one class until enough are seen often enough, then keeps the best spread ones."""

    def __init__(
        self,
        meshes: SceneMeshes,
        hair: HairFaces,
        cameras: tuple[CameraPath, ...],
        views: tuple[RenderedView, ...],
        config: TracksConfig,
        seed: StageSeed,
    ) -> None:
        self.meshes, self.cameras, self.views, self.config, self.seed = meshes, cameras, views, config, seed
        self.hair, self.sides, self.sight = hair, SideTable(meshes), SceneSight(meshes)
        # Candidates are looked at in some frames, even distances apart; what is seen often enough there, is.
        frames = len(views[0].depth_m)
        self.scanned = np.unique(np.linspace(0, frames - 1, SCANNED_FRAMES).round().astype(np.int64))

    def look(self, bound: BoundPoints, frames: Int64[np.ndarray, " S"]) -> Sightings:
        """Where points are visible at some frames."""
        sides = self.sides.of(bound.points)
        return visible_in_views(bound, sides, self.sight, self.hair, self.cameras, self.views, frames, self.config)

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
        bound = bind(self.meshes, points)
        visible = self.look(bound, self.scanned).visible
        usable = visible.sum(axis=(0, 1)) >= self.config.min_visible
        if moving:
            usable &= travel_m(bound.position_m(len(self.views[0].depth_m))) > MOVING_M
        return np.flatnonzero(usable), visible

    def _spread(
        self, name: str, wanted: int, points: SurfacePoints, visible: Bool[np.ndarray, "C S N"]
    ) -> SurfacePoints:
        cells = seen_cells(bind(self.meshes, points), self.cameras, self.scanned, visible)
        return points.take(spread(wanted, points.object_index, cells, self.seed.stream(name, "spread")))
