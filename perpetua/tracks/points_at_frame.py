"""Points and the planes of their triangles in the world, frame by frame, rounded as a reader of the files has them."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Float64, Int32, Int64

from perpetua.geometry.planes import Planes
from perpetua.tracks.surface import BoundPoints
from perpetua.tracks.watertight import WatertightFaces


def as_exported(values: Float[np.ndarray, "*shape"]) -> Float64[np.ndarray, "*shape"]:
    """The values that a reader of the files computes with: rounded to float32."""
    return values.astype(np.float32).astype(np.float64)


@dataclass(frozen=True)
class PointsAtFrame:
    """Points at one frame: places and planes of their triangles in the world."""

    point_m: Float64[np.ndarray, "N 3"]
    planes: Planes
    object_index: Int32[np.ndarray, " N"]
    face: Int32[np.ndarray, " N"]
    watertight: WatertightFaces

    def take(self, chosen: Int64[np.ndarray, " M"] | Bool[np.ndarray, " N"]) -> "PointsAtFrame":
        """Some of the points."""
        return PointsAtFrame(
            self.point_m[chosen],
            self.planes.take(chosen),
            self.object_index[chosen],
            self.face[chosen],
            self.watertight.take(chosen),
        )


class PointsOverTime:
    """Puts points where they are at a frame; what never moves is computed once."""

    def __init__(self, bound: BoundPoints, watertight: WatertightFaces) -> None:
        self._bound, self._watertight = bound, watertight
        self._point_m = as_exported(bound.point_m(0))
        self._planes = Planes.of(as_exported(bound.corner_m(0)))

    def at(self, frame: int) -> PointsAtFrame:
        """The points at a frame."""
        for members, corner_m in self._bound.moved_corner_m(frame):
            weight = self._bound.points.barycentric[members]
            self._point_m[members] = as_exported(np.einsum("nk,nkc->nc", weight, corner_m))
            planes = Planes.of(as_exported(corner_m))
            self._planes.normal[members], self._planes.offset_m[members] = planes.normal, planes.offset_m
        points = self._bound.points
        return PointsAtFrame(self._point_m, self._planes, points.object_index, points.face, self._watertight)
