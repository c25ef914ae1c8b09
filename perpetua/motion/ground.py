"""The floor under feet: what is walkable, as it is, rug or not."""

import numpy as np
from jaxtyping import Float64

from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.raycast import Caster
from perpetua.scene.room import Room

# Floor is looked for so far above and below where it is expected; farther off it is another storey or a stage.
_SEARCH_M = 0.15


class Ground:
    """Heights of a room's walkable surfaces."""

    def __init__(self, room: Room) -> None:
        self._caster = Caster(join([_upper(obj.mesh) for obj in room.objects if obj.walkable]))

    def height_m(
        self, place_m: Float64[np.ndarray, "N 2"], expected_m: Float64[np.ndarray, " N"]
    ) -> Float64[np.ndarray, " N"]:
        """The highest walkable surface under each place (x, y); ``expected_m`` where none is near that height."""
        if len(place_m) == 0:
            return np.zeros(0)
        origin_m = np.column_stack([place_m, expected_m + _SEARCH_M])
        hits = self._caster.first_hit(origin_m, np.tile([0.0, 0.0, -1.0], (len(origin_m), 1)))
        found = hits.hit & (hits.distance_m < 2.0 * _SEARCH_M)
        return np.where(found, origin_m[:, 2] - np.where(hits.hit, hits.distance_m, 0.0), expected_m)


def _upper(mesh: TriMesh) -> TriMesh:
    """Without faces that stand upright, which a ray from above can only graze."""
    corners_m = mesh.vertices_m[mesh.faces]
    normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    level = np.abs(normal[:, 2]) > 1e-3 * np.linalg.norm(normal, axis=1)
    return TriMesh(mesh.vertices_m, mesh.faces[level])
