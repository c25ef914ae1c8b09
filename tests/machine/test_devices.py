"""Which device each worker renders on, with stand-ins for Cycles' list of devices."""

import importlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import click
import pytest

from perpetua.cli.options import WorkerCount
from perpetua.machine import devices


@dataclass
class Device:
    name: str
    type: str
    use: bool = True


@dataclass
class Preferences:
    """Like Cycles': knows some backends, and lists CPUs beside the GPUs of the chosen one."""

    known: dict[str, list[str]]
    devices: list[Device] = field(default_factory=list)
    backend: str = ""

    @property
    def compute_device_type(self) -> str:
        return self.backend

    @compute_device_type.setter
    def compute_device_type(self, backend: str) -> None:
        if backend not in self.known:
            raise TypeError(f'enum "{backend}" not found')
        self.backend = backend

    def refresh_devices(self) -> None:
        self.devices = [Device(name, self.backend) for name in self.known[self.backend]]
        self.devices.append(Device("a CPU", "CPU"))


@pytest.fixture(scope="module")
def choice() -> ModuleType:
    """The module of Blender's scripts; it needs the standard library alone."""
    return importlib.import_module("blender_scripts.render.gpu_choice")


def _used(preferences: Preferences) -> list[str]:
    return [device.name for device in preferences.devices if device.use]


@pytest.mark.parametrize(
    ("known", "wanted", "expected"),
    [
        ({"CUDA": ["A"], "OPTIX": ["A"]}, "auto", ("optix", ["A"])),
        ({"CUDA": ["A"], "OPTIX": []}, "auto", ("cuda", ["A"])),
        ({"CUDA": [], "OPTIX": [], "HIP": ["B"], "ONEAPI": ["C"]}, "auto", ("hip", ["B"])),
        ({"CUDA": [], "ONEAPI": ["C"]}, "auto", ("oneapi", ["C"])),
        ({"METAL": ["M"]}, "auto", ("metal", ["M"])),
        ({"CUDA": ["A"], "OPTIX": ["A"]}, "cuda", ("cuda", ["A"])),
        ({"CUDA": ["A", "B"], "OPTIX": ["A", "B"]}, "auto", ("optix", ["A", "B"])),
        ({"CUDA": ["A"]}, "hip", None),
        ({"CUDA": [], "OPTIX": []}, "auto", None),
        ({}, "auto", None),
    ],
)
def test_the_first_backend_with_a_device_is_taken(
    choice: ModuleType, known: dict[str, list[str]], wanted: str, expected: tuple[str, list[str]] | None
) -> None:
    preferences = Preferences(known)
    assert choice.enable_gpus(preferences, wanted, 0, 1) == expected
    if expected is not None:
        assert _used(preferences) == expected[1]


@pytest.mark.parametrize(
    ("gpus", "workers", "expected"),
    [
        (4, 4, [["0"], ["1"], ["2"], ["3"]]),
        (4, 2, [["0", "2"], ["1", "3"]]),
        (3, 2, [["0", "2"], ["1"]]),
        (2, 4, [["0"], ["1"], ["0"], ["1"]]),
        (1, 3, [["0"], ["0"], ["0"]]),
    ],
)
def test_workers_share_the_gpus(choice: ModuleType, gpus: int, workers: int, expected: list[list[str]]) -> None:
    for worker, names in enumerate(expected):
        preferences = Preferences({"OPTIX": [str(number) for number in range(gpus)]})
        assert choice.enable_gpus(preferences, "auto", worker, workers) == ("optix", names)
        assert _used(preferences) == names


@pytest.fixture
def no_fraction(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv(devices.SHARE_VARIABLE, "")
    yield


def test_a_process_has_the_machine_to_itself_until_told_otherwise(no_fraction: None) -> None:
    assert devices.machine_share() == devices.MachineShare(0, 1)
    devices.share_machine(2, 4)
    assert devices.machine_share() == devices.MachineShare(2, 4)


@pytest.mark.parametrize("text", ["4/4", "-1/2", "0/0", "half", "1"])
def test_a_share_that_makes_no_sense_is_the_whole(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setenv(devices.SHARE_VARIABLE, text)
    assert devices.machine_share() == devices.MachineShare(0, 1)


def test_threads_are_shared_among_workers_unless_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(devices, "usable_cores", lambda: 8)
    assert devices.cpu_threads(0, devices.MachineShare(0, 1)) == 8
    assert devices.cpu_threads(0, devices.MachineShare(1, 3)) == 2
    assert devices.cpu_threads(0, devices.MachineShare(5, 20)) == 1
    assert devices.cpu_threads(3, devices.MachineShare(5, 20)) == 3


@pytest.mark.parametrize(
    ("rooms", "device", "gpus", "cores", "free_mb", "expected"),
    [
        (100, "cpu", 4, 16, 1e6, 4),
        (100, "auto", 3, 16, 1e6, 3),
        (100, "auto", 0, 18, 1e6, 4),
        (100, "hip", 3, 16, 1e6, 4),
        (3, "auto", 0, 16, 1e6, 3),
        (100, "cpu", 0, 16, 7000.0, 3),
        (100, "cpu", 0, 1, 500.0, 1),
    ],
)
def test_workers_follow_gpus_cores_and_memory(
    monkeypatch: pytest.MonkeyPatch, rooms: int, device: str, gpus: int, cores: int, free_mb: float, expected: int
) -> None:
    monkeypatch.setattr(devices, "nvidia_gpus", lambda: gpus)
    monkeypatch.setattr(devices, "usable_cores", lambda: cores)
    assert devices.auto_workers(rooms, device, free_mb, 2000.0) == expected


@pytest.mark.parametrize(
    ("script", "expected"), [("echo 'GPU 0: A'; echo 'GPU 1: B'", 2), ("echo no devices; exit 9", 0)]
)
def test_gpus_are_counted_as_the_driver_lists_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, expected: int
) -> None:
    program = tmp_path / "nvidia-smi"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    assert devices.nvidia_gpus() == expected
    monkeypatch.setenv("PATH", "")
    assert devices.nvidia_gpus() == 0


@pytest.mark.parametrize(("text", "expected"), [("1", 1), ("12", 12), ("auto", 0)])
def test_workers_are_a_number_or_auto(text: str, expected: int) -> None:
    assert WorkerCount().convert(text, None, None) == expected


@pytest.mark.parametrize("text", ["0", "-1", "two", "1.5"])
def test_other_workers_are_refused(text: str) -> None:
    with pytest.raises(click.BadParameter, match="number from 1, or auto"):
        WorkerCount().convert(text, None, None)
