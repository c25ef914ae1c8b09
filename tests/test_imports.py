"""The table of which folder may import which, docs/imports.yaml: it is true, has no loop, and is on the page."""

from collections.abc import Iterator
from pathlib import Path

import grimp
import pytest
import yaml

from tests.support.paths import ROOT

TABLE = ROOT / "docs" / "imports.yaml"
PAGE = ROOT / "docs" / "architecture.md"
# What the audit may not use, not even through another module: what plans, makes, follows points or exports.
PLANNERS = ("motion", "actors.bodies", "actors.clothing", "actors.checks", "tracks", "labels", "rendering", "pipeline")
PLANNING_MODULES = (
    "routes.plan",
    "routes.optimise",
    "cameras.plan",
    "cameras.optimise",
    "cameras.audit",
    "formats.tapvid_mv",
)
# Settings that hold the limits, which the audit shares with what plans by them.
SHARED = {"motion.config"}

Table = dict[str, list[str]]


def _table() -> Table:
    content: Table = yaml.safe_load(TABLE.read_text(encoding="utf-8"))
    return content


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("perpetua", cache_dir=None)


def _folder(module: str) -> str:
    """The folder that holds a module, dotted, below the package; a module at the top stands for itself."""
    path = ROOT.joinpath(*module.split("."))
    parts = module.split(".")[1:]
    return ".".join(parts if path.is_dir() else parts[:-1] or parts) or "perpetua"


def _edges(graph: grimp.ImportGraph) -> set[tuple[str, str]]:
    pairs = (
        (_folder(module), _folder(imported))
        for module in graph.modules
        for imported in graph.find_modules_directly_imported_by(module)
    )
    return {pair for pair in pairs if pair[0] != pair[1]}


def _pairs(table: Table) -> set[tuple[str, str]]:
    return {(folder, imported) for folder, all_imported in table.items() for imported in all_imported}


def _loops(table: Table) -> Iterator[str]:
    """Folders from which imports lead back to themselves."""
    for folder in table:
        waiting, seen = list(table[folder]), set()
        while waiting:
            at = waiting.pop()
            if at not in seen:
                seen.add(at)
                waiting += table.get(at, [])
        if folder in seen:
            yield folder


def test_table_is_what_the_code_imports(graph: grimp.ImportGraph) -> None:
    said, done = _pairs(_table()), _edges(graph)
    assert done - said == set(), "imports that docs/imports.yaml does not allow: do without, or add them to the table"
    assert said - done == set(), "docs/imports.yaml allows what nobody imports: take it out"


def test_no_folder_is_imported_by_what_it_imports() -> None:
    assert list(_loops(_table())) == []
    assert list(_loops({"a": ["b"], "b": ["c"], "c": ["a"], "d": ["a"]})) == ["a", "b", "c"]


def test_audit_uses_nothing_that_plans_or_exports(graph: grimp.ImportGraph) -> None:
    used = {name.removeprefix("perpetua.") for name in graph.find_upstream_modules("perpetua.audit", as_package=True)}
    assert "geometry.raycast" in used
    below = tuple(f"{folder}." for folder in PLANNERS)
    assert {name for name in used if name in PLANNING_MODULES or name.startswith(below)} <= SHARED


def test_page_shows_the_table() -> None:
    cells = {folder: ", ".join(f"`{name}`" for name in names) or "nothing" for folder, names in _table().items()}
    rows = [f"| `{folder}` | {cell} |" for folder, cell in cells.items()]
    assert "\n".join(rows) in PAGE.read_text(encoding="utf-8"), "write the rows of docs/imports.yaml into the page"


def test_cluster_knows_the_pipeline_alone() -> None:
    assert set(_table()["cluster"]) <= {"pipeline", "io", "machine", "errors"}


def test_every_folder_has_a_row() -> None:
    folders = {".".join(p.relative_to(ROOT / "perpetua").parts) for p in _package_folders()}
    assert folders - {""} <= set(_table())


def _package_folders() -> list[Path]:
    return [path.parent for path in (ROOT / "perpetua").rglob("*.py")]
