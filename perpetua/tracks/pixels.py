"""Tracks of the pixels of one image: what each shows, followed through the sequence."""

import numpy as np

from perpetua.errors import InputError, TrackError
from perpetua.tracks.follow import TrackScene
from perpetua.tracks.pixel_hits import hit_pixels
from perpetua.tracks.surface import SurfacePoints
from perpetua.tracks.types import SequenceTracks


def make_pixel_tracks(scene: TrackScene, view: int, frame: int, step: int) -> SequenceTracks:
    """One track for every ``step``-th pixel of every ``step``-th row of an image, in that order.

    Pixels that show nothing, and points that no view shows at any frame by the rule of
    ``perpetua.tracks.visibility``, are left out.

    Raises:
        InputError: there is no such view or frame, or the step is not positive.
        TrackError: the image shows nothing that can be followed.
    """
    if not (0 <= view < len(scene.views) and 0 <= frame < scene.frames and step >= 1):
        raise InputError(
            f"pixels must be of a view in 0..{len(scene.views) - 1} and a frame in 0..{scene.frames - 1}, with a step "
            f"of 1 or more, not view {view}, frame {frame}, step {step}"
        )
    points = _points(scene, view, frame, step)
    seen = scene.look(scene.bind(points), np.arange(scene.frames)).visible.any(axis=(0, 1))
    if not seen.any():
        raise TrackError(f"no pixel of view {view}, frame {frame} shows a surface that can be followed: choose another")
    return scene.follow(points.take(seen))


def _points(scene: TrackScene, view: int, frame: int, step: int) -> SurfacePoints:
    camera = scene.cameras[view]
    row, column = np.mgrid[: camera.intrinsics.height_px : step, : camera.intrinsics.width_px : step].reshape(2, -1)
    pixel_px = np.stack([column, row], axis=1).astype(np.float64)
    return hit_pixels(
        scene.ray_caster, camera.intrinsics, camera.world_from_camera[frame], frame, pixel_px
    ).bound.points
