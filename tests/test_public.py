"""The public packages: each name is there and described, and none of them brings torch until it is used."""

import functools
import importlib
import inspect
import subprocess
import sys

import pytest

from tests.support.doc_pages import blocks

PACKAGES = ("perpetua", "perpetua.formats", "perpetua.evaluation")


@pytest.mark.parametrize("package", PACKAGES)
def test_public_names_are_there(package: str) -> None:
    module = importlib.import_module(package)
    assert sorted(set(module.__all__)) == sorted(module.__all__)
    for name in module.__all__:
        assert getattr(module, name) is not None


def undescribed(name: str, value: object) -> list[str]:
    """The value's name, and those of a class's own public methods and properties, where they have no docstring."""
    own = vars(value).items() if inspect.isclass(value) else ()
    parts = [(f"{name}.{part}", entry) for part, entry in own if not part.startswith("_") and is_code(entry)]
    return [place for place, entry in [(name, value), *parts] if not (entry.__doc__ or "").strip()]


def is_code(entry: object) -> bool:
    return inspect.isfunction(entry) or isinstance(entry, property | functools.cached_property | classmethod)


@pytest.mark.parametrize("package", PACKAGES)
def test_public_names_are_described(package: str) -> None:
    module = importlib.import_module(package)
    values = {name: getattr(module, name) for name in module.__all__}
    code = {name: value for name, value in values.items() if inspect.isclass(value) or inspect.isroutine(value)}
    assert [place for name, value in code.items() for place in undescribed(name, value)] == []


def test_a_public_name_without_description_is_noticed() -> None:
    class Planted:
        """Described, unlike its method."""

        def method(self) -> None: ...

    assert undescribed("Planted", Planted) == ["Planted.method"]


def test_torch_is_not_imported_before_it_is_used() -> None:
    code = f"import sys, {', '.join(PACKAGES)}; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    used = "import sys, perpetua.formats; perpetua.formats.SequenceDataset; sys.exit('torch' not in sys.modules)"
    assert subprocess.run([sys.executable, "-c", used], check=False).returncode == 0


def test_a_name_that_is_not_public_is_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'SequenceDatasets'"):
        importlib.import_module("perpetua.formats").SequenceDatasets  # noqa: B018


@pytest.mark.parametrize("page", ["docs/python.md", "docs/file_format.md", "README.md"])
def test_examples_for_readers_import_public_packages_alone(page: str) -> None:
    lines = [line.split() for code in blocks(page, "python") for line in code.splitlines()]
    imported = {words[1] for words in lines if words[:1] in (["import"], ["from"]) and words[1].startswith("perpetua")}
    assert imported <= {*PACKAGES, "perpetua.errors"}
