"""Each loss of the route optimisation: its value on a case worked out by hand, and its gradient."""

import math
from collections.abc import Callable

import numpy as np
import pytest
import torch
from scipy import ndimage
from torch import Tensor

from perpetua.routes import losses

STEP_S = 0.1
PAUSING = torch.zeros(3, 12, dtype=torch.float64)
PAUSING[1:, 4:9] = 1.0


def straight(speed_mps: float, steps: int = 30) -> Tensor:
    x = torch.arange(steps, dtype=torch.float64) * STEP_S * speed_mps
    return torch.stack([x, torch.zeros_like(x)], dim=-1)[None]


def limit(speed_mps: float) -> Tensor:
    return torch.tensor([speed_mps], dtype=torch.float64)


def wiggly(actors: int = 3, steps: int = 12) -> tuple[Tensor, Tensor]:
    rng = np.random.default_rng(5)
    position_m = torch.from_numpy(rng.normal(scale=0.4, size=(actors, steps, 2)))
    return position_m, torch.from_numpy(rng.normal(scale=1.5, size=(actors, steps)))


@pytest.mark.parametrize(
    ("name", "loss"),
    [
        ("clearance", lambda p, h: losses.clearance_loss(p[..., 0], 0.3)),
        ("separation", lambda p, h: losses.separation_loss(p, 0.9)),
        ("speed", lambda p, h: losses.speed_loss(p, STEP_S, torch.tensor([0.5, 1.0, 2.0], dtype=torch.float64))),
        ("acceleration", lambda p, h: losses.acceleration_loss(p, STEP_S, 3.0)),
        ("jerk", lambda p, h: losses.jerk_loss(p, STEP_S)),
        ("heading", lambda p, h: losses.heading_loss(p, h, STEP_S)),
        ("turning", lambda p, h: losses.turning_loss(h, STEP_S, 2.0)),
        ("turn change", lambda p, h: losses.turn_change_loss(h, STEP_S)),
        ("variation", lambda p, h: losses.variation_loss(p, 1.0)),
        ("walk", lambda p, h: losses.walk_loss(p, torch.zeros_like(p))),
        ("pause", lambda p, h: losses.pause_loss(p, h, torch.zeros_like(p), torch.ones_like(h), PAUSING)),
    ],
)
def test_gradient_agrees_with_finite_differences(name: str, loss: Callable[[Tensor, Tensor], Tensor]) -> None:
    position_m, heading_rad = wiggly()
    position_m.requires_grad_()
    heading_rad.requires_grad_()
    value = loss(position_m, heading_rad)
    assert value.shape == ()
    assert float(value.detach()) > 0.0
    grads = torch.autograd.grad(value, [position_m, heading_rad], allow_unused=True)
    assert any(grad is not None and bool((grad != 0).any()) for grad in grads)
    assert torch.autograd.gradcheck(loss, (position_m, heading_rad), eps=1e-6, atol=1e-5, rtol=1e-4)


def test_bilinear_lookup_is_exact_for_a_plane_and_has_its_gradient() -> None:
    x, y = torch.meshgrid(torch.arange(9, dtype=torch.float64), torch.arange(7, dtype=torch.float64), indexing="ij")
    origin_m, cell_m = torch.tensor([-0.4, 0.2], dtype=torch.float64), 0.1
    plane = 2.0 * (origin_m[0] + cell_m * x) - 3.0 * (origin_m[1] + cell_m * y)
    place_m = torch.tensor([[[-0.33, 0.41], [0.123, 0.777], [0.4, 0.8]]], dtype=torch.float64, requires_grad=True)
    value = losses.sample_bilinear(plane, origin_m, cell_m, place_m)
    assert torch.allclose(value, 2.0 * place_m[..., 0] - 3.0 * place_m[..., 1], atol=1e-12)
    value[:, :2].sum().backward()
    assert place_m.grad is not None
    assert torch.allclose(place_m.grad[0, :2], torch.tensor([[2.0, -3.0]] * 2, dtype=torch.float64))


def test_bilinear_lookup_agrees_with_scipy_and_repeats_the_border() -> None:
    rng = np.random.default_rng(0)
    field = rng.normal(size=(6, 5))
    places = rng.uniform(-1.0, 7.0, size=(1, 50, 2))
    ours = losses.sample_bilinear(
        torch.from_numpy(field), torch.zeros(2, dtype=torch.float64), 1.0, torch.from_numpy(places)
    )
    theirs = ndimage.map_coordinates(field, places[0].T, order=1, mode="nearest")
    assert np.allclose(ours[0].numpy(), theirs)


