"""Follows points of a scene: where they are at each frame, where they are seen, and where they are asked for."""

import numpy as np
from jaxtyping import Int64

from perpetua.scene.scene import Scene
from perpetua.tracks.config import TracksConfig
from perpetua.tracks.queries import draw_queries, project_tracks
from perpetua.tracks.ray_caster import SceneRayCaster, hair_faces
from perpetua.tracks.surface import BoundPoints, SceneMeshes, SurfacePoints, bind
from perpetua.tracks.types import PointTracks, SequenceTracks
from perpetua.tracks.visibility import ViewVisibility, visible_in_views
from perpetua.tracks.watertight import WatertightTable


class TrackScene:
    """Everything that decides where a point is seen.

    Args:
        scene: meshes as rendered, cameras, and the rendered views; arrays may lie on disk, and are read frame by frame.
        config: the tracks section of the config.
    """

    def __init__(self, scene: Scene, config: TracksConfig) -> None:
        self.actors, self.cameras, self.views, self.config = scene.actors, scene.cameras, scene.views, config
        self.meshes = SceneMeshes.of(scene)
        self.frames = scene.frames
        self.ray_caster = SceneRayCaster(self.meshes)
        self._hair, self._watertight = hair_faces(scene.actors), WatertightTable(self.meshes)

    def bind(self, points: SurfacePoints) -> BoundPoints:
        """Points with their triangles."""
        return bind(self.meshes, points)

    def look(self, bound: BoundPoints, frames: Int64[np.ndarray, " S"]) -> ViewVisibility:
        """Where points are visible at some frames."""
        watertight = self._watertight.of(bound.points)
        return visible_in_views(
            bound, watertight, self.ray_caster, self._hair, self.cameras, self.views, frames, self.config
        )

    def follow(self, points: SurfacePoints) -> SequenceTracks:
        """The tracks of points, each of which must be visible somewhere."""
        bound = self.bind(points)
        position_m = bound.position_m(self.frames)
        found = self.look(bound, np.arange(self.frames))
        seen = project_tracks(position_m, self.cameras, found.visible)
        tracks = PointTracks(position_m, points.object_index, points.face, points.barycentric)
        return SequenceTracks(tracks, seen, draw_queries(seen), found.report)
