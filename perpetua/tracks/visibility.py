"""In which views and frames a point is seen: its pixel must show its object, at its own surface's depth."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64, Int32, Int64, UInt16

from perpetua.cameras.types import CameraPath
from perpetua.geometry.pinhole import Intrinsics, inside_image, project
from perpetua.geometry.transforms import invert_rigid, transform_points
from perpetua.rendering.types import RenderedView
from perpetua.tracks.config import TracksConfig
from perpetua.tracks.sides import ClosedSides
from perpetua.tracks.surface import BoundPoints


@dataclass(frozen=True)
class ViewFrame:
    """What one camera saw at one frame; ``camera_from_world`` and ``intrinsics`` as they are exported."""

    camera_from_world: Float64[np.ndarray, "4 4"]
    intrinsics: Intrinsics
    depth_m: Float32[np.ndarray, "H W"]
    object_index: UInt16[np.ndarray, "H W"]


def as_exported(values: Float[np.ndarray, "*shape"]) -> Float64[np.ndarray, "*shape"]:
    """The values that a reader of the files computes with: rounded to float32."""
    return values.astype(np.float32).astype(np.float64)


def exported_intrinsics(camera: CameraPath) -> Intrinsics:
    """The intrinsics that a reader of the files computes with."""
    given = camera.intrinsics
    fx_px, fy_px, cx_px, cy_px = as_exported(np.array([given.fx_px, given.fy_px, given.cx_px, given.cy_px])).tolist()
    return Intrinsics(fx_px, fy_px, cx_px, cy_px, given.width_px, given.height_px)


def visible_in_views(
    bound: BoundPoints,
    sides: ClosedSides,
    cameras: tuple[CameraPath, ...],
    views: tuple[RenderedView, ...],
    config: TracksConfig,
) -> Bool[np.ndarray, "C T N"]:
    """Whether each point is seen by each camera at each frame; frame by frame, so that views may lie on disk."""
    frames = len(cameras[0].world_from_camera)
    visible = np.zeros((len(cameras), frames, len(bound.points)), bool)
    position_m = bound.position_m(frames)
    intrinsics = [exported_intrinsics(camera) for camera in cameras]
    camera_from_world = [as_exported(invert_rigid(camera.world_from_camera)) for camera in cameras]
    for frame in range(frames):
        corner_m = as_exported(bound.corner_m(frame))
        point_m = as_exported(position_m[frame])
        for index, view in enumerate(views):
            seen = ViewFrame(
                camera_from_world[index][frame],
                intrinsics[index],
                np.asarray(view.depth_m[frame]),
                np.asarray(view.object_index[frame]),
            )
            visible[index, frame] = visible_in_frame(point_m, corner_m, bound.points.object_index, sides, seen, config)
    return visible


def visible_in_frame(
    point_m: Float64[np.ndarray, "N 3"],
    corner_m: Float64[np.ndarray, "N 3 3"],
    object_index: Int32[np.ndarray, " N"],
    sides: ClosedSides,
    seen: ViewFrame,
    config: TracksConfig,
) -> Bool[np.ndarray, " N"]:
    """Whether points are seen in one image.

    The pixel that the point falls into must show the point's object, and the depth rendered at that pixel's centre
    must be the depth that the plane of the point's own triangle has along the ray of that centre. So a slanted
    surface needs no loose tolerance. Points on the back of a closed surface are not seen.
    """
    visible = np.zeros(len(point_m), bool)
    pixel_px = project(seen.intrinsics, transform_points(seen.camera_from_world, point_m))
    inside = np.flatnonzero(inside_image(seen.intrinsics, pixel_px))
    column, row = nearest_pixel(pixel_px[inside])
    same = seen.object_index[row, column] == object_index[inside]
    inside, column, row = inside[same], column[same], row[same]
    plane_m, facing = _plane_depth(corner_m[inside], seen, column, row)
    in_front_m = plane_m - seen.depth_m[row, column]
    agrees = (
        np.isfinite(plane_m)
        & (plane_m > 0.0)
        & (in_front_m <= config.tolerance_m + config.tolerance_share * plane_m)
        & (-in_front_m <= config.behind_m + config.behind_share * plane_m)
    )
    visible[inside] = agrees & (facing | ~_hides_its_back(sides, seen, inside))
    return visible


def nearest_pixel(
    pixel_px: Float64[np.ndarray, "N 2"],
) -> tuple[Int64[np.ndarray, " N"], Int64[np.ndarray, " N"]]:
    """Column and row of the pixel that each projection falls into."""
    nearest = np.floor(pixel_px + 0.5).astype(np.int64)
    return nearest[:, 0], nearest[:, 1]


def _plane_depth(
    corner_m: Float64[np.ndarray, "N 3 3"],
    seen: ViewFrame,
    column: Int64[np.ndarray, " N"],
    row: Int64[np.ndarray, " N"],
) -> tuple[Float64[np.ndarray, " N"], Bool[np.ndarray, " N"]]:
    """Depth of each triangle's plane along the ray of a pixel centre, and whether its front faces the camera."""
    camera = seen.intrinsics
    corner_m = transform_points(seen.camera_from_world, corner_m.reshape(-1, 3)).reshape(-1, 3, 3)
    normal = np.cross(corner_m[:, 1] - corner_m[:, 0], corner_m[:, 2] - corner_m[:, 0])
    ray = np.stack(
        [(column - camera.cx_px) / camera.fx_px, (row - camera.cy_px) / camera.fy_px, np.ones(len(column))], axis=1
    )
    offset = np.einsum("nc,nc->n", normal, corner_m[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        plane_m = offset / np.einsum("nc,nc->n", normal, ray)
    return plane_m, offset < 0.0


def _hides_its_back(sides: ClosedSides, seen: ViewFrame, points: Int64[np.ndarray, " N"]) -> Bool[np.ndarray, " N"]:
    """Closed surfaces hide their backs from cameras outside; a closed room is seen from inside."""
    rotation, translation = seen.camera_from_world[:3, :3], seen.camera_from_world[:3, 3]
    camera_m = -rotation.T @ translation
    box_m = sides.box_m[points]
    inside = ((camera_m >= box_m[:, 0]) & (camera_m <= box_m[:, 1])).all(axis=1)
    return np.asarray(sides.closed[points] & ~inside)