def test_clearance_counts_only_the_shortfall() -> None:
    clearance_m = torch.tensor([[0.1, 0.3, 0.5]], dtype=torch.float64)
    assert float(losses.clearance_loss(clearance_m, 0.3)) == pytest.approx(0.04 / 3)


def test_separation_counts_each_pair_once() -> None:
    still = torch.zeros(3, 4, 2, dtype=torch.float64)
    still[1, :, 0] = 0.5
    still[2, :, 1] = 10.0
    assert float(losses.separation_loss(still, 0.6)) == pytest.approx(0.1**2 * 4 / 12, rel=1e-4)


def test_steady_walk_costs_nothing() -> None:
    path_m = straight(1.0)
    ahead = torch.zeros(1, 30, dtype=torch.float64)
    assert float(losses.speed_loss(path_m, STEP_S, limit(1.01))) == 0.0
    assert float(losses.acceleration_loss(path_m, STEP_S, 0.01)) == 0.0
    assert float(losses.jerk_loss(path_m, STEP_S)) == pytest.approx(0.0, abs=1e-15)
    assert float(losses.heading_loss(path_m, ahead, STEP_S)) == pytest.approx(0.0, abs=1e-6)
    assert float(losses.walk_loss(path_m, path_m)) == 0.0


def test_speed_and_jerk_have_the_values_of_known_motion() -> None:
    assert float(losses.speed_loss(straight(1.7), STEP_S, limit(1.2))) == pytest.approx(0.25, rel=1e-6)
    t = torch.arange(30, dtype=torch.float64) * STEP_S
    cubic = torch.stack([t**3, torch.zeros_like(t)], dim=-1)[None]
    assert float(losses.jerk_loss(cubic, STEP_S)) == pytest.approx(36.0, rel=1e-6)
    parabola = torch.stack([0.5 * 5.0 * t**2, torch.zeros_like(t)], dim=-1)[None]
    assert float(losses.acceleration_loss(parabola, STEP_S, 3.0)) == pytest.approx(4.0, rel=1e-6)


@pytest.mark.parametrize(("off_rad", "cost"), [(0.0, 0.0), (math.pi / 2, 1.3), (math.pi, 2.6)])
def test_heading_costs_most_when_walking_backwards(off_rad: float, cost: float) -> None:
    heading_rad = torch.full((1, 30), off_rad, dtype=torch.float64)
    assert float(losses.heading_loss(straight(1.3), heading_rad, STEP_S)) == pytest.approx(cost, abs=1e-6)


def test_turning_counts_the_excess_over_the_limit() -> None:
    turn = (torch.arange(20, dtype=torch.float64) * STEP_S * 3.0)[None]
    assert float(losses.turning_loss(turn, STEP_S, 2.5)) == pytest.approx(0.25)
    assert float(losses.turn_change_loss(turn, STEP_S)) == pytest.approx(0.0, abs=1e-12)


def test_variation_prefers_new_floor() -> None:
    assert float(losses.variation_loss(straight(0.0, 60), STEP_S)) == pytest.approx(1.0)
    assert float(losses.variation_loss(straight(2.0, 60), STEP_S)) < 1e-6
    there = straight(1.0, 60)
    back = torch.cat([there[:, :30], there[:, :30].flip(1)], dim=1)
    assert float(losses.variation_loss(back, STEP_S)) > 5 * float(losses.variation_loss(there, STEP_S))
    assert float(losses.variation_loss(straight(0.0, 10), STEP_S)) == 0.0


def test_speed_is_limited_for_each_actor_alone() -> None:
    both = torch.cat([straight(1.5), straight(2.5)])
    limits = torch.tensor([1.0, 3.0], dtype=torch.float64)
    assert float(losses.speed_loss(both, STEP_S, limits)) == pytest.approx(0.5 * 0.25, rel=1e-6)


def test_a_pause_costs_its_distance_and_its_turn_and_nothing_else_does() -> None:
    walk_m, facing_rad = straight(0.0, 10), torch.zeros(1, 10, dtype=torch.float64)
    pausing = torch.zeros(1, 10, dtype=torch.float64)
    pausing[0, 5:] = 1.0
    moved_m = walk_m + torch.tensor([0.3, 0.4], dtype=torch.float64)
    assert float(losses.pause_loss(moved_m, facing_rad, walk_m, facing_rad, pausing)) == pytest.approx(0.125)
    turned_rad = facing_rad + 2 * math.pi + 0.1
    assert float(losses.pause_loss(walk_m, turned_rad, walk_m, facing_rad, pausing)) == pytest.approx(0.005, rel=1e-2)
    assert float(losses.pause_loss(moved_m, turned_rad, walk_m, facing_rad, 0.0 * pausing)) == 0.0
