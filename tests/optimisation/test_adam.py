import numpy as np
import torch

from perpetua.optimisation.adam import deterministic_torch, minimise


def _solve() -> tuple[torch.Tensor, dict[str, float]]:
    place = torch.tensor([4.0, -2.0], dtype=torch.float64, requires_grad=True)
    goal = torch.tensor([1.0, 3.0], dtype=torch.float64)
    final = minimise([place], lambda: {"far": ((place - goal) ** 2).sum(), "steep": 0 * place.sum()}, 500, 0.1)
    return place.detach(), final


def test_minimise_finds_the_minimum_and_reports_each_term() -> None:
    place, final = _solve()
    np.testing.assert_allclose(place.numpy(), [1.0, 3.0], atol=1e-3)
    assert set(final) == {"far", "steep"}
    assert final["far"] < 1e-6


def test_minimise_gives_the_same_bits() -> None:
    assert torch.equal(_solve()[0], _solve()[0])


def test_settings_of_torch_are_given_back() -> None:
    before = (torch.get_num_threads(), torch.are_deterministic_algorithms_enabled())
    with deterministic_torch():
        assert torch.get_num_threads() == 1
        assert torch.are_deterministic_algorithms_enabled()
    assert (torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()) == before
