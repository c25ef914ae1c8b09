"""What the track stage hands on. C cameras, T frames, N tracks."""

from dataclasses import dataclass, fields

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
class VisibilityReport:
    """How image and ray agreed about (view, frame, track) entries; where they differ the entry counts as hidden.

    ``blocked_*``: the image shows the point's surface at a pixel around it, and the exact ray is stopped: by or on
    hair; by something less than 1 cm before the point (or the point is on the back of a closed surface); at a grazing
    angle; by an object so thin that no pixel around shows it; by an edge. ``unseen_*``: the ray reaches the point, and
    no pixel around shows its surface: hair; a grazing angle; nothing of its object in any pixel around (thin objects);
    only other parts of its object, just where the meshes have them (edges, and thin parts such as a rim); otherwise,
    which is a rendered surface that is not where the mesh is.
    """

    entries: int = 0
    inside: int = 0
    visible: int = 0
    blocked_hair: int = 0
    blocked_coincident: int = 0
    blocked_grazing: int = 0
    blocked_thin: int = 0
    blocked_edge: int = 0
    unseen_hair: int = 0
    unseen_grazing: int = 0
    unseen_thin: int = 0
    unseen_edge: int = 0
    unseen_otherwise: int = 0

    def __add__(self, other: "VisibilityReport") -> "VisibilityReport":
        return VisibilityReport(*(getattr(self, field.name) + getattr(other, field.name) for field in fields(self)))


@dataclass(frozen=True)
class SequenceTracks:
    """Everything the track stage made; ``queries_xytv`` as in the file layout."""

    points: PointTracks
    views: ViewTracks
    queries_xytv: Float32[np.ndarray, "N 4"]
    report: VisibilityReport
