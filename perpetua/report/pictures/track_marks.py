"""Tracks drawn on an image: moving ones bright and still ones pale, with fading tails, hidden ones as rings."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64, UInt8
from PIL import Image

from perpetua.audit.geometry import moves_more_than, project_to_pixels
from perpetua.formats.reader import Sequence, SequenceView
from perpetua.report.pictures.drawing import Canvas, Colour, track_colour
from perpetua.tracks.motion import MOVING_M

MOVING_TRACKS = 90
STILL_TRACKS = 60
TAIL_FRACTION = 0.1
LONGEST_TAIL_FRAMES = 16
# Points nearer to the camera's plane, or behind it, are not drawn.
NEAREST_M = 0.05


@dataclass(frozen=True)
class ShownTracks:
    """The tracks that are drawn, still ones first so that moving ones lie on top, and which of them move.

    ``moving_count`` counts all tracks that move, drawn or not.
    """

    tracks: Int64[np.ndarray, " N"]
    moving: frozenset[int]
    tail_frames: int
    moving_count: int


def choose_tracks(sequence: Sequence) -> ShownTracks:
    """A number of tracks that a picture can show, evenly from those that move and those that do not."""
    moves = moves_more_than(sequence.tracks_m, MOVING_M)
    still, moving = (_evenly(np.flatnonzero(~moves), STILL_TRACKS), _evenly(np.flatnonzero(moves), MOVING_TRACKS))
    tail_frames = max(2, round(TAIL_FRACTION * len(sequence.tracks_m)))
    return ShownTracks(
        np.concatenate([still, moving]),
        frozenset(moving.tolist()),
        min(tail_frames, LONGEST_TAIL_FRAMES),
        int(moves.sum()),
    )


def _evenly(tracks: Int64[np.ndarray, " N"], wanted: int) -> Int64[np.ndarray, " M"]:
    places = np.unique(np.linspace(0, len(tracks) - 1, min(wanted, len(tracks))).astype(int))
    return tracks[places] if len(tracks) else tracks


def draw_tracks(sequence: Sequence, view: SequenceView, frame: int, shown: ShownTracks, width_px: int) -> Image.Image:
    """A frame of a view, ``width_px`` wide, with the chosen tracks on it."""
    rgb = view.image(frame)
    scale = width_px / rgb.shape[1]
    canvas = Canvas(resized(rgb, width_px))
    first = max(0, frame - shown.tail_frames)
    trail_px = np.stack([_pixels(view, sequence, past, shown.tracks) for past in range(first, frame + 1)], axis=1)
    trail_px = scale * (trail_px + 0.5) - 0.5
    limit = np.array(canvas.size)
    for track, path_px in zip(shown.tracks.tolist(), trail_px, strict=True):
        here = path_px[-1]
        if not (np.isfinite(here).all() and (here > -0.5).all() and (here < limit - 0.5).all()):
            continue
        moving, visible = track in shown.moving, bool(view.visible[frame, track])
        colour = track_colour(track, moving)
        if visible:
            _draw_tail(canvas, path_px, colour, 2.0 if moving else 1.0)
        canvas.dot(here, colour, 3.0 if moving else 1.8, hollow=not visible)
    return canvas.picture()


def _draw_tail(canvas: Canvas, path_px: Float64[np.ndarray, "K 2"], colour: Colour, width_px: float) -> None:
    steps = len(path_px) - 1
    for step in range(steps):
        piece = path_px[step : step + 2]
        if np.isfinite(piece).all():
            canvas.line(piece, colour, width_px, opacity=0.85 * (step + 1) / steps)


def _pixels(
    view: SequenceView, sequence: Sequence, frame: int, tracks: Int64[np.ndarray, " N"]
) -> Float64[np.ndarray, "N 2"]:
    seen = project_to_pixels(view.intrinsics_px, view.camera_from_world[frame], sequence.tracks_m[frame, tracks])
    return np.where(seen[:, 2:] > NEAREST_M, seen[:, :2], np.nan)


def resized(rgb: UInt8[np.ndarray, "H W 3"], width_px: int) -> UInt8[np.ndarray, "h w 3"]:
    """A photograph at another width, of the same proportions."""
    height_px = round(width_px * rgb.shape[0] / rgb.shape[1])
    method = Image.Resampling.LANCZOS if rgb.shape[1] > width_px else Image.Resampling.BICUBIC
    return np.array(Image.fromarray(rgb).resize((width_px, height_px), method))
