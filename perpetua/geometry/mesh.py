"""Triangle meshes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float64, Int32, Integer


@dataclass(frozen=True)
class TriMesh:
    """A triangle mesh in metres; faces are counter-clockwise seen from outside."""

    vertices_m: Float64[np.ndarray, "P 3"]
    faces: Int32[np.ndarray, "F 3"]


def join(meshes: list[TriMesh]) -> TriMesh:
    """One mesh of several, vertices and faces in the order given."""
    if not meshes:
        return TriMesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    offsets = np.cumsum([0] + [len(mesh.vertices_m) for mesh in meshes[:-1]])
    vertices_m = np.concatenate([mesh.vertices_m for mesh in meshes])
    faces = np.concatenate([mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=True)])
    return TriMesh(vertices_m, faces.astype(np.int32))


def face_areas_m2(vertices_m: Float[np.ndarray, "P 3"], faces: Integer[np.ndarray, "F 3"]) -> Float64[np.ndarray, " F"]:
    """Area of each triangle."""
    corners = vertices_m[faces].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(0.5 * np.linalg.norm(normal, axis=1))
