"""What the cameras know of each actor: an upright capsule around its mesh and points up its body."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64

from perpetua.scene.actor import ActorMesh

# Heights of the body points as shares of the actor's height, from the head down.
BODY_LEVELS = (0.93, 0.75, 0.55, 0.28, 0.05)
TORSO_LEVELS = (0.5, 0.85)
# The middle of the torso is that of every n-th of its vertices.
TORSO_STRIDE = 8


@dataclass(frozen=True)
class ActorBounds:
    """A actors over T times.

    Every vertex lies within ``radius_m`` of the upright segment at ``axis_m`` from ``bottom_m`` to ``top_m``.
    ``point_m`` are points of the body at ``BODY_LEVELS``, head first.
    """

    axis_m: Float64[np.ndarray, "A T 2"]
    bottom_m: Float64[np.ndarray, "A T"]
    top_m: Float64[np.ndarray, "A T"]
    radius_m: Float64[np.ndarray, "A T"]
    point_m: Float64[np.ndarray, "A T L 3"]

    @property
    def chest_m(self) -> Float64[np.ndarray, "A T 3"]:
        """The point between head and pelvis that views look at."""
        return self.point_m[:, :, 1]

    @property
    def height_m(self) -> Float64[np.ndarray, "A T"]:
        """How tall each actor stands, sits or lies."""
        return np.asarray(self.top_m - self.bottom_m)


def actor_bounds(actors: tuple[ActorMesh, ...]) -> ActorBounds:
    """The capsules and body points of actor meshes, frame by frame."""
    each = [_one_actor(actor.vertices_m) for actor in actors]
    return ActorBounds(*(np.stack([bounds[field] for bounds in each]) for field in range(5)))


def bounds_at(bounds: ActorBounds, frame: Float64[np.ndarray, " N"]) -> ActorBounds:
    """Bounds at fractional frames, linear between frames; the radius is the larger of the two frames'."""
    last = bounds.axis_m.shape[1] - 1
    low = np.clip(np.floor(frame).astype(int), 0, last)
    high = np.minimum(low + 1, last)
    fraction = frame - low

    def between(values: np.ndarray) -> np.ndarray:
        weight = fraction.reshape((1, -1) + (1,) * (values.ndim - 2))
        return np.asarray(values[:, low] * (1.0 - weight) + values[:, high] * weight)

    return ActorBounds(
        between(bounds.axis_m),
        between(bounds.bottom_m),
        between(bounds.top_m),
        np.maximum(bounds.radius_m[:, low], bounds.radius_m[:, high]),
        between(bounds.point_m),
    )


def capsule_distance_m(points_m: Float64[np.ndarray, "N 1 3"], bounds: ActorBounds) -> Float64[np.ndarray, "A N T"]:
    """Distance of points to each actor's capsule at each time, negative inside."""
    horizontal_m = np.linalg.norm(points_m[None, :, :, :2] - bounds.axis_m[:, None], axis=-1)
    height_m = points_m[None, :, :, 2]
    above_m = np.maximum(height_m - bounds.top_m[:, None], bounds.bottom_m[:, None] - height_m)
    return np.asarray(np.hypot(horizontal_m, np.maximum(above_m, 0.0)) - bounds.radius_m[:, None])


def _one_actor(vertices_m: Float32[np.ndarray, "T P 3"]) -> tuple[np.ndarray, ...]:
    bottom_m = vertices_m[..., 2].min(axis=1).astype(np.float64)
    top_m = vertices_m[..., 2].max(axis=1).astype(np.float64)
    axis_m = _torso_axis_m(vertices_m[:, ::TORSO_STRIDE].astype(np.float64), bottom_m, top_m)
    beside_m: Float32[np.ndarray, "T P 2"] = vertices_m[..., :2] - axis_m[:, None].astype(np.float32)
    # Rounded up, so that single precision leaves no vertex outside.
    radius_m = np.sqrt(np.einsum("tpi,tpi->tp", beside_m, beside_m).max(axis=1).astype(np.float64)) + 1e-6
    heights_m = bottom_m[:, None] + (top_m - bottom_m)[:, None] * np.array(BODY_LEVELS)
    plane_m = np.repeat(axis_m[:, None], len(BODY_LEVELS), axis=1)
    return axis_m, bottom_m, top_m, radius_m, np.concatenate([plane_m, heights_m[..., None]], axis=-1)


def _torso_axis_m(
    vertices_m: Float64[np.ndarray, "T P 3"], bottom_m: Float64[np.ndarray, " T"], top_m: Float64[np.ndarray, " T"]
) -> Float64[np.ndarray, "T 2"]:
    level = (vertices_m[..., 2] - bottom_m[:, None]) / np.maximum(top_m - bottom_m, 1e-6)[:, None]
    torso = (level > TORSO_LEVELS[0]) & (level < TORSO_LEVELS[1])
    # A mesh with no vertex at those heights is taken whole.
    torso |= ~torso.any(axis=1, keepdims=True)
    weight = torso / torso.sum(axis=1, keepdims=True)
    return np.einsum("tp,tpi->ti", weight, vertices_m[..., :2])
