"""In which views and frames a point is seen: the image must show its object there, and an exact ray must reach it.

Two witnesses are asked.

- The image. Among the (up to) four pixel centres around the projection, one must show the point's object at the depth
  that the plane of the point's own triangle has along that pixel's ray; so a slanted surface needs no loose tolerance,
  and points on edges and thin objects are not lost. Where the object is shown but its surface bends away from that
  plane, the depth of the triangles near the point counts instead: those that the rays of the pixel centres meet
  within two pixels of it.
- The ray from the camera to the point must meet nothing opaque before it. A point on the back of a closed surface is
  seen only where the ray meets its own triangle first, as through the opening of a sleeve; elsewhere its front hides
  it, however thin the object is.

A point is visible where both say so. Where they differ it is hidden, and counted by the reason (``VisibilityReport``).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from perpetua.geometry.pinhole import Intrinsics
from perpetua.geometry.planes import Planes
from perpetua.geometry.transforms import invert_rigid
from perpetua.scene.camera import CameraPath
from perpetua.scene.scene import RenderedView
from perpetua.tracks.config import TracksConfig
from perpetua.tracks.pixel_neighbourhood import PixelNeighbourhood, ViewFrame
from perpetua.tracks.points_at_frame import PointsAtFrame, PointsOverTime, as_exported
from perpetua.tracks.ray_caster import HairFaces, SceneRayCaster
from perpetua.tracks.surface import BoundPoints
from perpetua.tracks.types import VisibilityReport
from perpetua.tracks.watertight import WatertightFaces

# A ray has reached its point this far before it. Which triangle it meets is known to single precision, how far that is
# to double, so no more is needed than where two triangles meet at an edge.
REACHED_M, REACHED_FRACTION = 5e-5, 5e-6
# Rendered depth is what the meshes have along the ray when it is within this.
SAME_DEPTH_M, SAME_DEPTH_FRACTION = 1e-3, 1e-4
# What hides a point from closer than this lies on it: a shirt on skin, a rug on the floor.
COINCIDENT_M = 0.01
# Triangles within so many pixels of a point, measured along its surface, are its neighbours.
NEIGHBOUR_PX = 2.0
GRAZING_COSINE = float(np.cos(np.radians(80.0)))


@dataclass(frozen=True)
class ViewVisibility:
    """Where points are visible at the frames asked for, and how the witnesses agreed."""

    visible: Bool[np.ndarray, "C S N"]
    report: VisibilityReport


def exported_intrinsics(camera: CameraPath) -> Intrinsics:
    """The intrinsics that a reader of the files computes with."""
    given = camera.intrinsics
    fx_px, fy_px, cx_px, cy_px = as_exported(np.array([given.fx_px, given.fy_px, given.cx_px, given.cy_px])).tolist()
    return Intrinsics(fx_px, fy_px, cx_px, cy_px, given.width_px, given.height_px)


def visible_in_views(
    bound: BoundPoints,
    watertight: WatertightFaces,
    ray_caster: SceneRayCaster,
    hair: HairFaces,
    cameras: tuple[CameraPath, ...],
    views: tuple[RenderedView, ...],
    frames: Int64[np.ndarray, " S"],
    config: TracksConfig,
) -> ViewVisibility:
    """Whether each point is seen by each camera at some frames; frame by frame, so that views may lie on disk."""
    visible = np.zeros((len(cameras), len(frames), len(bound.points)), bool)
    intrinsics = [exported_intrinsics(camera) for camera in cameras]
    camera_from_world = [as_exported(invert_rigid(camera.world_from_camera)) for camera in cameras]
    report = VisibilityReport()
    placement = PointsOverTime(bound, watertight)
    for place, frame in enumerate(frames.tolist()):
        seen = [
            ViewFrame(
                frame,
                camera_from_world[index][frame],
                intrinsics[index],
                np.asarray(view.depth_m[frame]),
                np.asarray(view.object_index[frame]),
            )
            for index, view in enumerate(views)
        ]
        visible[:, place], counted = visible_in_frame(placement.at(frame), seen, ray_caster, hair, config)
        report = report + counted
    return ViewVisibility(visible, report)


def visible_in_frame(
    placed: PointsAtFrame, views: Sequence[ViewFrame], ray_caster: SceneRayCaster, hair: HairFaces, config: TracksConfig
) -> tuple[Bool[np.ndarray, "C N"], VisibilityReport]:
    """Whether points are seen in each image of one frame, and how the two witnesses agreed."""
    neighbourhood = PixelNeighbourhood.of(placed.point_m, views)
    points = placed.take(neighbourhood.point)
    shows = neighbourhood.valid & (neighbourhood.shown == points.object_index[:, None])
    offset_m = points.point_m - neighbourhood.eye_m
    hits = ray_caster.first_hit(views[0].frame, neighbourhood.eye_m, offset_m)
    length_m = np.sqrt(np.einsum("nc,nc->n", offset_m, offset_m))
    height_m = points.planes.height_m(neighbourhood.eye_m)
    cosine = np.abs(height_m) / np.maximum(length_m, 1e-30)
    own = (hits.object_index == points.object_index) & (hits.face == points.face)
    reached = own | (hits.distance_m >= length_m * (1.0 - REACHED_FRACTION) - REACHED_M)
    turned = (height_m <= 0.0) & points.watertight.hide_back(neighbourhood.eye_m) & ~own
    reached &= ~turned
    agrees = (shows & _on_plane(points.planes, height_m, neighbourhood, config)).any(axis=1)
    unsure = np.flatnonzero(reached & ~agrees & shows.any(axis=1))
    reach_m = NEIGHBOUR_PX * length_m * neighbourhood.pixel_rad / np.maximum(cosine, GRAZING_COSINE)
    as_meshed = np.zeros(len(reached), bool)
    agrees[unsure], as_meshed[unsure] = _on_neighbours(
        points.point_m, reach_m, unsure, shows, neighbourhood, ray_caster, views[0].frame
    )
    visible = np.zeros((len(views), len(placed.point_m)), bool)
    visible[neighbourhood.view, neighbourhood.point] = reached & agrees
    findings = _Findings(
        reached=reached,
        agrees=agrees,
        hair=hair.has(points.object_index, points.face) | (~reached & hair.has(hits.object_index, hits.face)),
        coincident=(length_m - hits.distance_m < COINCIDENT_M) | turned,
        grazing=cosine < GRAZING_COSINE,
        blocker_shown=(neighbourhood.valid & (neighbourhood.shown == hits.object_index[:, None])).any(axis=1),
        object_shown=shows.any(axis=1),
        as_meshed=as_meshed,
    )
    return visible, _count(visible.size, findings)


def _on_plane(
    planes: Planes, height_m: Float64[np.ndarray, " M"], neighbourhood: PixelNeighbourhood, config: TracksConfig
) -> Bool[np.ndarray, "M 4"]:
    """Whether rendered depth is that of each point's own plane along the rays of the pixel centres."""
    with np.errstate(divide="ignore", invalid="ignore"):
        plane_m = -height_m[:, None] / np.einsum("nc,nkc->nk", planes.normal, neighbourhood.direction)
        in_front_m = plane_m - neighbourhood.depth_m
        return np.asarray(
            np.isfinite(plane_m)
            & (plane_m > 0.0)
            & (in_front_m <= config.tolerance_m + config.tolerance_share * plane_m)
            & (-in_front_m <= config.behind_m + config.behind_share * plane_m)
        )


