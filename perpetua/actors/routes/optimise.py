"""All actors' paths at once, moved from their random walks to where every wish is met as well as possible."""

import math

import numpy as np
import torch
from jaxtyping import Float64
from scipy import ndimage
from torch import Tensor

from perpetua.actors.config import RoutesConfig
from perpetua.actors.routes import losses
from perpetua.actors.routes.checks import TimedPaths, required_clearance_m
from perpetua.navigation.types import NavGrid
from perpetua.optimisation import deterministic_torch, minimise

# Wishes are a little stricter than the limits, so that the optimum lies inside them.
CLEARANCE_MARGIN_M = 0.04
SEPARATION_MARGIN_M = 0.08
LIMIT_SHARE = 0.75
# Adam moves every step of a path alike; through this window its steps move neighbours together and stay smooth.
WINDOW_S = 0.2


def optimise_paths(walks: TimedPaths, grid: NavGrid, config: RoutesConfig) -> TimedPaths:
    """The paths near ``walks`` that minimise the weighted losses."""
    start_m, start_rad = torch.from_numpy(walks.position_m), torch.from_numpy(walks.heading_rad)
    shift_m = torch.zeros_like(start_m, requires_grad=True)
    turn_rad = torch.zeros_like(start_rad, requires_grad=True)
    field_m = torch.from_numpy(signed_clearance_m(grid))
    origin_m = torch.from_numpy(grid.origin_m)
    window = _window(walks.step_s)
    wanted_m = required_clearance_m(grid) + CLEARANCE_MARGIN_M

    def present() -> tuple[Tensor, Tensor]:
        return start_m + _spread(shift_m, window), start_rad + _spread(turn_rad[..., None], window)[..., 0]

    def loss_terms() -> dict[str, Tensor]:
        position_m, heading_rad = present()
        clearance_m = losses.sample_bilinear(field_m, origin_m, grid.cell_m, position_m)
        return weighted_losses(position_m, heading_rad, clearance_m, wanted_m, start_m, walks.step_s, config)

    minimise([shift_m, turn_rad], loss_terms, config.steps, config.learning_rate)
    with deterministic_torch(), torch.no_grad():
        position_m, heading_rad = present()
        return TimedPaths(position_m.numpy(), heading_rad.numpy(), walks.step_s)


def weighted_losses(
    position_m: Float64[Tensor, "A T 2"],
    heading_rad: Float64[Tensor, "A T"],
    clearance_m: Float64[Tensor, "A T"],
    wanted_clearance_m: float,
    walk_m: Float64[Tensor, "A T 2"],
    step_s: float,
    config: RoutesConfig,
) -> dict[str, Tensor]:
    """Each loss times its weight."""
    acceleration_mps2 = LIMIT_SHARE * config.max_acceleration_mps2
    turn_rate_radps = LIMIT_SHARE * config.max_turn_rate_radps
    separation_m = config.separation_m + SEPARATION_MARGIN_M
    terms = {
        "clearance": losses.clearance_loss(clearance_m, wanted_clearance_m),
        "separation": losses.separation_loss(position_m, separation_m),
        "speed": losses.speed_loss(position_m, step_s, LIMIT_SHARE * config.max_speed_mps),
        "acceleration": losses.acceleration_loss(position_m, step_s, acceleration_mps2),
        "jerk": losses.jerk_loss(position_m, step_s),
        "heading": losses.heading_loss(position_m, heading_rad, step_s),
        "turning": losses.turning_loss(heading_rad, step_s, turn_rate_radps),
        "turn_change": losses.turn_change_loss(heading_rad, step_s),
        "variation": losses.variation_loss(position_m, step_s),
        "walk": losses.walk_loss(position_m, walk_m),
    }
    return {name: getattr(config.weights, name) * value for name, value in terms.items()}


def signed_clearance_m(grid: NavGrid) -> Float64[np.ndarray, "X Y"]:
    """The grid's clearance, and inside obstacles the negative distance to the way out, so that gradients lead there."""
    inside_m = ndimage.distance_transform_edt(grid.clearance_m <= 0.0) * grid.cell_m
    return grid.clearance_m.astype(np.float64) - inside_m


def _window(step_s: float) -> Float64[Tensor, "1 1 K"]:
    reach = max(1, math.ceil(2.0 * WINDOW_S / step_s))
    offsets = torch.arange(-reach, reach + 1, dtype=torch.float64) * step_s
    weights = torch.exp(-0.5 * (offsets / WINDOW_S) ** 2)
    return (weights / weights.sum())[None, None]


def _spread(values: Float64[Tensor, "A T D"], window: Float64[Tensor, "1 1 K"]) -> Float64[Tensor, "A T D"]:
    """A moving average over time; ends are repeated."""
    actors, steps, axes = values.shape
    rows = values.transpose(1, 2).reshape(actors * axes, 1, steps)
    reach = window.shape[-1] // 2
    padded = torch.nn.functional.pad(rows, (reach, reach), mode="replicate")
    return torch.nn.functional.conv1d(padded, window).reshape(actors, axes, steps).transpose(1, 2)
