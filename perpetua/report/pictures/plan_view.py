"""A plan of a sequence from above, with the paths of people and cameras, and curves of how they move."""

from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32, Float64
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from perpetua.audit.geometry import camera_centre_m, moves_more_than
from perpetua.formats.layout import AUDIT
from perpetua.formats.reader import Sequence, SequenceView
from perpetua.io.files import read_json
from perpetua.tracks.motion import MOVING_M

FRUSTUM_M = 0.7
FRUSTA = 5
HEAD_ROOM_M = 2.2
# An object that covers more of the floor is the floor itself or a carpet, and would hide the rest.
STRUCTURE_FRACTION = 0.6
# Footprints are convex, so the footprint of a wall around a corner would cover floor. The floor's outline shows such
# walls.
WALLS = ("wall", "skirting_board")
THICKEST_WALL_M = 0.25
PEOPLE = ("tab:red", "tab:blue", "tab:green", "tab:purple", "tab:brown", "tab:pink")
CAMERAS = ("black", "darkorange", "teal", "crimson", "slateblue", "olive")
# The curves of the audit that are drawn: title, name, whether they are of people.
CURVES = (
    ("people: speed, m/s", "actor_speed_mps", True),
    ("people: to furniture and walls, m (1: or more)", "actor_scene_m", True),
    ("people: to each other, m", "actor_apart_m", True),
    ("people: seen by so many views", "views_seeing", True),
    ("cameras: speed, m/s", "camera_speed_mps", False),
    ("cameras: to the scene, m (1: or more)", "camera_scene_m", False),
    ("cameras: to people, m (1: or more)", "camera_actor_m", False),
)


