"""Shares of entries that keep a rule."""

import pytest

from perpetua.audit.tally import few_enough


@pytest.mark.parametrize(
    ("failed", "tested", "least", "enough"),
    [(0, 0, 0.99, True), (1, 46, 0.99, True), (2, 46, 0.99, False), (2, 200, 0.99, True), (1, 5000, 1.0, False)],
)
def test_one_entry_alone_proves_nothing_where_some_may_fail(
    failed: int, tested: int, least: float, enough: bool
) -> None:
    assert few_enough(failed, tested, least) is enough
