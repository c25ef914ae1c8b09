"""The meshes of several objects as one, with rays at them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float64, Int32, Int64

from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.raycast import Caster


@dataclass(frozen=True)
class Surfaces:
    """Joined meshes of objects, in their order. F faces.

    ``object_index`` says whose each face is. The caster is built at its first use and kept, so that all who ask for
    rays at a room share one.
    """

    mesh: TriMesh
    object_index: Int64[np.ndarray, " F"]

    @classmethod
    def of(cls, meshes: dict[int, TriMesh]) -> "Surfaces":
        """Joins meshes that are given by object index."""
        counts = [len(mesh.faces) for mesh in meshes.values()]
        return cls(join(list(meshes.values())), np.repeat(np.array(list(meshes), np.int64), counts))

    @property
    def corner_m(self) -> Float64[np.ndarray, "F 3 3"]:
        """Corners of all faces."""
        return self.mesh.vertices_m[self.mesh.faces]

    @cached_property
    def face(self) -> Int32[np.ndarray, " F"]:
        """The number of each face within its object."""
        starts = np.flatnonzero(np.diff(self.object_index, prepend=-1))
        counts = np.diff(np.append(starts, len(self.object_index)))
        return (np.arange(len(self.object_index)) - np.repeat(starts, counts)).astype(np.int32)

    @cached_property
    def caster(self) -> Caster:
        """Rays and distances."""
        return Caster(self.mesh)
