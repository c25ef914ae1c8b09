"""Sheets of pictures: rows with a name at their left, columns with a heading above."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw

from perpetua.report.pictures.drawing import BACKGROUND, FAINT, INK, text_font

CELL_WIDTH_PX = 320
GAP_PX = 6
HEADING_PX = 44
MARGIN_PX = 34


@dataclass(frozen=True)
class Row:
    """Cells of equal height, with a name that runs up their left side."""

    name: str
    cells: list[Image.Image]


def evenly_spread(frames: int, times: int) -> list[int]:
    """At most ``times`` frames from first to last, each once."""
    spread: list[int] = np.unique(np.linspace(0, frames - 1, times).round().astype(int)).tolist()
    return spread


def assemble(title: str, headings: list[str], rows: list[Row], footer: Image.Image | None = None) -> Image.Image:
    """A sheet of rows; every row has one cell per heading."""
    below_px = 0 if footer is None else footer.height + GAP_PX
    width_px = MARGIN_PX + len(headings) * (CELL_WIDTH_PX + GAP_PX)
    height_px = HEADING_PX + sum(row.cells[0].height + GAP_PX for row in rows) + below_px
    sheet = Image.new("RGB", (width_px, height_px), BACKGROUND)
    draw = ImageDraw.Draw(sheet)
    draw.text((MARGIN_PX, 4), title, INK, text_font(16))
    for column, heading in enumerate(headings):
        draw.text((MARGIN_PX + column * (CELL_WIDTH_PX + GAP_PX), 25), heading, FAINT, text_font(14))
    top_px = HEADING_PX
    for row in rows:
        label = Image.new("RGB", (row.cells[0].height, MARGIN_PX), BACKGROUND)
        ImageDraw.Draw(label).text((label.width // 2, MARGIN_PX // 2), row.name, INK, text_font(15), anchor="mm")
        sheet.paste(label.rotate(90, expand=True), (0, top_px))
        for column, cell in enumerate(row.cells):
            sheet.paste(cell, (MARGIN_PX + column * (CELL_WIDTH_PX + GAP_PX), top_px))
        top_px += row.cells[0].height + GAP_PX
    if footer is not None:
        sheet.paste(footer, (MARGIN_PX, top_px))
    return sheet


def nearest_resized(colours: UInt8[np.ndarray, "H W 3"], width_px: int) -> UInt8[np.ndarray, "h w 3"]:
    """A map at another width without mixing its colours."""
    height_px = round(width_px * colours.shape[0] / colours.shape[1])
    return np.array(Image.fromarray(colours).resize((width_px, height_px), Image.Resampling.NEAREST))
