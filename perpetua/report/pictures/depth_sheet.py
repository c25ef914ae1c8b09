"""Depth of all views in one range of colours, with a scale to read metres from."""

from pathlib import Path

import numpy as np
from jaxtyping import Float32
from PIL import Image, ImageDraw

from perpetua.errors import SequenceFormatError
from perpetua.formats.reader import Sequence
from perpetua.report.pictures.drawing import BACKGROUND, INK, depth_colours, text_font
from perpetua.report.pictures.sheets import CELL_WIDTH_PX, Row, assemble, evenly_spread, nearest_resized

SCALE_WIDTH_PX, SCALE_HEIGHT_PX = 640, 46
BAR_PX = 18
SCALE_TICKS = 7


def write_depth_sheet(sequence: Sequence, picture: Path, times: int = 6) -> None:
    """Writes a picture: a row of ``times`` frames of depth per view, near bright, far dark, nothing black.

    Raises:
        SequenceFormatError: a view has no depth.
    """
    frames = evenly_spread(len(sequence.tracks_m), times)
    depth_m = [_chosen(sequence, index, frames) for index in range(len(sequence.views))]
    some_m = np.concatenate([chosen[chosen > 0] for chosen in depth_m])
    nearest_m, farthest_m = np.percentile(some_m, [1, 99]).tolist() if len(some_m) else (1.0, 2.0)
    rows = []
    for index, chosen in enumerate(depth_m):
        cells = [nearest_resized(depth_colours(image, nearest_m, farthest_m), CELL_WIDTH_PX) for image in chosen]
        rows.append(Row(f"view {index}", [Image.fromarray(cell) for cell in cells]))
    name = sequence.folder.resolve().name
    title = f"{name}: depth along the optical axis, {some_m.min(initial=np.inf):.2f} to {some_m.max(initial=0.0):.2f} m"
    scale = _scale(nearest_m, farthest_m)
    assemble(title, [f"frame {frame}" for frame in frames], rows, scale).save(picture)


def _chosen(sequence: Sequence, view: int, frames: list[int]) -> Float32[np.ndarray, "N H W"]:
    depth_m = sequence.views[view].depth_m
    if depth_m is None:
        raise SequenceFormatError(f"'{sequence.folder}' view {view} has no depth.npy, so there is no depth to draw")
    return np.stack([depth_m[frame] for frame in frames])


def _scale(nearest_m: float, farthest_m: float) -> Image.Image:
    """A bar of the colours with metres under it."""
    metres = np.linspace(nearest_m, farthest_m, SCALE_WIDTH_PX)
    bar = depth_colours(np.tile(metres, (BAR_PX, 1)), nearest_m, farthest_m)
    scale = Image.new("RGB", (SCALE_WIDTH_PX + 60, SCALE_HEIGHT_PX), BACKGROUND)
    scale.paste(Image.fromarray(bar), (0, 0))
    draw = ImageDraw.Draw(scale)
    for place in np.linspace(0, SCALE_WIDTH_PX - 1, SCALE_TICKS).round().astype(int).tolist():
        draw.line([(place, BAR_PX), (place, BAR_PX + 4)], INK)
        anchor = "la" if place == 0 else "ma"
        draw.text((place, BAR_PX + 6), f"{metres[place]:.1f} m", INK, text_font(13), anchor=anchor)
    return scale
