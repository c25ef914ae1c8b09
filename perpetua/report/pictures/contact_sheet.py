"""A picture of a whole sequence: views by times with tracks, and depth with the outlines of actors."""

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from perpetua.formats.reader import Sequence, SequenceView
from perpetua.report.pictures.drawing import BACKGROUND, INK, depth_colours, text_font
from perpetua.report.pictures.sheets import CELL_WIDTH_PX, Row, assemble, evenly_spread
from perpetua.report.pictures.track_marks import choose_tracks, draw_tracks, resized


def write_contact_sheet(sequence: Sequence, picture: Path, times: int = 6) -> None:
    """Writes a picture: for each view a row of ``times`` frames with tracks, and a row of depth.

    Moving tracks are bright and still ones pale; a tail shows where a track was on the image just before; a point
    that is hidden is a ring. Depth is bright where it is near, with actors outlined.

    Args:
        sequence: what is drawn.
        picture: file to write.
        times: frames shown, evenly spread from first to last.

    Raises:
        SequenceFormatError: an image of the sequence cannot be read.
    """
    frames = evenly_spread(len(sequence.tracks_m), times)
    shown = choose_tracks(sequence)
    rows: list[Row] = []
    for index, view in enumerate(sequence.views):
        cells = [draw_tracks(sequence, view, frame, shown, CELL_WIDTH_PX) for frame in frames]
        rows.append(Row(f"view {index}", cells))
        if view.depth_m is not None:
            rows.append(Row("depth", _depth_cells(view, frames)))
    count = sequence.tracks_m.shape[1]
    title = (
        f"{sequence.folder.resolve().name}: {len(sequence.views)} views, {len(sequence.tracks_m)} frames, "
        f"{count} tracks, {shown.moving_count} moving ({shown.moving_count / max(count, 1):.0%}); "
        f"{len(shown.tracks)} drawn, rings are hidden"
    )
    assemble(title, [f"frame {frame}" for frame in frames], rows).save(picture)


def _depth_cells(view: SequenceView, frames: list[int]) -> list[Image.Image]:
    import cv2

    assert view.depth_m is not None
    chosen = np.stack([view.depth_m[frame] for frame in frames])
    some = chosen[chosen > 0]
    nearest_m, farthest_m = np.percentile(some, [1, 99]).tolist() if len(some) else (1.0, 2.0)
    cells = []
    for frame, depth_m in zip(frames, chosen, strict=True):
        picture = resized(depth_colours(depth_m, nearest_m, farthest_m), CELL_WIDTH_PX)
        if view.foreground is not None:
            mask = Image.fromarray(np.asarray(view.foreground[frame]).astype(np.uint8) * 255)
            large = np.array(mask.resize((picture.shape[1], picture.shape[0]), Image.Resampling.NEAREST))
            outlines, _ = cv2.findContours(large, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
            cv2.drawContours(picture, outlines, -1, (80, 255, 160), 1, cv2.LINE_AA)
        image = Image.fromarray(picture)
        ImageDraw.Draw(image).text(
            (6, picture.shape[0] - 20),
            f"{nearest_m:.1f} to {farthest_m:.1f} m",
            INK,
            text_font(13),
            stroke_width=2,
            stroke_fill=BACKGROUND,
        )
        cells.append(image)
    return cells
