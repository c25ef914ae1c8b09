"""The rules that the benchmark of visibility compares with, on pixels laid out by hand."""

import importlib
import sys
from collections.abc import Iterator
from types import ModuleType

import numpy as np
import pytest

from tests.support.paths import BENCHMARKS

TABLE, WALL = 7, 9


@pytest.fixture(scope="module")
def rules() -> Iterator[ModuleType]:
    sys.path.insert(0, str(BENCHMARKS))
    yield importlib.import_module("visibility_rules")
    sys.path.remove(str(BENCHMARKS))


def _decide(rules: ModuleType, rule: str, depth_m: float, around_m: list[float], around: list[int]) -> bool:
    """A rule's word on one point of the table straight ahead, where ray length is depth."""
    shot = rules.Shot(
        object_index=np.array([TABLE]),
        depth_m=np.array([depth_m]),
        length_m=np.array([depth_m]),
        stored=np.array([True]),
        around_object=np.array([around]),
        around_depth_m=np.array([around_m]),
        around_length_m=np.array([around_m]),
    )
    return bool(rules.RULES[rule](shot)[0])


@pytest.mark.parametrize(
    ("around_m", "around", "seen"),
    [
        ([2.0, 2.0, 2.0, 2.0], [TABLE] * 4, True),
        ([1.985, 1.0, 1.0, 1.0], [TABLE, WALL, WALL, WALL], True),
        ([1.975, 1.975, 1.0, 1.0], [TABLE] * 4, False),
        ([2.0, 2.0, 2.0, 2.0], [WALL] * 4, False),
        # Its known weakness: behind the table's own edge, with the wall in view, any depth will do.
        ([5.0, 1.0, 1.0, 1.0], [WALL, TABLE, TABLE, TABLE], True),
    ],
)
def test_kubric_by_hand(rules: ModuleType, around_m: list[float], around: list[int], seen: bool) -> None:
    assert _decide(rules, "Kubric", 2.0, around_m, around) == seen


@pytest.mark.parametrize(
    ("around_m", "seen"),
    [
        ([2.0, 2.0, 2.0, 2.0], True),
        ([1.95, 1.95, 1.95, 1.95], True),
        # The largest is 4% short of the point.
        ([1.92, 1.92, 1.92, 1.92], False),
        # The smallest is 6% beyond it.
        ([2.12, 2.12, 2.12, 2.12], False),
        # A median between table and wall: (2 + 5) / 2 is far from the point, though half of the pixels show it.
        ([2.0, 2.0, 5.0, 5.0], False),
        ([2.0, 2.0, 2.0, 5.0], True),
    ],
)
def test_point_odyssey_by_hand_whatever_objects_are_shown(rules: ModuleType, around_m: list[float], seen: bool) -> None:
    assert _decide(rules, "PointOdyssey", 2.0, around_m, [WALL] * 4) == seen
