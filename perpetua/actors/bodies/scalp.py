"""The scalp: where hair grows on the base mesh."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float, Float64, Int32

from perpetua.actors.base.base_mesh import base_mesh
from perpetua.actors.base.piece import Surface
from perpetua.actors.base.rig import base_weights, joint_index
from perpetua.actors.base.surface import catmull_clark, positive, triangles
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.bodies.hair_styles import HairStyle

_STUBBLE_INSET_M = 0.009
# Height of the hairline on the base mesh, from the nape forward: over the ear, down the temple, across the forehead.
_LINE_X_M = (-0.02, 0.005, 0.022, 0.036, 0.058, 0.070, 0.082, 0.100, 0.125, 0.150)
_LINE_Z_M = (0.652, 0.668, 0.700, 0.752, 0.762, 0.738, 0.742, 0.785, 0.801, 0.806)


def scalp_field_m(template_m: Float[np.ndarray, "*shape 3"], shift_m: float) -> Float64[np.ndarray, "*shape"]:
    """Metres above the hairline on the base mesh; ears and everything below the head are far outside."""
    x, side, z = template_m[..., 0], np.abs(template_m[..., 1]), template_m[..., 2]
    line = np.interp(x, _LINE_X_M, _LINE_Z_M) + shift_m
    ear = (side > 0.079) & (x > 0.005) & (x < 0.075) & (z < 0.775)
    return np.asarray(np.where(ear, -0.05, z - line))


@lru_cache(maxsize=1)
def _head_quads() -> Int32[np.ndarray, "F 4"]:
    quads = base_mesh().groups["body"].faces
    template_m = base_mesh().vertices_m
    head = (base_weights()[:, joint_index("head")] > 0.3) | (base_weights()[:, joint_index("neck")] > 0.5)
    inside = (scalp_field_m(template_m, 0.0) > -0.04) & head
    return quads[np.all(inside[quads], axis=1)]


def scalp(wearer: Wearer, style: HairStyle) -> tuple[Surface, Float64[np.ndarray, " P"]]:
    """The skin under the hair of a style, and how far each vertex is inside the hairline, metres."""
    used, local = np.unique(_head_quads(), return_inverse=True)
    operator, quads = catmull_clark(local.reshape(-1, 4), len(used))
    surface = Surface(
        np.asarray(operator @ base_mesh().vertices_m[used]),
        np.asarray(operator @ wearer.vertices_m[used]),
        np.asarray(operator @ base_weights()[used]),
        triangles(quads),
    )
    # Stubble begins in the shade that is painted on the skin.
    inset_m = _STUBBLE_INSET_M if style.locks == 0 else 0.0
    return positive(surface, scalp_field_m(surface.template_m, style.line_shift_m) - inset_m)
