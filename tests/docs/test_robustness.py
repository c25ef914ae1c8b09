"""The page of what was tried says what the tests try."""

import ast

import pytest

from tests.support.paths import TESTS
from tests.support.robustness import FAULTS, PAGE, Fault, page


def test_page_is_the_tests_own_list() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "run: python -m tests.support.robustness > docs/robustness.md"


def test_enough_was_tried_and_nothing_twice() -> None:
    rows = [
        line for line in page().splitlines() if line.startswith("| ") and not line.startswith(("| fault", "| input"))
    ]
    assert len(rows) >= 60
    assert len(set(rows)) == len(rows)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.what)
def test_fault_is_shown_by_a_test_that_exists(fault: Fault) -> None:
    tree = ast.parse((TESTS / fault.file).read_text(encoding="utf-8"))
    assert fault.test in {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
