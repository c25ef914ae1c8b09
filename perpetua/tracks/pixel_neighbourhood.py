"""What images show at the pixel centres around the projections of points."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64, UInt16

from perpetua.geometry.pinhole import Intrinsics, inside_image, project
from perpetua.geometry.transforms import transform_points

CORNERS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])


@dataclass(frozen=True)
class ViewFrame:
    """What one camera saw at one frame; ``camera_from_world`` and ``intrinsics`` as they are exported."""

    frame: int
    camera_from_world: Float64[np.ndarray, "4 4"]
    intrinsics: Intrinsics
    depth_m: Float32[np.ndarray, "H W"]
    object_index: UInt16[np.ndarray, "H W"]

    @property
    def centre_m(self) -> Float64[np.ndarray, "3"]:
        """Where the camera is in the world."""
        return np.asarray(-self.camera_from_world[:3, :3].T @ self.camera_from_world[:3, 3])


@dataclass(frozen=True)
class PixelNeighbourhood:
    """Each pair of a view and a point inside its image, and the four pixel centres around the projection.

    ``view`` and ``point`` say which pair, ``eye_m`` where the view's camera is, ``pixel_rad`` what a pixel spans.
    Of the pixels: whether they lie on the image, what they show, and their rays' directions in the world, as long as
    one metre of depth.
    """

    view: Int64[np.ndarray, " M"]
    point: Int64[np.ndarray, " M"]
    eye_m: Float64[np.ndarray, "M 3"]
    pixel_rad: Float64[np.ndarray, " M"]
    valid: Bool[np.ndarray, "M 4"]
    shown: UInt16[np.ndarray, "M 4"]
    depth_m: Float64[np.ndarray, "M 4"]
    direction: Float64[np.ndarray, "M 4 3"]

    @classmethod
    def of(cls, point_m: Float64[np.ndarray, "N 3"], views: Sequence[ViewFrame]) -> "PixelNeighbourhood":
        """The pairs of all views, view by view."""
        return _join([cls._in_view(point_m, number, seen) for number, seen in enumerate(views)])

    @classmethod
    def _in_view(cls, point_m: Float64[np.ndarray, "N 3"], number: int, seen: ViewFrame) -> "PixelNeighbourhood":
        inner = seen.intrinsics
        pixel_px = project(inner, transform_points(seen.camera_from_world, point_m))
        point = np.flatnonzero(inside_image(inner, pixel_px))
        corner = np.floor(pixel_px[point]).astype(np.int64)[:, None] + CORNERS
        column, row = corner[..., 0], corner[..., 1]
        valid = (column >= 0) & (column < inner.width_px) & (row >= 0) & (row < inner.height_px)
        column, row = np.clip(column, 0, inner.width_px - 1), np.clip(row, 0, inner.height_px - 1)
        ray = np.ones((len(point), 4, 3))
        ray[..., 0], ray[..., 1] = (column - inner.cx_px) / inner.fx_px, (row - inner.cy_px) / inner.fy_px
        return cls(
            view=np.full(len(point), number),
            point=point,
            eye_m=np.repeat(seen.centre_m[None], len(point), axis=0),
            pixel_rad=np.full(len(point), 1.0 / inner.fx_px),
            valid=valid,
            shown=seen.object_index[row, column],
            depth_m=seen.depth_m[row, column].astype(np.float64),
            direction=np.einsum("nkj,ji->nki", ray, seen.camera_from_world[:3, :3]),
        )


def _join(parts: list[PixelNeighbourhood]) -> PixelNeighbourhood:
    return PixelNeighbourhood(
        *(np.concatenate([getattr(part, name) for part in parts]) for name in PixelNeighbourhood.__dataclass_fields__)
    )
