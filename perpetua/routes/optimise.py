"""All actors' paths at once, moved from their random walks to where every wish is met as well as possible."""

import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float64
from scipy import ndimage
from torch import Tensor

from perpetua.navigation.time_parametrisation import Walk
from perpetua.navigation.types import NavGrid
from perpetua.optimisation.adam import deterministic_torch, minimise
from perpetua.routes import losses
from perpetua.routes.checks import TimedPaths, required_clearance_m
from perpetua.routes.config import RoutesConfig

# Wishes are a little stricter than the limits, so that the optimum lies inside them.
CLEARANCE_MARGIN_M = 0.05
SEPARATION_MARGIN_M = 0.1
# People seldom go to these shares of the hard limits.
ACCELERATION_FRACTION, TURN_FRACTION = 0.45, 0.4
SPEED_FRACTION = 0.92
# Nobody goes much faster than the fastest of its paces.
PACE_EXCESS = 1.15
# A shift of a path is a sum of bells of this width over time, so that neighbours move together and stay smooth.
BELL_S = 0.2
# Who moves slower than this stands; around it the clock of the bells slows down within this time, then it stands too.
STILL_MPS, SLOWING_S = 0.02, 0.35


@dataclass(frozen=True)
class PlannedPaths:
    """Random walks of all actors; ``pausing`` where they stand still at a spot; the highest speed each should reach."""

    walks: TimedPaths
    pausing: Bool[np.ndarray, "A T"]
    highest_mps: Float64[np.ndarray, " A"]

    @classmethod
    def of_walks(cls, walks: list[Walk], speeds_mps: Float64[np.ndarray, " A"], step_s: float) -> "PlannedPaths":
        """The plan of some walks whose fastest paces have these speeds."""
        position_m = np.stack([walk.position_m for walk in walks])
        heading_rad = np.stack([walk.heading_rad for walk in walks])
        pausing = np.zeros(heading_rad.shape, bool)
        for row, walk in zip(pausing, walks, strict=True):
            for pause in walk.pauses:
                row[pause.first_step : pause.last_step + 1] = True
        return cls(TimedPaths(position_m, heading_rad, step_s), pausing, PACE_EXCESS * speeds_mps)


@dataclass(frozen=True)
class OptimisedPaths:
    """What Adam made of a plan, and the weighted losses left."""

    paths: TimedPaths
    losses: dict[str, float]


def optimise_paths(plan: PlannedPaths, grid: NavGrid, config: RoutesConfig) -> OptimisedPaths:
    """The paths near the walks of ``plan`` that minimise the weighted losses.

    A path is shifted by a sum of Gaussian bells over its own clock, which stands while the actor stands: whatever the
    shift, nobody drifts. Headings turn by bells over plain time.
    """
    walks = plan.walks
    start_m, start_rad = torch.from_numpy(walks.position_m), torch.from_numpy(walks.heading_rad)
    shift_bells = torch.from_numpy(_bells(_own_clock(walks), walks.step_s))
    plain_clock = np.broadcast_to(np.arange(start_rad.shape[1], dtype=np.float64), start_rad.shape)
    turn_bells = torch.from_numpy(_bells(plain_clock, walks.step_s))
    shift = torch.zeros(len(start_m), shift_bells.shape[2], 2, dtype=torch.float64, requires_grad=True)
    turn = torch.zeros(len(start_m), turn_bells.shape[2], 1, dtype=torch.float64, requires_grad=True)
    field = _ClearanceField.of_grid(grid)

    def present() -> tuple[Tensor, Tensor]:
        return start_m + shift_bells @ shift, start_rad + (turn_bells @ turn)[..., 0]

    def loss_terms() -> dict[str, Tensor]:
        return weighted_losses(*present(), plan, field, config)

    final = minimise([shift, turn], loss_terms, config.steps, config.learning_rate)
    with deterministic_torch(), torch.no_grad():
        position_m, heading_rad = present()
        return OptimisedPaths(TimedPaths(position_m.numpy(), heading_rad.numpy(), walks.step_s), final)


