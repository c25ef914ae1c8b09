"""What every pixel of an image shows, exactly: object, triangle, and point of the triangle.

A ray through the pixel's centre finds the point on the meshes. The image has the last word: where the renderer saw
another object, or the same one at another depth, the pixel has no label. That happens on silhouettes, where single
precision decides which side of an edge a ray passes.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from perpetua.geometry.pinhole import Intrinsics
from perpetua.geometry.transforms import invert_rigid, transform_points
from perpetua.scene.scene import Scene
from perpetua.tracks.pixel_hits import hit_pixels
from perpetua.tracks.points_at_frame import as_exported
from perpetua.tracks.ray_caster import SceneRayCaster
from perpetua.tracks.surface import BoundPoints, SceneMeshes, bind
from perpetua.tracks.visibility import SAME_DEPTH_FRACTION, SAME_DEPTH_M, exported_intrinsics

# Rays that are cast at a time: memory grows with it.
BLOCK_PIXELS = 1 << 18


@dataclass(frozen=True)
class ExportedCamera:
    """A camera with the numbers that a reader of the files computes with."""

    intrinsics: Intrinsics
    camera_from_world: Float64[np.ndarray, "T 4 4"]


@dataclass(frozen=True)
class PixelSurfaces:
    """The labelled pixels of a part of an image: ``pixel`` counts them row by row from the image's first."""

    view: int
    frame: int
    pixel: Int64[np.ndarray, " N"]
    pixel_px: Float64[np.ndarray, "N 2"]
    bound: BoundPoints


class LabelledScene:
    """A scene whose pixels can be asked for, frame by frame, so that neither views nor labels need memory."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.ray_caster = SceneRayCaster(SceneMeshes.of(scene))
        self.cameras = tuple(
            ExportedCamera(exported_intrinsics(camera), as_exported(invert_rigid(camera.world_from_camera)))
            for camera in scene.cameras
        )

    def blocks(self, view: int) -> list[range]:
        """Parts of a view's pixels."""
        intrinsics = self.cameras[view].intrinsics
        count = intrinsics.width_px * intrinsics.height_px
        return [range(start, min(start + BLOCK_PIXELS, count)) for start in range(0, count, BLOCK_PIXELS)]

    def surfaces(self, view: int, frame: int, block: range) -> PixelSurfaces:
        """What the pixels of a block show."""
        camera = self.cameras[view]
        row, column = np.divmod(np.arange(block.start, block.stop), camera.intrinsics.width_px)
        pixel_px = np.stack([column, row], axis=1).astype(np.float64)
        pose = camera.camera_from_world[frame]
        hits = hit_pixels(self.ray_caster, camera.intrinsics, invert_rigid(pose), frame, pixel_px)
        agreed = self._agrees(view, frame, block, hits.place, hits.bound, pose)
        place = hits.place[agreed]
        kept = bind(self.ray_caster.meshes, hits.bound.points.take(agreed))
        return PixelSurfaces(view, frame, block.start + place, pixel_px[place], kept)

    def _agrees(
        self,
        view: int,
        frame: int,
        block: range,
        place: Int64[np.ndarray, " N"],
        bound: BoundPoints,
        camera_from_world: Float64[np.ndarray, "4 4"],
    ) -> Bool[np.ndarray, " N"]:
        """Whether the rendered image shows the same surfaces."""
        seen = self.scene.views[view]
        rendered_m = np.asarray(seen.depth_m[frame]).reshape(-1)[block.start : block.stop][place]
        shown = np.asarray(seen.object_index[frame]).reshape(-1)[block.start : block.stop][place]
        depth_m = transform_points(camera_from_world, bound.point_m(frame))[:, 2]
        close = np.abs(rendered_m - depth_m) <= SAME_DEPTH_M + SAME_DEPTH_FRACTION * depth_m
        return np.asarray(close & (shown == bound.points.object_index))
