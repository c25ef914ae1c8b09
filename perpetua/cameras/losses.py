"""The losses of the trajectory optimisation: pure functions of tensors, each one number per candidate.

Shapes: S candidates, C cameras, T times, A actors, L body points, R samples along a line of sight. A loss is
without unit, zero where its wish is met, and averages over cameras and times.
"""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

REVISIT_REACH_M = 0.35
REVISIT_AFTER_S = 2.5
# Half lost: 13 degrees outside of the image; a line of sight that touches the scene at one sample.
HALF_OUTSIDE = 0.05
HALF_BLOCKED = 0.15


def field_distance(
    grid: Float[Tensor, "X Y Z"],
    origin_m: Float[Tensor, "3"],
    voxel_m: float,
    points_m: Float[Tensor, "*batch 3"],
) -> Float[Tensor, "*batch"]:
    """Trilinear lookup of a distance field, differentiable in the points."""
    cells = torch.tensor([n - 1 for n in grid.shape], dtype=points_m.dtype)
    unit = 2.0 * (points_m - origin_m) / (voxel_m * cells) - 1.0
    # grid_sample takes its last axis first.
    flat = unit.flip(-1).reshape(1, 1, 1, -1, 3)
    found = torch.nn.functional.grid_sample(
        grid[None, None], flat, mode="bilinear", padding_mode="border", align_corners=True
    )
    return found.reshape(points_m.shape[:-1])


def clearance(distance_m: Float[Tensor, "S C T *more"], wanted_m: float) -> Float[Tensor, " S"]:
    """Distances below the wanted one, linear near the limit so that small shortfalls still count."""
    short = torch.relu(wanted_m - distance_m) / wanted_m
    return _per_candidate(short + short.square())


def capsule_distance(
    position_m: Float[Tensor, "S C T 3"],
    axis_m: Float[Tensor, "A T 2"],
    bottom_m: Float[Tensor, "A T"],
    top_m: Float[Tensor, "A T"],
    radius_m: Float[Tensor, "A T"],
) -> Float[Tensor, "S C T A"]:
    """Distance of cameras to each actor's upright capsule, negative inside."""
    offset = position_m[..., None, :2] - axis_m.transpose(0, 1)
    height = position_m[..., 2:]
    above = torch.relu(torch.maximum(height - top_m.T, bottom_m.T - height))
    return (offset.square().sum(-1) + above.square() + 1e-8).sqrt() - radius_m.T


def framing(
    point_camera_m: Float[Tensor, "S C T A L 3"],
    tan_half_fov: Float[Tensor, "S C 2"],
    weight: Float[Tensor, "S C T A L"],
    margin: float,
) -> Float[Tensor, " S"]:
    """How far focus points lie outside the image less a margin; also defined, and steep, behind the camera."""
    outside = _outside(point_camera_m, tan_half_fov[:, :, None, None, None], margin)
    return _per_candidate((outside * weight).sum((-1, -2)))


def size(
    distance_m: Float[Tensor, "S C T A"],
    height_m: Float[Tensor, "A T"],
    tan_half_fov: Float[Tensor, "S C 2"],
    least: Float[Tensor, "S C"],
    most: Float[Tensor, "S C"],
    weight: Float[Tensor, "S C T A"],
) -> Float[Tensor, " S"]:
    """Projected height of the focus over the image's height, outside the wished range (squared logarithm)."""
    projected = height_m.T / (2.0 * distance_m.clamp_min(0.1) * tan_half_fov[:, :, None, 1:])
    wrong = torch.relu(torch.log(least[:, :, None, None] / projected)) + torch.relu(
        torch.log(projected / most[:, :, None, None])
    )
    return _per_candidate((wrong.square() * weight).sum(-1))


def coverage(
    point_camera_m: Float[Tensor, "S C T A L 3"],
    tan_half_fov: Float[Tensor, "S C 2"],
    blocked: Float[Tensor, "S C T A"],
    views: int,
    margin: float,
) -> Float[Tensor, " S"]:
    """How lost each actor is, from 0 to 1, to the ``views`` views that come nearest to seeing it.

    Lost is what lies outside of the image or behind the scene. The measure saturates, so that an actor who is a
    little outside counts more than one whom the view cannot show anyway.
    """
    if views == 0:
        return point_camera_m.new_zeros(point_camera_m.shape[0])
    outside = _outside(point_camera_m, tan_half_fov[:, :, None, None, None], margin).mean(-1)
    shown = HALF_OUTSIDE / (HALF_OUTSIDE + outside) * HALF_BLOCKED / (HALF_BLOCKED + blocked)
    return (1.0 - shown).topk(views, dim=1, largest=False).values.mean((1, 2, 3))


def blocked(line_distance_m: Float[Tensor, "S C T A R"], wanted_m: float) -> Float[Tensor, "S C T A"]:
    """How much of each line of sight passes nearer to the scene than wanted, from 0 to 1."""
    short = torch.relu(wanted_m - line_distance_m) / wanted_m
    return 0.25 * short.square().sum(-1).clamp_max(4.0)


def occlusion(blocked: Float[Tensor, "S C T A"], weight: Float[Tensor, "S C T A"]) -> Float[Tensor, " S"]:
    """How much of the lines of sight to the focus is blocked."""
    return _per_candidate((blocked * weight).sum(-1))


