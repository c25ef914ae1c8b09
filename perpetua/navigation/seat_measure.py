"""A place to sit, measured by rays: its height, its front edge and what is behind it."""

import numpy as np
from jaxtyping import Float64

from perpetua.geometry.raycast import Caster
from perpetua.scene.actor import Seat

# Where the surface is looked at under hips and thighs, and how much higher than in its middle it may be.
_UNDER_AHEAD_M, _UNDER_ASIDE_M, _UNEVEN_M = np.linspace(-0.08, 0.2, 8), np.linspace(-0.16, 0.16, 7), 0.05
# The front edge is where the surface drops by this much; it is looked for from this far above the surface.
_EDGE_AHEAD_M, _DROP_M, _FROM_ABOVE_M = np.arange(0.04, 0.7, 0.01), 0.15, 0.12
# Heights above the surface at which a backrest is looked for, and the distance from which on there is none.
_BACK_LEVELS_M = np.array([0.14, 0.24, 0.34, 0.44, 0.54])
_NO_BACK_M = 5.0


def measure_seat(
    object_index: int, middle_m: tuple[float, float, float], facing_rad: float, floor_m: float, caster: Caster
) -> Seat:
    """A seat seen from its sitter.

    Args:
        object_index: whose seat it is.
        middle_m: on its surface, under the sitter's hips.
        facing_rad: which way the sitter looks.
        floor_m: height of the floor in the world.
        caster: all that is in the room.
    """
    ahead = np.array([np.cos(facing_rad), np.sin(facing_rad), 0.0])
    top_m = _highest_m(np.array(middle_m), ahead, caster)
    from_m = np.array([middle_m[0], middle_m[1], top_m])
    return Seat(
        object_index,
        middle_m,
        facing_rad,
        middle_m[2] - floor_m,
        top_m,
        _edge_m(from_m, ahead, caster),
        _backs_m(from_m, ahead, caster),
    )


def _highest_m(middle_m: Float64[np.ndarray, "3"], ahead: Float64[np.ndarray, "3"], caster: Caster) -> float:
    """The height of the surface under hips and thighs where it is highest: beds have folds."""
    left = np.array([-ahead[1], ahead[0], 0.0])
    forward_m, aside_m = (grid.reshape(-1, 1) for grid in np.meshgrid(_UNDER_AHEAD_M, _UNDER_ASIDE_M))
    depth_m = _depth_m(middle_m + forward_m * ahead + aside_m * left + np.array([0.0, 0.0, _UNEVEN_M]), caster)
    return float(middle_m[2] + max(_UNEVEN_M - depth_m.min(), 0.0))


def _edge_m(middle_m: Float64[np.ndarray, "3"], ahead: Float64[np.ndarray, "3"], caster: Caster) -> float:
    """How far ahead the surface ends; the last distance looked at where it does not."""
    from_m = middle_m + np.array([0.0, 0.0, _FROM_ABOVE_M]) + _EDGE_AHEAD_M[:, None] * ahead
    ends = _depth_m(from_m, caster) > _FROM_ABOVE_M + _DROP_M
    return float(_EDGE_AHEAD_M[ends.argmax()]) if ends.any() else float(_EDGE_AHEAD_M[-1])


def _backs_m(
    middle_m: Float64[np.ndarray, "3"], ahead: Float64[np.ndarray, "3"], caster: Caster
) -> tuple[tuple[float, float], ...]:
    """Distances to what is behind, by height above the surface."""
    from_m = middle_m + _BACK_LEVELS_M[:, None] * np.array([0.0, 0.0, 1.0])
    away_m = caster.first_hit(from_m, np.tile(-ahead, (len(_BACK_LEVELS_M), 1))).distance_m
    return tuple(zip(_BACK_LEVELS_M.tolist(), np.minimum(away_m, _NO_BACK_M).tolist(), strict=True))


def _depth_m(from_m: Float64[np.ndarray, "N 3"], caster: Caster) -> Float64[np.ndarray, " N"]:
    return caster.first_hit(from_m, np.tile([0.0, 0.0, -1.0], (len(from_m), 1))).distance_m
