"""A picture of a whole sequence: views by times with tracks, depth with the outlines of actors, and a plan."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int64, UInt8
from PIL import Image, ImageDraw

from perpetua.audit.geometry import moves_more_than, project_to_pixels
from perpetua.formats.reader import Sequence, SequenceView, read_sequence
from perpetua.pictures.drawing import BACKGROUND, FAINT, INK, Canvas, depth_colours, text_font, track_colour

CELL_WIDTH_PX = 320
GAP_PX = 6
HEADING_PX = 44
MARGIN_PX = 34
MOVING_TRACKS = 90
STILL_TRACKS = 60
TAIL_SHARE = 0.1
MOVING_M = 0.05


@dataclass(frozen=True)
class _Shown:
    """The tracks that are drawn, and which of them move."""

    tracks: Int64[np.ndarray, " N"]
    moving: set[int]
    tail_frames: int


def write_contact_sheet(sequence_folder: Path, png: Path, times: int = 6) -> None:
    """Writes a PNG: for each view a row of ``times`` frames with tracks, and a row of depth.

    Moving tracks are bright and still ones pale; a tail shows where a track was on the image just before; a point
    that is hidden is a ring. Depth is bright where it is near, with actors outlined.

    Args:
        sequence_folder: a sequence in the benchmark layout.
        png: file to write.
        times: frames shown, evenly spread from first to last.

    Raises:
        SequenceFormatError: the sequence cannot be read.
    """
    sequence = read_sequence(sequence_folder)
    frames = np.unique(np.linspace(0, len(sequence.tracks_m) - 1, times).round().astype(int)).tolist()
    shown = _choose_tracks(sequence)
    rows: list[tuple[str, list[Image.Image]]] = []
    for index, view in enumerate(sequence.views):
        rows.append((f"view {index}", [_track_cell(sequence, view, frame, shown) for frame in frames]))
        if view.depth_m is not None:
            rows.append(("depth", _depth_cells(view, frames)))
    count = sequence.tracks_m.shape[1]
    share = len(moves := np.flatnonzero(moves_more_than(sequence.tracks_m, MOVING_M))) / max(count, 1)
    title = (
        f"{sequence_folder.name}: {len(sequence.views)} views, {len(sequence.tracks_m)} frames, {count} tracks, "
        f"{len(moves)} moving ({share:.0%}); {len(shown.tracks)} drawn, rings are hidden"
    )
    _assemble(title, [f"frame {frame}" for frame in frames], rows).save(png)


def _choose_tracks(sequence: Sequence) -> _Shown:
    moves = moves_more_than(sequence.tracks_m, MOVING_M)
    moving, still = np.flatnonzero(moves), np.flatnonzero(~moves)
    chosen = [_evenly(moving, MOVING_TRACKS), _evenly(still, STILL_TRACKS)]
    tail_frames = max(2, round(TAIL_SHARE * len(sequence.tracks_m)))
    # Still ones first, so that moving ones lie on top.
    return _Shown(np.concatenate(chosen[::-1]), set(chosen[0].tolist()), min(tail_frames, 16))


def _evenly(tracks: Int64[np.ndarray, " N"], wanted: int) -> Int64[np.ndarray, " M"]:
    places = np.unique(np.linspace(0, len(tracks) - 1, min(wanted, len(tracks))).astype(int))
    return tracks[places] if len(tracks) else tracks


def _track_cell(sequence: Sequence, view: SequenceView, frame: int, shown: _Shown) -> Image.Image:
    rgb = view.image(frame)
    scale = CELL_WIDTH_PX / rgb.shape[1]
    canvas = Canvas(_enlarged(rgb))
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


def _draw_tail(
    canvas: Canvas, path_px: Float64[np.ndarray, "K 2"], colour: tuple[int, int, int], width_px: float
) -> None:
    steps = len(path_px) - 1
    for step in range(steps):
        piece = path_px[step : step + 2]
        if np.isfinite(piece).all():
            canvas.line(piece, colour, width_px, opacity=0.85 * (step + 1) / steps)


def _pixels(
    view: SequenceView, sequence: Sequence, frame: int, tracks: Int64[np.ndarray, " N"]
) -> Float64[np.ndarray, "N 2"]:
    seen = project_to_pixels(view.intrinsics_px, view.camera_from_world[frame], sequence.tracks_m[frame, tracks])
    return np.where(seen[:, 2:] > 0.05, seen[:, :2], np.nan)


def _enlarged(rgb: UInt8[np.ndarray, "H W 3"]) -> UInt8[np.ndarray, "h w 3"]:
    height = round(CELL_WIDTH_PX * rgb.shape[0] / rgb.shape[1])
    method = Image.Resampling.LANCZOS if rgb.shape[1] > CELL_WIDTH_PX else Image.Resampling.BICUBIC
    return np.array(Image.fromarray(rgb).resize((CELL_WIDTH_PX, height), method))


def _depth_cells(view: SequenceView, frames: list[int]) -> list[Image.Image]:
    import cv2

    assert view.depth_m is not None
    chosen = np.stack([view.depth_m[frame] for frame in frames])
    some = chosen[chosen > 0]
    nearest_m, farthest_m = np.percentile(some, [1, 99]).tolist() if len(some) else (1.0, 2.0)
    cells = []
    for frame, depth_m in zip(frames, chosen, strict=True):
        picture = _enlarged(depth_colours(depth_m, nearest_m, farthest_m))
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


def _assemble(title: str, headings: list[str], rows: list[tuple[str, list[Image.Image]]]) -> Image.Image:
    width = MARGIN_PX + len(headings) * (CELL_WIDTH_PX + GAP_PX)
    height = HEADING_PX + sum(cells[0].height + GAP_PX for _, cells in rows)
    sheet = Image.new("RGB", (width, height), BACKGROUND)
    draw = ImageDraw.Draw(sheet)
    draw.text((MARGIN_PX, 4), title, INK, text_font(16))
    for column, heading in enumerate(headings):
        draw.text((MARGIN_PX + column * (CELL_WIDTH_PX + GAP_PX), 25), heading, FAINT, text_font(14))
    top = HEADING_PX
    for name, cells in rows:
        label = Image.new("RGB", (cells[0].height, MARGIN_PX), BACKGROUND)
        ImageDraw.Draw(label).text((label.width // 2, MARGIN_PX // 2), name, INK, text_font(15), anchor="mm")
        sheet.paste(label.rotate(90, expand=True), (0, top))
        for column, cell in enumerate(cells):
            sheet.paste(cell, (MARGIN_PX + column * (CELL_WIDTH_PX + GAP_PX), top))
        top += cells[0].height + GAP_PX
    return sheet
