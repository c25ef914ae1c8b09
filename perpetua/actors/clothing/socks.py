"""Socks: knitted tubes from inside the shoes up the shins."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float64, Int32

from perpetua.actors.base.base_mesh import base_mesh
from perpetua.actors.base.piece import Piece, Surface
from perpetua.actors.base.rig import base_weights
from perpetua.actors.base.surface import positive, triangles, vertex_normals
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.clothing.fabrics import Fabric
from perpetua.actors.clothing.unwrap import limbs
from perpetua.scene.actor import ActorPart
from perpetua.scene.room import Material

_THICKNESS_M = 0.0025
_IN_SHOE_M = 0.03
_LEG_RADIUS_M = 0.045


@lru_cache(maxsize=1)
def _floor_z_m() -> float:
    body = np.unique(base_mesh().groups["body"].faces)
    return float(base_mesh().vertices_m[body, 2].min())


@lru_cache(maxsize=1)
def _shin_quads() -> Int32[np.ndarray, "F 4"]:
    quads = base_mesh().groups["body"].faces
    return quads[np.all(base_mesh().vertices_m[quads, 2] < _floor_z_m() + 0.35, axis=1)]


def sock_field_m(height_m: float, template_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """Metres below the upper edge of socks that reach ``height_m`` above the floor, on the base mesh."""
    return np.asarray(_floor_z_m() + height_m - template_m[:, 2])


def make_socks(wearer: Wearer, height_m: float, fabric: Fabric) -> Piece:
    """A pair of socks on this body, as far as shoes leave them to be seen.

    Args:
        wearer: the body.
        height_m: how far they reach above the floor, on the base mesh.
        fabric: what they are knitted of.
    """
    used, local = np.unique(_shin_quads(), return_inverse=True)
    template_m = base_mesh().vertices_m[used]
    bare = Surface(template_m, wearer.vertices_m[used], base_weights()[used], triangles(local.reshape(-1, 4)))
    inside = np.minimum(sock_field_m(height_m, template_m), template_m[:, 2] - _floor_z_m() - _IN_SHOE_M)
    cut, _ = positive(bare, inside)
    outer_m = cut.vertices_m + _THICKNESS_M * vertex_normals(cut.vertices_m, cut.faces)
    uv = limbs(cut, ("hip", "knee", "ankle"), _LEG_RADIUS_M, (-1.0, 0.0, 0.0)) / np.float32(fabric.tile_m)
    shade = Material("socks", (0.5, 0.5, 0.5), roughness=fabric.roughness, image=fabric.image)
    return Piece(outer_m, cut.weights, (ActorPart("socks", cut.faces, uv.astype(np.float32), shade),))
