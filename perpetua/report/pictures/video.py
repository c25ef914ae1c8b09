"""All views side by side, in step, with tracks: as an MP4, or as an animated picture for web pages."""

import math
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw

from perpetua.formats.reader import Sequence
from perpetua.report.pictures.drawing import BACKGROUND, INK, text_font
from perpetua.report.pictures.track_marks import ShownTracks, choose_tracks, draw_tracks

CELL_WIDTH_PX = 480
GAP_PX = 4
# Quality of the video: close to lossless to the eye, and not much larger.
QUALITY = "18"
# Size and quality of the animated picture, which a page must load quickly.
ANIMATION_WIDTH_PX, ANIMATION_QUALITY = 480, 40


def write_video(sequence: Sequence, fps: float, video: Path) -> None:
    """Writes an H.264 video in the pixel format that browsers play, at ``fps`` frames per second.

    Raises:
        SequenceFormatError: an image of the sequence cannot be read.
    """
    encode(_frames(sequence), fps, video)


def write_animation(sequence: Sequence, fps: float, picture: Path) -> None:
    """Writes an animated WebP that repeats, at ``fps`` frames per second.

    Raises:
        SequenceFormatError: an image of the sequence cannot be read.
    """
    first, *rest = [_reduced(rgb) for rgb in _frames(sequence)]
    length_ms = round(1000.0 / fps)
    repeated = {"save_all": True, "append_images": rest, "duration": length_ms, "loop": 0}
    first.save(picture, "WebP", quality=ANIMATION_QUALITY, minimize_size=True, **repeated)


def _reduced(rgb: UInt8[np.ndarray, "H W 3"]) -> Image.Image:
    size = (ANIMATION_WIDTH_PX, round(ANIMATION_WIDTH_PX * rgb.shape[0] / rgb.shape[1]))
    return Image.fromarray(rgb).resize(size, Image.Resampling.LANCZOS)


def _frames(sequence: Sequence) -> Iterator[UInt8[np.ndarray, "H W 3"]]:
    shown = choose_tracks(sequence)
    return (_frame(sequence, frame, shown) for frame in range(len(sequence.tracks_m)))


def encode(frames: Iterator[UInt8[np.ndarray, "H W 3"]], fps: float, video: Path) -> None:
    """Writes RGB images of equal, even size as an MP4; the header comes first, so that it plays while it loads."""
    import av
    from av.video.reformatter import ColorPrimaries, Colorspace, ColorTrc

    rate = Fraction(fps).limit_denominator(1001)
    with av.open(str(video), "w", format="mp4", options={"movflags": "+faststart"}) as container:
        stream = container.add_stream("libx264", rate=rate, options={"crf": QUALITY})
        stream.pix_fmt = "yuv420p"
        # Written into the file, because players otherwise guess it from the size.
        stream.codec_context.colorspace = Colorspace.ITU709
        stream.codec_context.color_primaries = ColorPrimaries.BT709
        stream.codec_context.color_trc = ColorTrc.BT709
        for number, rgb in enumerate(frames):
            if number == 0:
                stream.height, stream.width = rgb.shape[:2]
            frame = av.VideoFrame.from_ndarray(rgb, format="rgb24")
            container.mux(stream.encode(frame.reformat(format="yuv420p", dst_colorspace=Colorspace.ITU709)))
        container.mux(stream.encode())


def _frame(sequence: Sequence, frame: int, shown: ShownTracks) -> UInt8[np.ndarray, "H W 3"]:
    cells = [draw_tracks(sequence, view, frame, shown, CELL_WIDTH_PX) for view in sequence.views]
    columns = math.ceil(math.sqrt(len(cells)))
    height_px = max(cell.height for cell in cells)
    size = (_laid_out(columns, CELL_WIDTH_PX), _laid_out(math.ceil(len(cells) / columns), height_px))
    grid = Image.new("RGB", size, BACKGROUND)
    for index, cell in enumerate(cells):
        name = f"view {index}, frame {frame}" if index == 0 else f"view {index}"
        ImageDraw.Draw(cell).text((8, 6), name, INK, text_font(14), stroke_width=2, stroke_fill=BACKGROUND)
        grid.paste(cell, ((index % columns) * (CELL_WIDTH_PX + GAP_PX), (index // columns) * (height_px + GAP_PX)))
    return np.asarray(grid)


def _laid_out(count: int, side_px: int) -> int:
    """Pixels of ``count`` cells with gaps between them, made even, which the pixel format needs."""
    length_px = count * side_px + (count - 1) * GAP_PX
    return length_px + length_px % 2
