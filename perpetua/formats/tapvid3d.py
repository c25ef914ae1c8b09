"""Exporter of TAPVid-3D's layout: one ``.npz`` per view, as that benchmark's evaluation and notebook read it.

::

    <sequence>_<view>.npz
        images_jpeg_bytes   (F,)    bytes     JPEG files
        queries_xyt         (N,3)   float64   pixel and 0-based frame at which each track is asked for
        tracks_XYZ          (F,N,3) float64   positions in the camera of the same frame, OpenCV axes, metres
        visibility          (F,N)   bool
        fx_fy_cx_cy         (4,)    float64   pixels
        extrinsics_w2c      (F,4,4) float64   world to camera; the release has it for its moving cameras

Pixels are raster coordinates, as in that benchmark's generators: (0, 0) is the corner of the top-left pixel, so x, y,
cx and cy are half a pixel more than ours. A view holds the N tracks that it sees at least once; each query is drawn
among the frames that see the track, by the rule of the sequence's own queries.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.formats.source import HALF_PIXEL_PX, ExportSource
from perpetua.tracks.queries import draw_queries
from perpetua.tracks.types import ViewTracks


class Tapvid3d:
    """Single views in TAPVid-3D's layout; equal sequences give equal bytes."""

    def write(self, source: ExportSource, folder: Path) -> None:
        """Writes ``<sequence>_<view>.npz`` for every view into ``folder``."""
        for index, view in enumerate(source.sequence.views):
            seen = np.flatnonzero(view.visible.any(axis=0))
            fx_fy_cx_cy = view.intrinsics_px.astype(np.float64) + np.array([0.0, 0.0, HALF_PIXEL_PX, HALF_PIXEL_PX])
            np.savez(
                folder / f"{source.name}_{index}.npz",
                # Fixed-length bytes, which readers load without pickle; a JPEG ends in 0xD9, so no zero byte is lost.
                images_jpeg_bytes=np.array([jpeg.tobytes() for jpeg in view.jpeg]),
                queries_xyt=_queries_xyt(source.track_pixel_px(index)[:, seen], view.visible[:, seen]),
                tracks_XYZ=source.track_camera_m(index)[:, seen],
                visibility=view.visible[:, seen],
                fx_fy_cx_cy=fx_fy_cx_cy,
                extrinsics_w2c=view.camera_from_world.astype(np.float64),
            )


def _queries_xyt(
    pixel_px: Float64[np.ndarray, "F N 2"], visible: Bool[np.ndarray, "F N"]
) -> Float64[np.ndarray, "N 3"]:
    one_view = ViewTracks(pixel_px[None] + HALF_PIXEL_PX, np.full((1, *visible.shape), np.nan), visible[None])
    return draw_queries(one_view)[:, :3].astype(np.float64)
