"""The public packages: each name is there and described, and none of them brings torch until it is used."""

import importlib
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