def _on_neighbours(
    point_m: Float64[np.ndarray, "M 3"],
    reach_m: Float64[np.ndarray, " M"],
    chosen: Int64[np.ndarray, " U"],
    shows: Bool[np.ndarray, "M 4"],
    neighbourhood: PixelNeighbourhood,
    ray_caster: SceneRayCaster,
    frame: int,
) -> tuple[Bool[np.ndarray, " U"], Bool[np.ndarray, " U"]]:
    """Whether some pixel around that shows the point's object was rendered where its ray meets a triangle near the
    point; and whether all pixels around that show it were rendered where their rays meet it, near or not."""
    member, corner = np.nonzero(shows[chosen])
    pair = chosen[member]
    direction, eye_m = neighbourhood.direction[pair, corner], neighbourhood.eye_m[pair]
    hits = ray_caster.first_hit(frame, eye_m, direction)
    meshed_m = hits.distance_m / np.linalg.norm(direction, axis=1)
    rendered_m = neighbourhood.depth_m[pair, corner]
    same = np.abs(meshed_m - rendered_m) <= SAME_DEPTH_M + SAME_DEPTH_FRACTION * rendered_m
    same &= hits.object_index == neighbourhood.shown[pair, corner]
    as_meshed = np.ones(len(chosen), bool)
    np.logical_and.at(as_meshed, member, same)
    hit_m = eye_m + direction * np.where(np.isfinite(meshed_m), meshed_m, 0.0)[:, None]
    same &= np.linalg.norm(hit_m - point_m[pair], axis=1) <= reach_m[pair]
    confirmed = np.zeros(len(chosen), bool)
    np.logical_or.at(confirmed, member, same)
    return confirmed, as_meshed


@dataclass(frozen=True)
class _Findings:
    """What the witnesses say of points inside images, and what may explain that they differ.

    ``hair``: the point, or what blocks its ray, is hair. ``coincident``: the ray is blocked close before the point, or
    the point is on a hidden back. ``blocker_shown`` and ``object_shown``: a pixel around shows what the ray meets, or
    the point's object. ``as_meshed``: all pixels around that show the object were rendered where the mesh is.
    """

    reached: Bool[np.ndarray, " N"]
    agrees: Bool[np.ndarray, " N"]
    hair: Bool[np.ndarray, " N"]
    coincident: Bool[np.ndarray, " N"]
    grazing: Bool[np.ndarray, " N"]
    blocker_shown: Bool[np.ndarray, " N"]
    object_shown: Bool[np.ndarray, " N"]
    as_meshed: Bool[np.ndarray, " N"]


def _count(entries: int, found: _Findings) -> VisibilityReport:
    """Counts entries by what the witnesses said and, where they differ, by the first reason that applies."""
    blocked, unseen = found.agrees & ~found.reached, found.reached & ~found.agrees
    of_blocked = _first_reason(blocked, found.hair, found.coincident, found.grazing, ~found.blocker_shown)
    of_unseen = _first_reason(unseen, found.hair, found.grazing, ~found.object_shown, found.as_meshed)
    return VisibilityReport(
        entries=entries,
        inside=len(found.reached),
        visible=int((found.reached & found.agrees).sum()),
        blocked_hair=of_blocked[0],
        blocked_coincident=of_blocked[1],
        blocked_grazing=of_blocked[2],
        blocked_thin=of_blocked[3],
        blocked_edge=of_blocked[4],
        unseen_hair=of_unseen[0],
        unseen_grazing=of_unseen[1],
        unseen_thin=of_unseen[2],
        unseen_edge=of_unseen[3],
        unseen_otherwise=of_unseen[4],
    )


def _first_reason(cases: Bool[np.ndarray, " N"], *reasons: Bool[np.ndarray, " N"]) -> list[int]:
    """How many cases have each reason but none of those before it; the last count is of cases without a reason."""
    counts, left = [], cases
    for reason in reasons:
        counts.append(int((left & reason).sum()))
        left = left & ~reason
    return [*counts, int(left.sum())]
