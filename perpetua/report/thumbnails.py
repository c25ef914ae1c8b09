"""Small pictures of a sequence, embedded in the page."""

import base64
import io

from PIL import Image

from perpetua.formats.reader import Sequence
from perpetua.report.pictures.track_marks import choose_tracks, draw_tracks

WIDTH_PX = 240
JPEG_QUALITY = 80


def thumbnails(sequence: Sequence) -> tuple[str, ...]:
    """The middle frame of each view with tracks, as data URIs.

    Raises:
        SequenceFormatError: an image cannot be read.
    """
    frame, shown = len(sequence.tracks_m) // 2, choose_tracks(sequence)
    return tuple(_data_uri(draw_tracks(sequence, view, frame, shown, WIDTH_PX)) for view in sequence.views)


def _data_uri(picture: Image.Image) -> str:
    content = io.BytesIO()
    picture.save(content, "JPEG", quality=JPEG_QUALITY)
    return f"data:image/jpeg;base64,{base64.b64encode(content.getvalue()).decode()}"
