"""Query points: where each track is asked for."""

import numpy as np
from jaxtyping import Bool, Float32, Float64

from perpetua.geometry.pinhole import project
from perpetua.geometry.transforms import invert_rigid, transform_points
from perpetua.scene.camera import CameraPath
from perpetua.tracks.points_at_frame import as_exported
from perpetua.tracks.types import ViewTracks
from perpetua.tracks.visibility import exported_intrinsics

QUERY_SEED = 42


def project_tracks(
    position_m: Float64[np.ndarray, "T N 3"], cameras: tuple[CameraPath, ...], visible: Bool[np.ndarray, "C T N"]
) -> ViewTracks:
    """Pixels and depths of tracks in each view, computed from positions and cameras as they are exported."""
    pixel_px = np.empty((*visible.shape, 2))
    depth_m = np.empty(visible.shape)
    point_m = as_exported(position_m)
    for index, camera in enumerate(cameras):
        camera_m = transform_points(as_exported(invert_rigid(camera.world_from_camera)), point_m)
        pixel_px[index] = project(exported_intrinsics(camera), camera_m)
        depth_m[index] = np.where(camera_m[..., 2] > 0.0, camera_m[..., 2], np.nan)
    return ViewTracks(pixel_px, depth_m, visible)


def draw_queries(views: ViewTracks) -> Float32[np.ndarray, "N 4"]:
    """One query (x, y, frame, view) per track.

    One generator, ``numpy.random.default_rng(42)``, serves the tracks in their order: each draws
    ``integers(number of its visible pairs)``, an index into its visible (view, frame) pairs listed view by view, then
    frame by frame. Every track must be visible somewhere.
    """
    rng = np.random.default_rng(QUERY_SEED)
    frames = views.visible.shape[1]
    queries = np.empty((views.visible.shape[2], 4), np.float32)
    for track, visible in enumerate(np.ascontiguousarray(np.moveaxis(views.visible, 2, 0))):
        pairs = np.flatnonzero(visible)
        view, frame = divmod(int(pairs[rng.integers(len(pairs))]), frames)
        queries[track] = (*views.pixel_px[view, frame, track], frame, view)
    return queries
