"""The one loop around torch's Adam, for routes and cameras. Same input, same bits, on any machine load."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import torch


@contextmanager
def deterministic_torch() -> Iterator[None]:
    """One thread and deterministic kernels, so that sums are added in one order whatever the worker count."""
    threads = torch.get_num_threads()
    deterministic = torch.are_deterministic_algorithms_enabled()
    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(True)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
        torch.use_deterministic_algorithms(deterministic)


def minimise(
    parameters: Sequence[torch.Tensor],
    loss_terms: Callable[[], dict[str, torch.Tensor]],
    steps: int,
    learning_rate: float,
) -> dict[str, float]:
    """Minimises the sum of ``loss_terms`` over ``parameters`` in place with Adam and a cosine learning rate.

    Args:
        parameters: leaf tensors with ``requires_grad``.
        loss_terms: the weighted terms, each a scalar, computed from the parameters' present values.
        steps: Adam steps.
        learning_rate: at the start; it falls to a hundredth along half a cosine (Loshchilov & Hutter 2017).

    Returns:
        The terms' final values.
    """
    optimiser = torch.optim.Adam(list(parameters), lr=learning_rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps, eta_min=0.01 * learning_rate)
    with deterministic_torch():
        for _ in range(steps):
            optimiser.zero_grad()
            torch.stack(list(loss_terms().values())).sum().backward()
            optimiser.step()
            schedule.step()
        with torch.no_grad():
            return {name: float(value) for name, value in loss_terms().items()}
