"""The walls between the parts hold: over the syntax trees, and in a fresh interpreter."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.paths import ROOT, SCRIPTS

PACKAGE = ROOT / "perpetua"

TORCH_MODULES = (
    "perpetua/optimisation/adam.py",
    "perpetua/actors/",
    "perpetua/cameras/",
    "perpetua/routes/",
    "perpetua/machine/doctor.py",
    "perpetua/formats/torch_",
)
OPTIONAL = {"submitit": "perpetua/cluster/", "rerun": "perpetua/formats/"}


def _imports(path: Path, top_level_only: bool = False) -> Iterator[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = tree.body if top_level_only else list(ast.walk(tree))
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module is not None:
            yield node.module.partition(".")[0]


def _package_files() -> list[Path]:
    files = sorted(PACKAGE.rglob("*.py"))
    assert len(files) > 20
    return files


def test_package_never_imports_blender() -> None:
    offenders = {
        path.relative_to(ROOT).as_posix() for path in _package_files() if {"bpy", "mathutils"} & set(_imports(path))
    }
    assert offenders == set()


def test_only_the_suites_import_pytest_and_nothing_imports_the_suites() -> None:
    suites = PACKAGE / "testing"
    for path in _package_files():
        if not path.is_relative_to(suites):
            assert "pytest" not in set(_imports(path)), path
            assert "perpetua.testing" not in path.read_text(encoding="utf-8"), path


def _scripts() -> list[Path]:
    scripts = sorted(SCRIPTS.rglob("*.py"))
    assert len(scripts) > 20
    return scripts


def _foreign(path: Path) -> set[str]:
    """What a script imports that a Blender program may lack."""
    allowed = set(sys.stdlib_module_names) | {"bpy", "bmesh", "mathutils", "numpy", "blender_scripts"}
    if path.parent.name == "infinigen":
        allowed |= {"infinigen2", "infinigen", "procfunc", "trimesh"}
    return set(_imports(path)) - allowed


def test_blender_scripts_import_only_what_blender_has() -> None:
    assert {path.relative_to(SCRIPTS).as_posix(): _foreign(path) for path in _scripts() if _foreign(path)} == {}


def test_a_script_that_goes_through_the_wall_is_noticed(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text("import bpy\n\ndef f():\n    from perpetua.geometry import mesh\n    import scipy\n")
    assert _foreign(script) == {"perpetua", "scipy"}


def test_torch_is_imported_only_where_something_is_optimised() -> None:
    offenders = {
        name
        for path in _package_files()
        if "torch" in set(_imports(path)) and not (name := path.relative_to(ROOT).as_posix()).startswith(TORCH_MODULES)
    }
    assert offenders == set()


@pytest.mark.parametrize(("module", "home"), sorted(OPTIONAL.items()))
def test_optional_dependency_stays_in_its_room(module: str, home: str) -> None:
    for path in _package_files():
        if module in set(_imports(path)):
            assert path.relative_to(ROOT).as_posix().startswith(home)
            assert module not in set(_imports(path, top_level_only=True))


def test_command_line_starts_without_heavy_imports() -> None:
    code = (
        "import sys, perpetua.cli.app; print(sorted({'torch', 'bpy', 'anny', 'submitit', 'rerun'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_importing_every_stage_leaves_blender_out() -> None:
    code = "import sys, perpetua.pipeline.runner; print(sorted({'bpy', 'mathutils', 'infinigen2'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
