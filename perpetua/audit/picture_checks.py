"""Checks that images are in the right place: tracks keep their colours from image to image and from view to view.

The colour of a track is the median over the images of a view that show it. An image that was put at another frame shows
other colours at that frame's tracks, and the image that belongs there shows the right ones.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, UInt8

from perpetua.audit.files import SequenceFiles
from perpetua.audit.geometry import project_to_pixels
from perpetua.audit.report import Check

# The first tracks are a fair sample.
TRACKS = 1024
# Fewer visible tracks say nothing about an image.
FEWEST = 24
# Another image fits a frame better when its colour error is less than this fraction of the own image's error, and
# smaller by at least this much; colours are natural logarithms.
BETTER_FRACTION, BETTER_BY = 0.55, 0.01
# Two views' images are exchanged when the colours of common tracks correlate by this much more after an exchange.
BETTER_CORRELATION = 0.4


@dataclass(frozen=True)
class _View:
    """What one view's images show at its tracks; ``colour`` is NaN for tracks that the view never shows."""

    name: str
    pixel_px: Float32[np.ndarray, "F P 2"]
    visible: Bool[np.ndarray, "F P"]
    colour: Float64[np.ndarray, "P 3"]


def check_pictures(files: SequenceFiles) -> Check:
    """No image fits another frame of its view, or another view, much better than the image that is there."""
    faults: list[str] = []
    worst = 0.0
    views = [_look(files, view) for view in files.views]
    for view in views:
        error = _errors(files, view)
        for frame in np.flatnonzero(view.visible.sum(axis=1) >= FEWEST).tolist():
            best = int(error[:, frame].argmin())
            own, other = float(error[frame, frame]), float(error[best, frame])
            worst = max(worst, 1.0 - other / max(own, 1e-9) if own - other > BETTER_BY else 0.0)
            if other < BETTER_FRACTION * own and own - other > BETTER_BY:
                faults.append(f"{view.name}/images_jpeg_bytes.npy[{best}] fits frame {frame} better than its own image")
    faults += _exchanged(files, views)
    bound = f"no image fits {1.0 - BETTER_FRACTION:.0%} better elsewhere"
    return Check("images of their frames", not faults, worst, bound, "; ".join(faults[:3]))


def _look(files: SequenceFiles, name: str) -> _View:
    tracks = files.arrays["tracks_xyz.npy"][:, :TRACKS]
    visible = np.asarray(files.arrays[f"{name}/visibility.npy"][:, :TRACKS])
    pixel_px = np.empty((*visible.shape, 2), np.float32)
    for frame in range(len(tracks)):
        camera = files.arrays[f"{name}/intrinsics.npy"], files.arrays[f"{name}/extrinsics_w2c.npy"][frame]
        seen = project_to_pixels(*camera, tracks[frame])[:, :2]
        pixel_px[frame] = np.nan_to_num(seen, nan=0.0).clip(0.0, 16_000.0)
    return _View(name, pixel_px, visible, _colours(files.jpegs[name], pixel_px, visible))


def _colours(
    jpegs: tuple[UInt8[np.ndarray, " _"], ...],
    pixel_px: Float32[np.ndarray, "F P 2"],
    visible: Bool[np.ndarray, "F P"],
) -> Float64[np.ndarray, "P 3"]:
    """Median colour of each track over the images in which it is visible; NaN for tracks that never are."""
    shown = np.full((*visible.shape, 3), np.nan, np.float32)
    for frame, jpeg in enumerate(jpegs):
        at = np.flatnonzero(visible[frame])
        shown[frame, at] = _sample(_decode(jpeg), pixel_px[frame, at])
    colour = np.full((visible.shape[1], 3), np.nan)
    known = visible.any(axis=0)
    colour[known] = np.nanmedian(shown[:, known], axis=0)
    return colour


def _errors(files: SequenceFiles, view: _View) -> Float64[np.ndarray, "F F"]:
    """Median distance between the colours of an image (first axis) and those of the tracks visible at a frame, after
    the image's brightness is removed."""
    frame, track = np.nonzero(view.visible)
    ends = np.cumsum(view.visible.sum(axis=1))[:-1]
    error = np.full((len(view.visible), len(view.visible)), np.inf)
    for image, jpeg in enumerate(files.jpegs[view.name]):
        off = _sample(_decode(jpeg), view.pixel_px[frame, track]) - view.colour[track]
        for at, part in enumerate(np.split(off, ends)):
            if len(part):
                error[image, at] = np.median(np.abs(part - np.median(part, axis=0)).mean(axis=1))
    return error


def _exchanged(files: SequenceFiles, views: list[_View]) -> list[str]:
    """Pairs of views whose images fit much better when exchanged."""
    faults = []
    for place, first in enumerate(views):
        for second in views[place + 1 :]:
            own = _correlation(first.colour, second.colour)
            if own is None or own > 1.0 - BETTER_CORRELATION:
                continue
            turned = _correlation(
                _colours(files.jpegs[second.name], first.pixel_px, first.visible),
                _colours(files.jpegs[first.name], second.pixel_px, second.visible),
            )
            if turned is not None and turned - own > BETTER_CORRELATION:
                faults.append(
                    f"images_jpeg_bytes.npy of views {first.name} and {second.name} fit the other way round: colours "
                    f"of common tracks correlate by {own:.2f} as they are, and by {turned:.2f} exchanged"
                )
    return faults


def _correlation(first: Float64[np.ndarray, "P 3"], second: Float64[np.ndarray, "P 3"]) -> float | None:
    """Correlation of the colours of tracks that both views see; None where these are too few, or all alike."""
    both = np.isfinite(first).all(axis=1) & np.isfinite(second).all(axis=1)
    seen = np.stack([first[both].ravel(), second[both].ravel()])
    if both.sum() < FEWEST or (seen.std(axis=1) < 0.1).any():
        return None
    return float(np.corrcoef(seen)[0, 1])


def _decode(jpeg: UInt8[np.ndarray, " _"]) -> Float32[np.ndarray, "H W 3"]:
    return np.log1p(cv2.imdecode(jpeg, cv2.IMREAD_COLOR).astype(np.float32))


def _sample(image: Float32[np.ndarray, "H W 3"], pixel_px: Float32[np.ndarray, "N 2"]) -> Float32[np.ndarray, "N 3"]:
    """Colours interpolated between pixel centres; OpenCV takes at most 32,767 points in a row."""
    if len(pixel_px) == 0:
        return np.zeros((0, 3), np.float32)
    columns = [part for start in range(0, len(pixel_px), 16_384) for part in [pixel_px[start : start + 16_384]]]
    found = [
        cv2.remap(image, part[None, :, 0], part[None, :, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[0]
        for part in columns
    ]
    return np.concatenate(found)
