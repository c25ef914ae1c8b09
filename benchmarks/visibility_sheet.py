"""Pictures of single (view, frame, track) entries: a few pixels around the projection, as colour, as depth, and as
objects, of which the track's own is white."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from perpetua.formats.reader import Sequence, read_sequence
from perpetua.pipeline.work_area import load_object_index
from perpetua.report.pictures.drawing import BACKGROUND, FAINT, INK, Canvas, depth_colours, text_font

REACH_PX, ENLARGE = 8, 9
LABEL_PX, CAPTION_PX, GAP_PX = 250, 18, 8
# Neither rooms nor the colours of depth have it.
MARK = (60, 255, 200)
OWN_OBJECT = (240, 240, 240)
PANELS = 3


@dataclass(frozen=True)
class Example:
    """An entry, and where it projects to."""

    folder: Path
    view: int
    frame: int
    track: int
    pixel_px: tuple[float, ...]

    @property
    def image(self) -> tuple[Path, int, int]:
        """The image it is in."""
        return self.folder, self.view, self.frame


def write_sheet(rows: dict[str, list[Example]], png: Path) -> None:
    """Draws a row of examples for each kind; the ring is where the point projects to, pixels are as rendered."""
    folders = {example.folder for several in rows.values() for example in several}
    sequences = {folder: read_sequence(folder) for folder in folders}
    objects = {folder: load_object_index(folder) for folder in folders}
    side = (2 * REACH_PX + 1) * ENLARGE
    most = max((len(several) for several in rows.values()), default=0)
    row_px = side + CAPTION_PX + GAP_PX
    sheet = Image.new(
        "RGB", (LABEL_PX + most * PANELS * (side + GAP_PX), max(1, len(rows)) * row_px + GAP_PX), BACKGROUND
    )
    draw = ImageDraw.Draw(sheet)
    for number, (name, several) in enumerate(rows.items()):
        top = GAP_PX + number * row_px
        draw.multiline_text((GAP_PX, top + 8), name.replace(": ", ":\n"), INK, text_font(14), spacing=6)
        for place, example in enumerate(several):
            left = LABEL_PX + place * PANELS * (side + GAP_PX)
            index = objects[example.folder]
            assert index is not None
            pictures = _pictures(sequences[example.folder], index[example.view][example.frame], example)
            for offset, picture in enumerate(pictures):
                sheet.paste(picture, (left + offset * (side + 2), top))
            draw.text((left, top + side + 1), _caption(sequences[example.folder], example), FAINT, text_font(12))
    sheet.save(png)


def _caption(sequence: Sequence, example: Example) -> str:
    category = "" if sequence.record is None else sequence.record["tracks"]["category"][example.track]
    return f"{example.folder.name} view {example.view} frame {example.frame} track {example.track} {category}"


def _pictures(sequence: Sequence, object_index: np.ndarray, example: Example) -> list[Image.Image]:
    view = sequence.views[example.view]
    assert view.depth_m is not None
    middle = np.round(example.pixel_px).astype(int)
    depth_m = _window(np.asarray(view.depth_m[example.frame]), middle)
    surfaces = depth_m[depth_m > 0]
    nearest, farthest = (float(surfaces.min()), float(surfaces.max()) + 1e-3) if len(surfaces) else (1.0, 2.0)
    assert sequence.record is not None
    own = sequence.record["tracks"]["object_index"][example.track]
    objects = _object_colours(_window(np.asarray(object_index), middle), own)
    colours = [_window(view.image(example.frame), middle), depth_colours(depth_m, nearest, farthest), objects]
    at_px = ENLARGE * (np.array(example.pixel_px) - middle + REACH_PX + 0.5) - 0.5
    pictures = []
    for picture in colours:
        canvas = Canvas(np.ascontiguousarray(picture.repeat(ENLARGE, axis=0).repeat(ENLARGE, axis=1)))
        canvas.dot(at_px, MARK, 0.55 * ENLARGE, hollow=True)
        canvas.dot(at_px, MARK, 1.6)
        pictures.append(canvas.picture())
    return pictures


def _object_colours(object_index: np.ndarray, own: int) -> np.ndarray:
    """A colour for each object, none very bright but the track's own."""
    index = object_index.astype(np.int64)[..., None]
    colours = (40 + index * np.array([67, 131, 193]) % 150).astype(np.uint8)
    return np.where(index == own, np.array(OWN_OBJECT, np.uint8), colours)


def _window(image: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Pixels around one; zero off the image."""
    padding = [(REACH_PX, REACH_PX)] * 2 + [(0, 0)] * (image.ndim - 2)
    padded = np.pad(image, padding)
    return padded[middle[1] : middle[1] + 2 * REACH_PX + 1, middle[0] : middle[0] + 2 * REACH_PX + 1]