def foreground(
    point_camera_m: Float[Tensor, "S C T A L 3"],
    height_m: Float[Tensor, "A T"],
    tan_half_fov: Float[Tensor, "S C 2"],
    most: float,
) -> Float[Tensor, " S"]:
    """Actors of whom any point is in the image and whose projected height exceeds ``most`` images."""
    outside = _outside(point_camera_m, tan_half_fov[:, :, None, None, None], 0.0).amin(-1)
    distance_m = point_camera_m.square().sum(-1).amin(-1).clamp_min(0.01).sqrt()
    projected = height_m.T / (2.0 * distance_m * tan_half_fov[:, :, None, 1:])
    large = torch.relu(torch.log(projected / most)).square()
    return _per_candidate((large * HALF_OUTSIDE / (HALF_OUTSIDE + outside)).sum(-1))


def crowding(
    position_m: Float[Tensor, "S C T 3"],
    target_m: Float[Tensor, "S C T 3"],
    point_m: Float[Tensor, "A T L 3"],
    other: Bool[Tensor, "S C T A"],
    wanted_m: float,
) -> Float[Tensor, " S"]:
    """Other actors' body points that lie near the line of sight to the focus."""
    sight = (target_m - position_m)[..., None, None, :]
    offset = point_m.transpose(0, 1) - position_m[..., None, None, :]
    along = ((offset * sight).sum(-1) / sight.square().sum(-1).clamp_min(1e-6)).clamp(0.0, 1.0)
    distance = (offset - along[..., None] * sight).square().sum(-1).add(1e-8).sqrt()
    short = (torch.relu(wanted_m - distance) / wanted_m).square() * (along < 0.95)
    return _per_candidate((short.mean(-1) * other).sum(-1))


def over_limit(values: Float[Tensor, "S C T"], limit: float) -> Float[Tensor, " S"]:
    """Values above a limit, relative to it."""
    return _per_candidate(torch.relu(values / limit - 1.0).square())


def unsteadiness(values: Float[Tensor, "S C T 3"], unit: float) -> Float[Tensor, " S"]:
    """Mean square of vectors (accelerations, turning) in units of ``unit``."""
    return _per_candidate((values / unit).square().sum(-1))


def travel(
    position_m: Float[Tensor, "S C T 3"], step_s: float, wished_mps: Float[Tensor, "S C"]
) -> Float[Tensor, " S"]:
    """Cameras that move more slowly, spread less, or move much faster than wished; a wish of 0 is always met."""
    moving, wished_mps = wished_mps > 0.0, wished_mps.clamp_min(0.01)
    speed = position_m.diff(dim=2).square().sum(-1).add(1e-10).sqrt().mean(-1) / step_s
    spread = (position_m - position_m.mean(2, keepdim=True)).square().sum(-1).mean(-1).add(1e-10).sqrt()
    # Points spread evenly over a line of length L have a standard deviation of 0.29 L.
    wished_spread = 0.25 * (wished_mps * step_s * (position_m.shape[2] - 1)).clamp_max(2.0)
    slow = torch.relu(1.0 - speed / wished_mps).square()
    fast = torch.relu(speed / wished_mps - 1.5).square()
    return (moving * (slow + fast + torch.relu(1.0 - spread / wished_spread).square())).mean(1)


def revisiting(position_m: Float[Tensor, "S C T 3"], step_s: float) -> Float[Tensor, " S"]:
    """Places that a camera comes back to after more than a few seconds."""
    lag = round(REVISIT_AFTER_S / step_s)
    times = position_m.shape[2]
    if lag >= times:
        return position_m.new_zeros(position_m.shape[0])
    apart = (position_m[:, :, :, None] - position_m[:, :, None]).square().sum(-1)
    later = torch.ones(times, times, dtype=position_m.dtype).triu(lag)
    return _per_candidate(torch.exp(-0.5 * apart / REVISIT_REACH_M**2) * later) * times * times / later.sum()


def diversity(
    position_m: Float[Tensor, "S C T 3"], axis_m: Float[Tensor, "A T 2"], least_cosine: float
) -> Float[Tensor, " S"]:
    """Pairs of views that see an actor from nearly the same direction (cosine of the azimuths above a limit)."""
    offset = position_m[..., None, :2] - axis_m.transpose(0, 1)
    direction = offset / offset.square().sum(-1, keepdim=True).add(1e-6).sqrt()
    cosine = torch.einsum("sctai,sdtai->scdta", direction, direction)
    views = position_m.shape[1]
    pairs = torch.ones(views, views, dtype=position_m.dtype).triu(1)
    alike = (torch.relu(cosine - least_cosine) / (1.0 - least_cosine)).square().mean((-1, -2))
    return (alike * pairs).sum((-1, -2)) / pairs.sum().clamp_min(1.0)


def outside_band(
    values: Float[Tensor, "S C T"], low: Float[Tensor, "S C"], high: Float[Tensor, "S C"], unit: float
) -> Float[Tensor, " S"]:
    """Values below or above a wished band, in units of ``unit``."""
    beyond = torch.relu(low[..., None] - values) + torch.relu(values - high[..., None])
    return _per_candidate((beyond / unit).square())


def _outside(
    point_camera_m: Float[Tensor, "*batch 3"], tan_half_fov: Float[Tensor, "*fov 2"], margin: float
) -> Float[Tensor, "*batch"]:
    """Squared sine of the angle, roughly, between a point and the image less a margin; it grows up to behind."""
    reach = (1.0 - margin) * tan_half_fov * point_camera_m[..., 2:]
    beyond = torch.relu(point_camera_m[..., :2].abs() - reach)
    distance = point_camera_m.square().sum(-1, keepdim=True).add(1e-6).sqrt()
    return (beyond / distance).square().sum(-1)


def _per_candidate(values: Float[Tensor, " S *rest"]) -> Float[Tensor, " S"]:
    return values.flatten(1).mean(1)
