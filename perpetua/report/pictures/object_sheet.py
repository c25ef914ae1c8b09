"""Which object each pixel shows: people bright, objects pale, the large ones with their names."""

from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int64, UInt8, UInt16
from PIL import Image, ImageDraw

from perpetua.formats.source import ExportSource
from perpetua.report.pictures.drawing import BACKGROUND, INK, text_font
from perpetua.report.pictures.sheets import CELL_WIDTH_PX, Row, assemble, evenly_spread, nearest_resized

# An object is named where it covers at least this fraction of the image; names of smaller ones would hide too much.
NAMED_FRACTION = 0.02
MOST_NAMES = 8
NAME_PX, STROKE_PX = 12, 2


def write_object_sheet(source: ExportSource, picture: Path, times: int = 6) -> None:
    """Writes a picture: a row of ``times`` frames of object index per view. ``source`` must have object indices."""
    assert source.object_index is not None
    frames = evenly_spread(len(source.sequence.tracks_m), times)
    palette = _palette(source)
    rows = []
    for index, rendered in enumerate(source.object_index):
        rows.append(Row(f"view {index}", [_cell(np.asarray(rendered[frame]), palette, source) for frame in frames]))
    shown = np.unique(np.concatenate([np.unique(rendered[frames]) for rendered in source.object_index]))
    count = int((shown > 0).sum())
    title = f"{source.name}: object index, {count} objects in these frames; people are bright, black is nothing"
    assemble(title, [f"frame {frame}" for frame in frames], rows).save(picture)


def _palette(source: ExportSource) -> UInt8[np.ndarray, "65536 3"]:
    palette = np.zeros((2**16, 3), np.uint8)
    shown = np.unique(np.concatenate([np.unique(rendered) for rendered in source.object_index or ()]))
    for index in shown[shown > 0].tolist():
        palette[index] = source.object_colour(index)
    return palette


def _cell(
    object_index: UInt16[np.ndarray, "H W"], palette: UInt8[np.ndarray, "65536 3"], source: ExportSource
) -> Image.Image:
    scale = CELL_WIDTH_PX / object_index.shape[1]
    image = Image.fromarray(nearest_resized(palette[object_index], CELL_WIDTH_PX))
    draw = ImageDraw.Draw(image)
    for index in _largest(object_index):
        name = source.object_name.get(index)
        if name is not None:
            _write_name(draw, name, scale * _inner_pixel(object_index == index))
    return image


def _write_name(draw: ImageDraw.ImageDraw, name: str, middle_px: Float64[np.ndarray, "2"]) -> None:
    """A name around a point, moved sideways where it would run out of the cell."""
    font = text_font(NAME_PX)
    half_px = 0.5 * draw.textlength(name, font) + STROKE_PX
    x = min(max(middle_px[0], half_px), max(CELL_WIDTH_PX - half_px, half_px))
    draw.text((x, middle_px[1]), name, INK, font, anchor="mm", stroke_width=STROKE_PX, stroke_fill=BACKGROUND)


def _largest(object_index: UInt16[np.ndarray, "H W"]) -> list[int]:
    counts: Int64[np.ndarray, " _"] = np.bincount(object_index.ravel())
    counts[0] = 0
    order = np.argsort(counts)[::-1][:MOST_NAMES]
    return [index for index in order.tolist() if counts[index] > NAMED_FRACTION * object_index.size]


def _inner_pixel(mask: np.ndarray) -> Float64[np.ndarray, "2"]:
    """x and y of the pixel that lies deepest inside a region."""
    import cv2

    framed = np.pad(mask.astype(np.uint8), 1)
    depth_px = cv2.distanceTransform(framed, cv2.DIST_L2, 3)[1:-1, 1:-1]
    row, column = np.unravel_index(int(depth_px.argmax()), depth_px.shape)
    return np.array([column, row], float)
