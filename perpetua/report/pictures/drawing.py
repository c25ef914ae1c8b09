"""Marks, text and colours of the pictures that a person looks at."""

import colorsys

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageDraw, ImageFont

Colour = tuple[int, int, int]
BACKGROUND: Colour = (24, 26, 30)
INK: Colour = (235, 235, 235)
FAINT: Colour = (150, 155, 160)
# Marks are drawn on an enlarged canvas that is then reduced, which smooths them.
SMOOTH = 3


def track_colour(index: int, bright: bool) -> Colour:
    """A colour for a track number; neighbouring numbers have hues a golden section apart."""
    hue = (index * 0.618034) % 1.0
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.85 if bright else 0.25, 1.0 if bright else 0.9)
    return int(255 * red), int(255 * green), int(255 * blue)


def text_font(size_px: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """The font that Pillow brings along."""
    return ImageFont.load_default(size_px)


class Canvas:
    """A picture with smooth marks in its pixel coordinates; (0, 0) is the centre of the top-left pixel."""

    def __init__(self, rgb: UInt8[np.ndarray, "H W 3"]) -> None:
        self.size = (rgb.shape[1], rgb.shape[0])
        self._marks = Image.new("RGBA", (SMOOTH * self.size[0], SMOOTH * self.size[1]), (0, 0, 0, 0))
        self._draw = ImageDraw.Draw(self._marks)
        self._picture = Image.fromarray(rgb)

    def line(self, points_px: Float[np.ndarray, "N 2"], colour: Colour, width_px: float, opacity: float = 1.0) -> None:
        """A polyline."""
        corners = [tuple(pair) for pair in (SMOOTH * (points_px + 0.5)).tolist()]
        self._draw.line(corners, (*colour, round(255 * opacity)), max(1, round(SMOOTH * width_px)), joint="curve")

    def dot(self, point_px: Float[np.ndarray, "2"], colour: Colour, radius_px: float, hollow: bool = False) -> None:
        """A disc with a dark rim, or a ring."""
        x, y = (SMOOTH * (point_px + 0.5)).tolist()
        radius = SMOOTH * radius_px
        box = (x - radius, y - radius, x + radius, y + radius)
        if hollow:
            self._draw.ellipse(box, None, (*colour, 200), max(1, round(0.8 * SMOOTH)))
        else:
            self._draw.ellipse(box, (*colour, 255), (0, 0, 0, 160), max(1, SMOOTH // 2))

    def picture(self) -> Image.Image:
        """The picture with its marks."""
        marks = self._marks.resize(self.size, Image.Resampling.BOX)
        return Image.alpha_composite(self._picture.convert("RGBA"), marks).convert("RGB")


def depth_colours(depth_m: Float[np.ndarray, "H W"], nearest_m: float, farthest_m: float) -> UInt8[np.ndarray, "H W 3"]:
    """Near is bright, far is dark violet, evenly in metres; black where there is none."""
    import cv2

    fraction = (farthest_m - depth_m) / max(farthest_m - nearest_m, 1e-9)
    level = (255 * np.clip(0.08 + 0.92 * fraction, 0.0, 1.0)).astype(np.uint8)
    colours = cv2.applyColorMap(level, cv2.COLORMAP_INFERNO)[:, :, ::-1]
    return np.ascontiguousarray(np.where((depth_m > 0)[:, :, None], colours, 0).astype(np.uint8))
