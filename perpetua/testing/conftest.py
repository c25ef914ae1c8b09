"""Hands the suites the implementations that the environment chooses, with their samples."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from perpetua.actors.bodies.source import BODY_MODELS
from perpetua.formats.source import EXPORTERS
from perpetua.machine.assets import ASSET_FOLDER_VARIABLE
from perpetua.motion.source import MOTION_SOURCES
from perpetua.registry import Registry
from perpetua.rooms.source import ROOM_SOURCES
from perpetua.testing.chosen import PACKAGE_VARIABLE, chosen_package, names_of, samples_of
from perpetua.testing.samples import ExporterSample, RoomSample

REGISTRIES: tuple[Registry[Any], ...] = (ROOM_SOURCES, BODY_MODELS, MOTION_SOURCES, EXPORTERS)
MARKS = ("slow", "blender", "infinigen")


def pytest_configure(config: pytest.Config) -> None:
    """Marks that the samples use, where no project's settings have them."""
    for mark in MARKS:
        config.addinivalue_line("markers", f"{mark}: see Perpetua's pyproject.toml")


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """One test for each implementation that a suite is about."""
    package = chosen_package()
    if not any(names_of(registry, package) for registry in REGISTRIES):
        raise pytest.UsageError(f"{PACKAGE_VARIABLE}: no installed package '{package}' adds anything to Perpetua")
    if "room_case" in metafunc.fixturenames:
        metafunc.parametrize("room_case", list(_room_cases(package)), scope="module")
    if "many_rooms" in metafunc.fixturenames:
        metafunc.parametrize("many_rooms", list(_many_rooms(package)))
    if "model" in metafunc.fixturenames:
        metafunc.parametrize("model", names_of(BODY_MODELS, package), scope="module")
    if "source" in metafunc.fixturenames:
        metafunc.parametrize("source", names_of(MOTION_SOURCES, package), scope="module")
    if "exporter" in metafunc.fixturenames:
        metafunc.parametrize("exporter", list(_exporters(package)), scope="module")


def _room_samples(package: str) -> dict[str, RoomSample]:
    samples = samples_of(package, "ROOM_SAMPLES")
    return {source: samples.get(source, RoomSample()) for source in names_of(ROOM_SOURCES, package)}


def _room_cases(package: str) -> Iterator[object]:
    for source, sample in _room_samples(package).items():
        for kind in sample.kinds:
            yield pytest.param((source, kind, sample), id=f"{source}-{kind}", marks=sample.marks)


def _many_rooms(package: str) -> Iterator[object]:
    for source, sample in _room_samples(package).items():
        if sample.many_draws:
            yield pytest.param((source, sample), id=source, marks=sample.marks)


def _exporters(package: str) -> Iterator[object]:
    samples = samples_of(package, "EXPORTER_SAMPLES")
    for name in names_of(EXPORTERS, package):
        sample = samples.get(name, ExporterSample())
        yield pytest.param((name, sample), id=name, marks=sample.marks)


@pytest.fixture(scope="module")
def package() -> str:
    """The package whose plug-ins are tested."""
    return chosen_package()


@pytest.fixture(scope="module")
def no_assets(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder for samples; assets that this machine may have are not found."""
    folder = tmp_path_factory.mktemp("samples")
    patch = pytest.MonkeyPatch()
    request.addfinalizer(patch.undo)
    patch.setenv(ASSET_FOLDER_VARIABLE, str(folder / "assets"))
    return folder
