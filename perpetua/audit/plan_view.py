"""A plan of a sequence from above: where people and cameras go, and what each camera sees."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float64
from PIL import Image, ImageDraw

from perpetua.audit.drawing import BACKGROUND, INK, SMOOTH, Canvas, text_font, track_colour
from perpetua.audit.geometry import camera_centre_m, moves_more_than
from perpetua.formats.reader import Sequence, SequenceView, read_sequence

SIZE_PX = 900
BORDER_PX = 60
FRUSTUM_M = 0.9
MOVING_M = 0.05
CAMERA_COLOUR = (255, 255, 255)


@dataclass(frozen=True)
class _Plan:
    """Maps world x, y in metres to pixels, north (+Y) up."""

    low_m: Float64[np.ndarray, "2"]
    scale_px: float
    height_px: int

    def __call__(self, world_m: Float[np.ndarray, "*batch 3"]) -> Float64[np.ndarray, "*batch 2"]:
        place = (np.asarray(world_m, np.float64)[..., :2] - self.low_m) * self.scale_px + BORDER_PX
        place[..., 1] = self.height_px - place[..., 1]
        return place


def write_plan_view(sequence_folder: Path, png: Path) -> None:
    """Writes a PNG: still tracks as dots shaded by height, routes of moving objects, camera paths with frusta.

    Raises:
        SequenceFormatError: the sequence cannot be read.
    """
    sequence = read_sequence(sequence_folder)
    centres_m = [np.stack([camera_centre_m(pose) for pose in view.camera_from_world]) for view in sequence.views]
    moves = moves_more_than(sequence.tracks_m, MOVING_M)
    everything_m = np.concatenate([sequence.tracks_m.reshape(-1, 3).astype(np.float64), *centres_m])[:, :2]
    low_m, high_m = everything_m.min(axis=0), everything_m.max(axis=0)
    scale_px = (SIZE_PX - 2 * BORDER_PX) / max(float((high_m - low_m).max()), 1e-3)
    width_px, height_px = (np.ceil((high_m - low_m) * scale_px).astype(int) + 2 * BORDER_PX).tolist()
    plan = _Plan(low_m, scale_px, height_px)
    canvas = Canvas(np.full((height_px, width_px, 3), BACKGROUND, np.uint8))
    _draw_still(canvas, plan, sequence.tracks_m[0, ~moves])
    labels = _draw_routes(canvas, plan, sequence, np.flatnonzero(moves))
    for index, (view, centre_m) in enumerate(zip(sequence.views, centres_m, strict=True)):
        _draw_camera(canvas, plan, view, centre_m)
        labels.append((plan(centre_m[0]), f"view {index}"))
    _labelled(canvas.picture(), labels, plan).save(png)


def _draw_still(canvas: Canvas, plan: _Plan, points_m: Float[np.ndarray, "N 3"]) -> None:
    for point_m in points_m[np.argsort(points_m[:, 2], kind="stable")]:
        level = int(90 + 140 * np.clip(point_m[2] / 2.5, 0.0, 1.0))
        canvas.dot(plan(point_m), (level, level, min(255, level + 20)), 2.0)


def _draw_routes(canvas: Canvas, plan: _Plan, sequence: Sequence, moving: np.ndarray) -> list[tuple[np.ndarray, str]]:
    """The mean position of each moving object's tracks, or each moving track where objects are not recorded."""
    record = sequence.record or {}
    objects = np.asarray(record.get("tracks", {}).get("object_index", np.arange(sequence.tracks_m.shape[1])))
    names = {thing["object_index"]: str(thing.get("name")) for thing in record.get("objects", [])}
    labels = []
    for number, object_index in enumerate(np.unique(objects[moving]).tolist()):
        members = moving[objects[moving] == object_index]
        route_px = plan(sequence.tracks_m[:, members].mean(axis=1))
        colour = track_colour(number, True)
        canvas.line(route_px, colour, 2.0 if len(members) > 1 else 0.7, 0.9)
        canvas.dot(route_px[0], colour, 6.0 if len(members) > 1 else 1.5)
        if len(members) > 1:
            labels.append((route_px[0], names.get(object_index, f"object {object_index}")))
    return labels


def _draw_camera(canvas: Canvas, plan: _Plan, view: SequenceView, centre_m: Float64[np.ndarray, "F 3"]) -> None:
    canvas.line(plan(centre_m), CAMERA_COLOUR, 1.5)
    fx, _, cx, _ = np.asarray(view.intrinsics_px, np.float64)
    for frame in (0, len(centre_m) - 1):
        world_from_camera = np.asarray(view.camera_from_world[frame, :3, :3], np.float64).T
        # The principal point is taken for the middle, so the image's sides lie cx to its left and right.
        sides = np.array([[-cx / fx, 0.0, 1.0], [cx / fx, 0.0, 1.0]]) * FRUSTUM_M
        ends_m = centre_m[frame] + sides @ world_from_camera.T
        corners = plan(np.stack([centre_m[frame], ends_m[0], ends_m[1], centre_m[frame]]))
        canvas.line(corners, CAMERA_COLOUR, 1.0, 0.9 if frame == 0 else 0.4)
    canvas.dot(plan(centre_m[0]), CAMERA_COLOUR, 4.0)


def _labelled(picture: Image.Image, labels: list[tuple[np.ndarray, str]], plan: _Plan) -> Image.Image:
    draw = ImageDraw.Draw(picture)
    for place, text in labels:
        x, y = place.tolist()
        draw.text((x + 8, y - 18), text, INK, text_font(15), stroke_width=SMOOTH - 1, stroke_fill=BACKGROUND)
    bar_px = plan.scale_px
    bottom = picture.height - 22
    draw.line((BORDER_PX, bottom, BORDER_PX + bar_px, bottom), INK, 3)
    draw.text((BORDER_PX + bar_px + 8, bottom - 10), "1 m", INK, text_font(15))
    return picture