def weighted_losses(
    position_m: Float64[Tensor, "A T 2"],
    heading_rad: Float64[Tensor, "A T"],
    plan: PlannedPaths,
    field: "_ClearanceField",
    config: RoutesConfig,
) -> dict[str, Tensor]:
    """Each loss times its weight."""
    walks, step_s = plan.walks, plan.walks.step_s
    start_m, start_rad = torch.from_numpy(walks.position_m), torch.from_numpy(walks.heading_rad)
    limit_mps = torch.from_numpy(np.minimum(plan.highest_mps, SPEED_FRACTION * config.max_speed_mps))
    acceleration_mps2 = ACCELERATION_FRACTION * config.max_acceleration_mps2
    turn_rate_radps = TURN_FRACTION * config.max_turn_rate_radps
    pausing = torch.from_numpy(plan.pausing.astype(np.float64))
    terms = {
        "clearance": losses.clearance_loss(field.at(position_m), field.wanted_m),
        "separation": losses.separation_loss(position_m, config.separation_m + SEPARATION_MARGIN_M),
        "speed": losses.speed_loss(position_m, step_s, limit_mps),
        "acceleration": losses.acceleration_loss(position_m, step_s, acceleration_mps2),
        "jerk": losses.jerk_loss(position_m, step_s),
        "heading": losses.heading_loss(position_m, heading_rad, step_s),
        "turning": losses.turning_loss(heading_rad, step_s, turn_rate_radps),
        "turn_change": losses.turn_change_loss(heading_rad, step_s),
        "variation": losses.variation_loss(position_m, step_s),
        "walk": losses.walk_loss(position_m, start_m),
        "pause": losses.pause_loss(position_m, heading_rad, start_m, start_rad, pausing),
    }
    return {name: getattr(config.weights, name) * value for name, value in terms.items()}


@dataclass(frozen=True)
class _ClearanceField:
    """Distance to obstacles, negative inside them, and how much of it is wanted."""

    field_m: Float64[Tensor, "X Y"]
    origin_m: Float64[Tensor, "2"]
    cell_m: float
    wanted_m: float

    @classmethod
    def of_grid(cls, grid: NavGrid) -> "_ClearanceField":
        wanted_m = required_clearance_m(grid) + CLEARANCE_MARGIN_M
        return cls(
            torch.from_numpy(signed_clearance_m(grid)), torch.from_numpy(grid.origin_m.copy()), grid.cell_m, wanted_m
        )

    def at(self, position_m: Float64[Tensor, "A T 2"]) -> Float64[Tensor, "A T"]:
        return losses.sample_bilinear(self.field_m, self.origin_m, self.cell_m, position_m)


def signed_clearance_m(grid: NavGrid) -> Float64[np.ndarray, "X Y"]:
    """The grid's clearance, and inside obstacles the negative distance to the way out, so that gradients lead there."""
    inside_m = ndimage.distance_transform_edt(grid.clearance_m <= 0.0) * grid.cell_m
    return grid.clearance_m.astype(np.float64) - inside_m


def _own_clock(walks: TimedPaths) -> Float64[np.ndarray, "A T"]:
    """Steps that each actor has spent otherwise than standing; the clock slows down before that, smoothly."""
    clock = np.empty(walks.heading_rad.shape)
    for row, position_m in zip(clock, walks.position_m, strict=True):
        moves = np.linalg.norm(np.diff(position_m, axis=0), axis=1) > STILL_MPS * walks.step_s
        stands = ~(np.append(False, moves) | np.append(moves, False))
        away_s = ndimage.distance_transform_edt(~stands) * walks.step_s if stands.any() else np.full(len(row), np.inf)
        fraction = np.clip((away_s - walks.step_s) / SLOWING_S, 0.0, 1.0)
        rate = fraction**2 * (3.0 - 2.0 * fraction)
        row[:] = np.append(0.0, np.cumsum(0.5 * (rate[1:] + rate[:-1])))
    return clock


def _bells(clock: Float64[np.ndarray, "A T"], step_s: float) -> Float64[np.ndarray, "A T K"]:
    """Each bell's share of the shift at each time; shares add up to one."""
    width = BELL_S / step_s
    centres = np.arange(-math.ceil(2.0 * width), clock.max() + 2.0 * width + width, width)
    weights = np.exp(-0.5 * ((clock[:, :, None] - centres) / width) ** 2)
    return np.asarray(weights / weights.sum(-1, keepdims=True))