def write_plan_view(sequence: Sequence, picture: Path) -> None:
    """Writes a picture: room, routes with their pauses, camera paths with frusta over time, curves beside it.

    What a sequence does not record is left out: one that Perpetua did not make shows its tracks and cameras.
    """
    record = sequence.record or {}
    curves = read_json(sequence.folder / AUDIT).get("motion", {}).get("curves", {})
    figure = Figure(figsize=(15.0 if curves else 8.5, 9.0), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(len(CURVES), 2 if curves else 1, width_ratios=(1.4, 1.0) if curves else (1.0,))
    plan = figure.add_subplot(grid[:, 0])
    _draw_room(plan, record)
    _draw_people(plan, sequence, record)
    for number, view in enumerate(sequence.views):
        _draw_camera(plan, view, number)
    _dress(plan, sequence.folder.resolve().name, record)
    if curves:
        _draw_curves([figure.add_subplot(grid[row, 1]) for row in range(len(CURVES))], curves, record)
    # Outside the axes, where the layout makes room for it.
    figure.legend(*plan.get_legend_handles_labels(), loc="outside lower left", ncols=2, fontsize=8, frameon=False)
    figure.savefig(picture)


def _draw_room(plan: Axes, record: dict[str, Any]) -> None:
    outline = record.get("floor_polygon_m")
    if outline:
        plan.add_patch(Polygon(outline, facecolor="#f4f1ea", edgecolor="black", linewidth=2.0, zorder=0))
    floor_m2 = float(np.prod(np.ptp(outline, axis=0))) if outline else np.inf
    objs = [obj for obj in record.get("objects", []) if len(obj.get("footprint_m", [])) >= 3]
    for obj in sorted(objs, key=lambda obj: obj["height_range_m"][1]):
        spread_m2 = float(np.prod(np.ptp(obj["footprint_m"], axis=0)))
        if obj["height_range_m"][0] > HEAD_ROOM_M or spread_m2 > STRUCTURE_FRACTION * floor_m2:
            continue
        if obj["category"] in WALLS and _width_m(np.array(obj["footprint_m"], np.float32)) > THICKEST_WALL_M:
            continue
        shade = "#dfe8d8" if obj["walkable"] else "#c9b79c"
        plan.add_patch(Polygon(obj["footprint_m"], facecolor=shade, edgecolor="#7a6a50", linewidth=0.6, zorder=1))


def _width_m(footprint_m: Float32[np.ndarray, "N 2"]) -> float:
    """The shorter side of the smallest rectangle around a footprint."""
    import cv2

    return float(min(cv2.minAreaRect(footprint_m)[1]))


def _draw_people(plan: Axes, sequence: Sequence, record: dict[str, Any]) -> None:
    people = _people(record)
    if not people:
        moving = moves_more_than(sequence.tracks_m, MOVING_M)
        still_m, moved_m = sequence.tracks_m[0, ~moving], sequence.tracks_m[:, moving].reshape(-1, 3)
        plan.scatter(still_m[:, 0], still_m[:, 1], s=2, color="grey")
        plan.scatter(moved_m[:, 0], moved_m[:, 1], s=0.5, color="tab:red")
    for number, person in enumerate(people):
        route_m, colour = np.array(person["route_m"]), PEOPLE[number % len(PEOPLE)]
        plan.plot(route_m[:, 0], route_m[:, 1], color=colour, linewidth=2.5, zorder=3, label=_caption(person))
        plan.scatter(route_m[0, 0], route_m[0, 1], s=60, color=colour, zorder=4)
        for pause in person.get("dwells", []):
            mark = {"sit": "s", "look": "*", "stand": "D"}.get(pause["purpose"], "o")
            x_m, y_m, _ = route_m[pause["first_frame"]]
            plan.scatter(x_m, y_m, s=70, marker=mark, facecolor="white", edgecolor=colour, zorder=4)


def _draw_camera(plan: Axes, view: SequenceView, number: int) -> None:
    centre_m = np.stack([camera_centre_m(pose) for pose in view.camera_from_world])
    colour = CAMERAS[number % len(CAMERAS)]
    plan.plot(
        centre_m[:, 0], centre_m[:, 1], color=colour, linewidth=1.5, linestyle="--", zorder=5, label=f"view {number}"
    )
    for fraction in np.linspace(0.0, 1.0, FRUSTA):
        frame = round(fraction * (len(centre_m) - 1))
        corners_m = _frustum_m(view, frame, centre_m[frame])
        plan.fill(corners_m[:, 0], corners_m[:, 1], facecolor=colour, alpha=0.08, edgecolor="none", zorder=2)
        plan.plot(corners_m[:, 0], corners_m[:, 1], color=colour, alpha=0.9 - 0.6 * fraction, linewidth=0.8, zorder=5)
    x_m, y_m, _ = centre_m[0]
    plan.text(x_m, y_m, f" {number}", color=colour, fontsize=12, fontweight="bold", zorder=6)


def _frustum_m(view: SequenceView, frame: int, centre_m: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "4 2"]:
    """The sides of the image from above: a triangle, closed."""
    fx, _, cx, _ = np.asarray(view.intrinsics_px, np.float64)
    world_from_camera = np.asarray(view.camera_from_world[frame, :3, :3], np.float64).T
    # The principal point is taken as the middle, so the image's sides lie cx to its left and right.
    sides = np.array([[-cx / fx, 0.0, 1.0], [cx / fx, 0.0, 1.0]]) * FRUSTUM_M
    ends_m = centre_m + sides @ world_from_camera.T
    return np.stack([centre_m, ends_m[0], ends_m[1], centre_m])[:, :2]


def _dress(plan: Axes, name: str, record: dict[str, Any]) -> None:
    kind = record.get("room_kind")
    plan.set_title(f"{name}, {kind}" if kind else name)
    plan.set_aspect("equal")
    plan.set_xlabel("x, m")
    plan.set_ylabel("y, m")


def _draw_curves(rows: list[Axes], curves: dict[str, Any], record: dict[str, Any]) -> None:
    fps = float(record.get("fps", 1.0))
    for axes, (title, name, of_people) in zip(rows, CURVES, strict=True):
        colours = PEOPLE if of_people else CAMERAS
        for number, values in enumerate(curves[name]):
            axes.plot(np.arange(len(values)) / fps, values, color=colours[number % len(colours)], linewidth=1.2)
        axes.set_title(title, fontsize=9, loc="left", pad=2)
        axes.tick_params(labelsize=8)
        axes.set_ylim(bottom=0.0)
        axes.margins(x=0.0)
        if axes is not rows[-1]:
            axes.set_xticklabels([])
    rows[-1].set_xlabel("seconds", fontsize=8)


def _people(record: dict[str, Any]) -> list[dict[str, Any]]:
    return [obj for obj in record.get("objects", []) if obj.get("route_m")]


def _caption(person: dict[str, Any]) -> str:
    return f"{person['name']}: {person.get('action', '')}".rstrip(": ")
