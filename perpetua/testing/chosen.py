"""Which implementations the suites test, and the samples that belong to them."""

import importlib
import os
from importlib.metadata import EntryPoint, entry_points
from types import ModuleType
from typing import Any

from perpetua.registry import BUILT_IN, Registry

# Name of an installed package. Options of pytest cannot be used: those of a suite that lies in a package come too late.
PACKAGE_VARIABLE = "PERPETUA_TEST_PACKAGE"
SAMPLES_GROUP = "perpetua.testing"
_BUILT_IN_SAMPLES = "perpetua.testing.built_in_samples"


def chosen_package() -> str:
    """The package whose plug-ins are tested: "perpetua", unless the environment names another."""
    return os.environ.get(PACKAGE_VARIABLE) or BUILT_IN


def names_of(registry: Registry[Any], package: str) -> list[str]:
    """Entries of a registry that a package brings, usable or not: one that cannot be loaded fails its tests."""
    return [name for name in registry if package in _packages(registry, name)]


def samples_of(package: str, table: str) -> dict[str, Any]:
    """The samples of a package by the name of what they are for, from one of its tables; empty where it has none."""
    module = _samples_module(package)
    return dict(getattr(module, table, {})) if module is not None else {}


def _packages(registry: Registry[Any], name: str) -> set[str]:
    """Without their versions; several where they offer one name."""
    return {origin.partition(" ")[0] for origin in registry.origin(name).split(", ")}


def _samples_module(package: str) -> ModuleType | None:
    if package == BUILT_IN:
        return importlib.import_module(_BUILT_IN_SAMPLES)
    for point in entry_points(group=SAMPLES_GROUP):
        if _is_of(point, package):
            module = point.load()
            assert isinstance(module, ModuleType), f"'{point.value}' of {package} must be a module of samples"
            return module
    return None


def _is_of(point: EntryPoint, package: str) -> bool:
    return point.dist is not None and point.dist.name == package
