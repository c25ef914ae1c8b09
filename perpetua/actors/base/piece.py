"""What a tailor works on and what comes out."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int32

from perpetua.scene.actor import ActorPart


@dataclass(frozen=True)
class Surface:
    """Triangles with everything that a cut must carry along.

    ``template_m`` are places on the unshaped base mesh, the same for everybody, in which patterns are drawn;
    ``vertices_m`` those on the body being dressed, in its rest pose; ``weights`` skin them to the body's bones.
    """

    template_m: Float64[np.ndarray, "P 3"]
    vertices_m: Float64[np.ndarray, "P 3"]
    weights: Float64[np.ndarray, "P J"]
    faces: Int32[np.ndarray, "F 3"]


@dataclass(frozen=True)
class Piece:
    """A finished garment, shoe or head of hair in the body's rest pose; parts index its own vertices."""

    vertices_m: Float64[np.ndarray, "P 3"]
    weights: Float64[np.ndarray, "P J"]
    parts: tuple[ActorPart, ...]
