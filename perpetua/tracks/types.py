"""What the track stage hands on. C cameras, T frames, N tracks."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32


@dataclass(frozen=True)
class PointTracks:
    """Points fixed to a triangle of an object, and where they are in the world at each frame.

    ``face`` counts through ``SceneObject.mesh.faces`` or ``ActorMesh.faces`` of the object with ``object_index``.
    """

    position_m: Float64[np.ndarray, "T N 3"]
    object_index: Int32[np.ndarray, " N"]
    face: Int32[np.ndarray, " N"]
    barycentric: Float64[np.ndarray, "N 3"]


@dataclass(frozen=True)
class ViewTracks:
    """The tracks seen by each camera; ``pixel_px`` and ``depth_m`` are NaN behind the camera."""

    pixel_px: Float64[np.ndarray, "C T N 2"]
    depth_m: Float64[np.ndarray, "C T N"]
    visible: Bool[np.ndarray, "C T N"]


@dataclass(frozen=True)
class SequenceTracks:
    """Everything the track stage made; ``queries_xytv`` as in the file layout."""

    points: PointTracks
    views: ViewTracks
    queries_xytv: Float32[np.ndarray, "N 4"]
