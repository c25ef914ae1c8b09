"""The losses of the route optimisation. A actors, T time steps; all lengths in metres, all means over actors and time.

Each is a pure function of positions and headings, zero or close to it where its wish is met.
"""

import torch
from jaxtyping import Float64
from torch import Tensor

# Keeps square roots differentiable at standstill.
TINY_M2 = 1e-8
REVISIT_M = 0.5
REVISIT_S = 2.0
MAX_REVISIT_SAMPLES = 96


def sample_bilinear(
    field_m: Float64[Tensor, "X Y"],
    origin_m: Float64[Tensor, "2"],
    cell_m: float,
    position_m: Float64[Tensor, "A T 2"],
) -> Float64[Tensor, "A T"]:
    """A grid's values between its cell centres, differentiable in the position; the border's values beyond it."""
    limit = torch.tensor(field_m.shape, dtype=position_m.dtype) - 1.0
    place = torch.minimum(((position_m - origin_m) / cell_m).clamp(min=0.0), limit)
    corner = torch.minimum(place.detach().floor(), limit - 1.0).long()
    x, y = (place - corner).unbind(-1)
    i, j = corner.unbind(-1)
    low = field_m[i, j] * (1 - y) + field_m[i, j + 1] * y
    high = field_m[i + 1, j] * (1 - y) + field_m[i + 1, j + 1] * y
    return low * (1 - x) + high * x


def clearance_loss(clearance_m: Float64[Tensor, "A T"], wanted_m: float) -> Float64[Tensor, ""]:
    """Squared shortfall of the distance to obstacles."""
    return (wanted_m - clearance_m).clamp(min=0.0).square().mean()


def separation_loss(position_m: Float64[Tensor, "A T 2"], wanted_m: float) -> Float64[Tensor, ""]:
    """Squared shortfall of the distance between two actors at equal times, summed over pairs."""
    actors = len(position_m)
    first, second = torch.triu_indices(actors, actors, offset=1).unbind()
    distance_m = _norm(position_m[first] - position_m[second])
    return (wanted_m - distance_m).clamp(min=0.0).square().sum() / (actors * position_m.shape[1])


def speed_loss(
    position_m: Float64[Tensor, "A T 2"], step_s: float, limit_mps: Float64[Tensor, " A"]
) -> Float64[Tensor, ""]:
    """Squared excess over each actor's highest speed."""
    return (_norm(velocity_mps(position_m, step_s)) - limit_mps[:, None]).clamp(min=0.0).square().mean()


def acceleration_loss(position_m: Float64[Tensor, "A T 2"], step_s: float, limit_mps2: float) -> Float64[Tensor, ""]:
    """Squared excess over an acceleration."""
    acceleration = position_m.diff(n=2, dim=1) / step_s**2
    return (_norm(acceleration) - limit_mps2).clamp(min=0.0).square().mean()


def jerk_loss(position_m: Float64[Tensor, "A T 2"], step_s: float) -> Float64[Tensor, ""]:
    """Mean squared change of the acceleration."""
    return (position_m.diff(n=3, dim=1) / step_s**3).square().sum(-1).mean()


def heading_loss(
    position_m: Float64[Tensor, "A T 2"], heading_rad: Float64[Tensor, "A T"], step_s: float
) -> Float64[Tensor, ""]:
    """Speed less its part along the heading: zero where an actor walks straight ahead or stands."""
    velocity = velocity_mps(position_m, step_s)
    middle_rad = 0.5 * (heading_rad[:, 1:] + heading_rad[:, :-1])
    forward = torch.stack([middle_rad.cos(), middle_rad.sin()], dim=-1)
    return (_norm(velocity) - (velocity * forward).sum(-1)).mean()


def turning_loss(heading_rad: Float64[Tensor, "A T"], step_s: float, limit_radps: float) -> Float64[Tensor, ""]:
    """Squared excess over a turn rate."""
    return ((heading_rad.diff(dim=1) / step_s).abs() - limit_radps).clamp(min=0.0).square().mean()


def turn_change_loss(heading_rad: Float64[Tensor, "A T"], step_s: float) -> Float64[Tensor, ""]:
    """Mean squared change of the turn rate."""
    return (heading_rad.diff(n=2, dim=1) / step_s**2).square().mean()


def variation_loss(position_m: Float64[Tensor, "A T 2"], step_s: float) -> Float64[Tensor, ""]:
    """How much of its path each actor has covered before: 1 for standing still, 0 for always new floor.

    Pairs of times at least ``REVISIT_S`` apart count, by a Gaussian of their distance.
    """
    stride = -(-position_m.shape[1] // MAX_REVISIT_SAMPLES)
    sampled_m = position_m[:, ::stride]
    first, second = torch.triu_indices(sampled_m.shape[1], sampled_m.shape[1], offset=1).unbind()
    apart = (second - first) * stride * step_s >= REVISIT_S
    if not apart.any():
        return position_m.sum() * 0.0
    squared_m2 = (sampled_m[:, first[apart]] - sampled_m[:, second[apart]]).square().sum(-1)
    return torch.exp(-0.5 * squared_m2 / REVISIT_M**2).mean()


def walk_loss(position_m: Float64[Tensor, "A T 2"], walk_m: Float64[Tensor, "A T 2"]) -> Float64[Tensor, ""]:
    """Mean squared distance from the random walk."""
    return (position_m - walk_m).square().sum(-1).mean()


def pause_loss(
    position_m: Float64[Tensor, "A T 2"],
    heading_rad: Float64[Tensor, "A T"],
    walk_m: Float64[Tensor, "A T 2"],
    facing_rad: Float64[Tensor, "A T"],
    pausing: Float64[Tensor, "A T"],
) -> Float64[Tensor, ""]:
    """How far actors pause from where they should, squared, and how far they turn from what they should face.

    ``pausing`` is 1 during pauses, else 0. A radian counts like a metre.
    """
    away_m2 = (position_m - walk_m).square().sum(-1)
    turned = 2.0 - 2.0 * (heading_rad - facing_rad).cos()
    return (pausing * (away_m2 + turned)).mean()


def velocity_mps(position_m: Float64[Tensor, "A T 2"], step_s: float) -> Float64[Tensor, "A S 2"]:
    """Velocity between each two steps (S = T - 1)."""
    return position_m.diff(dim=1) / step_s


def _norm(vector: Float64[Tensor, "*batch 2"]) -> Float64[Tensor, "*batch"]:
    return (vector.square().sum(-1) + TINY_M2).sqrt()
