"""Planes of triangles in double precision."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64, Integer

# A ray that is closer than this to lying in a plane says nothing about where it meets it.
LEAST_SLOPE = 1e-3


@dataclass(frozen=True)
class Planes:
    """``normal`` has unit length (zero for a triangle without area); a place is on a plane where its product with
    the normal is ``offset_m``."""

    normal: Float64[np.ndarray, "N 3"]
    offset_m: Float64[np.ndarray, " N"]

    @classmethod
    def of(cls, corner_m: Float64[np.ndarray, "N 3 3"]) -> "Planes":
        """The planes of triangles; normals point to where corners go round counter-clockwise."""
        normal = np.cross(corner_m[:, 1] - corner_m[:, 0], corner_m[:, 2] - corner_m[:, 0])
        normal /= np.maximum(np.sqrt(np.einsum("nc,nc->n", normal, normal)), 1e-30)[:, None]
        return cls(normal, np.einsum("nc,nc->n", normal, corner_m[:, 0]))

    def take(self, chosen: Integer[np.ndarray, " M"] | Bool[np.ndarray, " N"]) -> "Planes":
        """Some of the planes."""
        return Planes(self.normal[chosen], self.offset_m[chosen])

    def height_m(self, place_m: Float64[np.ndarray, "N 3"]) -> Float64[np.ndarray, " N"]:
        """How far a place lies before each plane, on the side that the normal points to."""
        return np.asarray(np.einsum("nc,nc->n", self.normal, place_m) - self.offset_m)

    def along_m(
        self,
        eye_m: Float64[np.ndarray, "N 3"],
        unit: Float64[np.ndarray, "N 3"],
        rough_m: Float32[np.ndarray, " N"],
    ) -> Float64[np.ndarray, " N"]:
        """Length of rays to their planes; ``rough_m`` for those that almost lie in them."""
        slope = np.einsum("nc,nc->n", self.normal, unit)
        grazing = np.abs(slope) < LEAST_SLOPE
        exact_m = -self.height_m(eye_m) / np.where(grazing, 1.0, slope)
        return np.where(grazing, rough_m.astype(np.float64), exact_m)
