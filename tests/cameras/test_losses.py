"""Each loss is zero where its wish is met, grows where it is not, and has the gradient of finite differences."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import Tensor

from perpetua.cameras import losses
from perpetua.cameras.field import SignedDistanceField, distance_at_m

TAN_HALF_FOV = torch.tensor([[[0.6, 0.45]]], dtype=torch.float64)
AXIS_M = torch.zeros(1, 4, 2, dtype=torch.float64)


def _row(*values: float) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)[None, None]


def _path(*points: tuple[float, float, float]) -> Tensor:
    return torch.tensor(points, dtype=torch.float64)[None, None]


def _points(*points: tuple[float, float, float]) -> Tensor:
    """One body point of one actor at each time, in camera coordinates."""
    return _path(*points)[:, :, :, None, None]


def _framing(point: tuple[float, float, float]) -> float:
    weight = torch.ones(1, 1, 1, 1, 1, dtype=torch.float64)
    return float(losses.framing(_points(point), TAN_HALF_FOV, weight, 0.1))


def test_field_lookup_equals_the_plain_one() -> None:
    rng = np.random.default_rng(0)
    field = SignedDistanceField(np.array([-1.0, 0.5, -0.2]), 0.1, rng.normal(size=(9, 7, 12)).astype(np.float32))
    points_m = field.origin_m + 0.1 * rng.uniform(-1.0, 12.0, (300, 3))
    grid, origin_m = torch.tensor(field.distance_m, dtype=torch.float64), torch.tensor(field.origin_m)
    found = losses.field_distance(grid, origin_m, 0.1, torch.tensor(points_m))
    np.testing.assert_allclose(found.numpy(), distance_at_m(field, points_m), atol=1e-9)


def test_clearance_counts_what_is_nearer_than_wanted() -> None:
    assert float(losses.clearance(_row(0.2, 0.5, 3.0), 0.2)) == 0.0
    assert float(losses.clearance(_row(0.1, 0.5), 0.2)) == pytest.approx((0.5 + 0.25) / 2)
    assert losses.clearance(_row(-0.1, 0.5), 0.2) > losses.clearance(_row(0.0, 0.5), 0.2)


def test_capsule_distance_beside_above_and_inside() -> None:
    one = torch.ones(1, 3, dtype=torch.float64)
    position_m = _path((1.0, 0.0, 1.0), (0.0, 0.0, 2.5), (0.1, 0.0, 1.0))
    distance_m = losses.capsule_distance(position_m, AXIS_M[:, :3], 0.0 * one, 1.8 * one, 0.3 * one)
    torch.testing.assert_close(distance_m.flatten(), _row(0.7, 0.4, -0.2).flatten(), atol=1e-3, rtol=0.0)


def test_framing_grows_from_the_margin_to_behind_the_camera() -> None:
    assert _framing((0.5, 0.3, 1.0)) == 0.0
    assert 0.0 < _framing((0.58, 0.0, 1.0)) < _framing((1.5, 0.0, 1.0)) < _framing((1.5, 0.0, -1.0))
    assert _framing((0.0, 0.42, 1.0)) > 0.0


def test_size_counts_too_near_and_too_far() -> None:
    def size(distance_m: float) -> float:
        least, most = torch.full((1, 1), 0.4), torch.full((1, 1), 0.8)
        weight = torch.ones(1, 1, 1, 1)
        height_m = torch.full((1, 1), 1.8)
        return float(losses.size(torch.full((1, 1, 1, 1), distance_m), height_m, TAN_HALF_FOV, least, most, weight))

    # 1.8 m fill 0.8 of the image's height at 2.5 m and 0.4 at 5 m.
    assert size(2.6) == size(4.9) == 0.0
    assert size(1.25) == pytest.approx(np.log(2.0) ** 2)
    assert size(10.0) == pytest.approx(np.log(2.0) ** 2)


def test_coverage_asks_for_as_many_views_as_wanted() -> None:
    seen, hidden = (0.0, 0.0, 2.0), (0.0, 0.0, -2.0)
    fov = TAN_HALF_FOV.expand(1, 3, 2)
    two = torch.cat([_points(place) for place in (seen, hidden, seen)], dim=1)
    one = torch.cat([_points(place) for place in (seen, hidden, hidden)], dim=1)
    clear = torch.zeros(1, 3, 1, 1, dtype=torch.float64)
    assert float(losses.coverage(two, fov, clear, 2, 0.1)) == 0.0
    assert 0.4 < float(losses.coverage(one, fov, clear, 2, 0.1)) <= 0.5
    assert float(losses.coverage(one, fov, clear, 1, 0.1)) == float(losses.coverage(one, fov, clear, 0, 0.1)) == 0.0


def test_coverage_asks_for_a_clear_line_of_sight() -> None:
    two, fov = _points((0.0, 0.0, 2.0)).expand(1, 2, 1, 1, 1, 3), TAN_HALF_FOV.expand(1, 2, 2)
    one_blocked = torch.tensor([0.0, 1.0], dtype=torch.float64)[None, :, None, None]
    assert float(losses.coverage(two, fov, one_blocked, 1, 0.1)) == 0.0
    assert float(losses.coverage(two, fov, one_blocked, 2, 0.1)) == pytest.approx(0.5 / 1.15)


def test_blocked_counts_samples_near_the_scene() -> None:
    lines_m = torch.tensor([[0.5, 0.3, 0.5], [0.5, 0.0, 0.5], [0.06, 0.3, 0.5], [-0.9, -0.9, -0.9]])
    found = losses.blocked(lines_m[None, None, None], 0.12).flatten()
    torch.testing.assert_close(found, torch.tensor([0.0, 0.25, 0.0625, 1.0]))


def test_occlusion_counts_the_focus_only() -> None:
    blocked, focus = _row(1.0, 0.0)[:, :, None], _row(0.0, 1.0)[:, :, None]
    assert float(losses.occlusion(blocked, focus)) == 0.0
    assert float(losses.occlusion(blocked, 1.0 - focus)) == 1.0


def test_foreground_counts_large_actors_in_the_image() -> None:
    height_m = torch.full((1, 1), 1.8, dtype=torch.float64)

    def foreground(point: tuple[float, float, float]) -> float:
        return float(losses.foreground(_points(point), height_m, TAN_HALF_FOV, 1.3))

    # 1.8 m fill the image 1.3 times at 1.54 m, twice that at half of it.
    assert foreground((0.0, 0.0, 1.6)) == 0.0
    assert foreground((0.0, 0.0, 0.77)) == pytest.approx(np.log(2.0 * 1.5385 / 1.54) ** 2, rel=1e-3)
    assert foreground((0.0, 0.0, -0.7)) < 0.1 * foreground((0.0, 0.0, 0.7))
    assert foreground((0.0, 0.0, 1.2)) < foreground((0.0, 0.0, 0.6))


def test_crowding_counts_others_on_the_line_of_sight_only() -> None:
    camera, target = _path((0.0, 0.0, 1.0)), _path((4.0, 0.0, 1.0))

    def crowding(x: float, y: float) -> float:
        point_m = torch.tensor([[[[x, y, 1.0]]]], dtype=torch.float64)
        return float(losses.crowding(camera, target, point_m, torch.ones(1, 1, 1, 1, dtype=torch.bool), 0.3))

    assert crowding(2.0, 0.0) == pytest.approx(1.0, abs=1e-3)
    assert crowding(2.0, 0.31) == crowding(5.0, 0.0) == 0.0
    assert 0.0 < crowding(2.0, 0.2) < crowding(2.0, 0.1)


def test_speed_above_the_limit_counts_relative_to_it() -> None:
    assert float(losses.over_limit(_row(0.9, 1.0), 1.0)) == 0.0
    assert float(losses.over_limit(_row(3.0, 1.0), 1.0)) == pytest.approx(2.0)


def test_unsteadiness_is_a_mean_square() -> None:
    assert float(losses.unsteadiness(_path((2.0, 0.0, 0.0), (0.0, 0.0, 0.0)), 2.0)) == pytest.approx(0.5)


def test_travel_wants_speed_and_spread() -> None:
    wished_mps = torch.full((1, 1), 0.5, dtype=torch.float64)
    steps = torch.arange(17, dtype=torch.float64)
    still = torch.zeros(1, 1, 17, 3, dtype=torch.float64)
    moving, to_and_fro = still.clone(), still.clone()
    moving[..., 0] = 0.0625 * steps
    to_and_fro[..., 0] = 0.0625 * (steps % 2)
    assert float(losses.travel(moving, 0.125, wished_mps)) == pytest.approx(0.0, abs=1e-6)
    assert float(losses.travel(still, 0.125, wished_mps)) == pytest.approx(2.0, abs=1e-3)
    assert float(losses.travel(to_and_fro, 0.125, wished_mps)) > 0.3
    assert float(losses.travel(4.0 * moving, 0.125, wished_mps)) > 1.0


def test_revisiting_counts_places_seen_again_after_a_while() -> None:
    fraction = torch.linspace(0.0, 1.0, 41, dtype=torch.float64)
    away = torch.zeros(1, 1, 41, 3, dtype=torch.float64)
    back = away.clone()
    away[..., 0] = 6.0 * fraction
    back[..., 0] = 6.0 * torch.minimum(fraction, 1.0 - fraction)
    assert float(losses.revisiting(away, 0.2)) < 0.01 < 0.1 < float(losses.revisiting(back, 0.2))
    assert float(losses.revisiting(away[:, :, :5], 0.2)) == 0.0


def test_diversity_counts_pairs_of_like_views() -> None:
    def diversity(*places: tuple[float, float, float]) -> float:
        position_m = torch.tensor(places, dtype=torch.float64)[None, :, None].expand(1, len(places), 4, 3)
        return float(losses.diversity(position_m, AXIS_M, 0.5))

    assert diversity((2.0, 0.0, 1.0), (0.0, 3.0, 1.0), (-1.0, 0.0, 2.0)) == 0.0
    assert diversity((2.0, 0.0, 1.0), (4.0, 0.0, 1.0)) == pytest.approx(1.0, abs=1e-4)


def test_band_counts_below_and_above() -> None:
    low, high = torch.full((1, 1), 1.0), torch.full((1, 1), 2.0)
    assert float(losses.outside_band(_row(1.0, 1.5, 2.0), low, high, 0.5)) == 0.0
    assert float(losses.outside_band(_row(0.5, 3.0), low, high, 0.5)) == pytest.approx((1.0 + 4.0) / 2)


def _smooth_cases() -> dict[str, Callable[[Tensor], Tensor]]:
    """Losses as functions of camera positions (1, 2, 5, 3)."""
    rng = torch.Generator().manual_seed(3)

    def random(*shape: int) -> Tensor:
        return torch.rand(*shape, generator=rng, dtype=torch.float64)

    grid, axis_m = random(12, 12, 12), 2.0 * random(2, 5, 2)
    bottom_m, height_m = torch.zeros(2, 5, dtype=torch.float64), 1.0 + random(2, 5)
    fov, weight = 0.4 + 0.2 * random(1, 2, 2), random(1, 2, 5, 2)
    body_m, wish = random(2, 5, 2, 3), 0.3 + random(1, 2)
    other = torch.ones(1, 2, 5, 2, dtype=torch.bool)
    origin_m = torch.full((3,), -1.0, dtype=torch.float64)

    def sight(p: Tensor) -> Tensor:
        return body_m.transpose(0, 1) - p[..., None, None, :]

    return {
        "field": lambda p: losses.clearance(losses.field_distance(grid, origin_m, 0.4, p), 0.8),
        "capsule": lambda p: losses.clearance(losses.capsule_distance(p, axis_m, bottom_m, height_m, bottom_m), 2.0),
        "framing": lambda p: losses.framing(sight(p), fov, weight[..., None].expand(1, 2, 5, 2, 2), 0.1),
        "size": lambda p: losses.size(sight(p)[..., 0, :].norm(dim=-1), height_m, fov, 2.0 * wish, 3.0 * wish, weight),
        "coverage": lambda p: losses.coverage(sight(p), fov, p[..., :2].square(), 1, 0.1),
        "blocked": lambda p: losses.blocked(p[..., None, :].expand(1, 2, 5, 2, 3), 0.8).sum().unsqueeze(0),
        "occlusion": lambda p: losses.occlusion(p[..., :2].square(), weight),
        "foreground": lambda p: losses.foreground(sight(p), height_m, fov, 0.5),
        "crowding": lambda p: losses.crowding(p, 2.0 * p + 1.0, body_m, other, 1.5),
        "travel": lambda p: losses.travel(p, 0.7, 3.0 * wish),
        "revisiting": lambda p: losses.revisiting(p, 1.0),
        "diversity": lambda p: losses.diversity(p, axis_m, 0.1),
        "limits": lambda p: losses.over_limit(p.norm(dim=-1), 0.2),
        "steadiness": lambda p: losses.unsteadiness(p.diff(dim=2), 0.2),
    }


@pytest.mark.parametrize("name", list(_smooth_cases()))
def test_gradient_agrees_with_finite_differences(name: str) -> None:
    loss = _smooth_cases()[name]
    position_m = torch.rand(1, 2, 5, 3, generator=torch.Generator().manual_seed(4), dtype=torch.float64) * 1.9 - 0.6
    position_m.requires_grad_(True)
    assert float(loss(position_m).detach().sum()) > 1e-4
    assert torch.autograd.gradcheck(loss, (position_m,), eps=1e-7, atol=1e-4)
