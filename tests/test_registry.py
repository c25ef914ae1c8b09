"""Plug-ins of installed packages: found, refused, and told apart by where they come from."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from perpetua.cli.app import main
from perpetua.config import Config, load_config
from perpetua.config.plugins import REGISTRIES
from perpetua.errors import ConfigError
from perpetua.pipeline.stages import STAGES
from perpetua.registry import Registry
from tests.support.plug_ins import install

GROUP = "perpetua_tests.things"
CODE = "class Hall: ...\nhall = Hall()\n"


def _registry() -> Registry[Any]:
    """A new one: a registry looks at the installed packages once."""
    return Registry("rooms.source", GROUP, {"file": "pathlib:Path"})


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of installed packages; what was imported from it is forgotten."""
    monkeypatch.syspath_prepend(str(tmp_path))
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        if name in ("perpetua_hall", "perpetua_halls", "perpetua_barn", "perpetua_csv"):
            del sys.modules[name]


@pytest.fixture(autouse=True)
def _registries_look_again(site: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    yield
    monkeypatch.undo()
    _look_again()


def _look_again() -> None:
    for registry in REGISTRIES:
        registry.refresh()


def test_a_package_adds_an_entry_and_is_named_as_its_origin(site: Path) -> None:
    install(site, "perpetua-hall", "0.1", {GROUP: {"hall": "perpetua_hall:Hall"}}, CODE)
    registry = _registry()
    assert list(registry) == ["file", "hall"]
    assert registry["hall"].__module__ == "perpetua_hall"
    assert (registry.origin("hall"), registry.package("hall")) == ("perpetua-hall 0.1", "perpetua-hall 0.1")
    assert (registry.origin("file"), registry.package("file")) == ("perpetua", None)
    assert [plug_in.fault for plug_in in registry.plug_ins()] == [""]
    with pytest.raises(ConfigError, match=r"'hall' \(of perpetua-hall 0\.1\), not 'hal'; did you mean 'hall'\?"):
        registry["hal"]


def test_a_name_that_two_packages_offer_is_refused_and_both_are_named(site: Path) -> None:
    for name in ("perpetua-hall", "perpetua-halls"):
        install(site, name, "0.1", {GROUP: {"hall": f"{name.replace('-', '_')}:Hall"}}, CODE)
    registry = _registry()
    with pytest.raises(ConfigError, match=r"offered by perpetua-halls? 0\.1, perpetua-halls? 0\.1: uninstall all but"):
        registry["hall"]
    listed = registry.plug_ins()
    assert {plug_in.package for plug_in in listed} == {"perpetua-hall 0.1", "perpetua-halls 0.1"}
    assert all("uninstall all but one" in plug_in.fault for plug_in in listed)


def test_a_plug_in_cannot_take_the_name_of_a_built_in_and_that_is_said(site: Path) -> None:
    install(site, "perpetua-hall", "0.1", {GROUP: {"file": "perpetua_hall:Hall"}}, CODE)
    registry = _registry()
    assert registry["file"] is Path and registry.package("file") is None
    [plug_in] = registry.plug_ins()
    assert (plug_in.name, plug_in.package) == ("file", "perpetua-hall 0.1")
    assert "give the entry point another name" in plug_in.fault


@pytest.mark.parametrize(
    ("point", "code", "said"),
    [
        ("perpetua_hall:Hall", "import no_such_module", r"cannot be imported \(ModuleNotFoundError: .*no_such_module"),
        ("perpetua_hall:Hal", CODE, r"cannot be imported \(AttributeError"),
        ("perpetua_hall:hall", CODE, r"must be a class, and 'perpetua_hall:hall' is a Hall"),
    ],
)
def test_a_broken_package_is_named_and_others_work_on(site: Path, point: str, code: str, said: str) -> None:
    install(site, "perpetua-hall", "0.1", {GROUP: {"hall": point}}, code)
    install(site, "perpetua-barn", "2", {GROUP: {"barn": "perpetua_barn:Hall"}}, CODE)
    registry = _registry()
    with pytest.raises(ConfigError, match=rf"rooms\.source 'hall' .*perpetua-hall 0\.1.*{said}"):
        registry["hall"]
    assert registry["barn"].__module__ == "perpetua_barn"
    assert [bool(plug_in.fault) for plug_in in registry.plug_ins()] == [False, True]


def test_what_a_program_enters_is_of_no_package_and_cannot_be_entered_twice(site: Path) -> None:
    install(site, "perpetua-hall", "0.1", {GROUP: {"hall": "perpetua_hall:Hall"}}, CODE)
    registry = _registry()
    registry.register("mine")(Path)
    assert (registry.origin("mine"), registry.package("mine")) == ("this program", None)
    for name, origin in (("mine", "this program"), ("hall", r"perpetua-hall 0\.1"), ("file", "perpetua")):
        with pytest.raises(ValueError, match=f"'{name}' is already registered by {origin}"):
            registry.register(name)(Path)


def test_config_and_doctor_list_plug_ins_with_their_packages(site: Path) -> None:
    install(site, "perpetua-hall", "0.1", {"perpetua.room_sources": {"hall": "perpetua_hall:Hall"}}, CODE)
    install(site, "perpetua-csv", "3", {"perpetua.exporters": {"csv": "perpetua_csv:Csv"}}, "import nothing_here")
    _look_again()
    shown = CliRunner().invoke(main, ["config", "--preset", "tiny"], catch_exceptions=False).output
    [line] = [line for line in shown.splitlines() if "perpetua-hall" in line]
    assert line.startswith("  source: ") and line.endswith("; installed beside perpetua: hall (of perpetua-hall 0.1)")
    page = CliRunner().invoke(main, ["config", "--format", "markdown"], catch_exceptions=False).output
    assert "perpetua-hall" not in page
    told = CliRunner().invoke(main, ["doctor", "--out", str(site)]).output
    assert "perpetua-hall 0.1" in told and "perpetua-csv 3" in told and "nothing_here" in told


def _sections(config: Config) -> dict[str, dict[str, Any]]:
    _look_again()
    return {stage.name: stage.section(config) for stage in STAGES}


def test_another_version_of_a_chosen_plug_in_is_another_key(site: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = {
        "perpetua.room_sources": {"hall": "perpetua_hall:Hall"},
        "perpetua.motion_sources": {"glide": "perpetua_hall:Hall"},
    }
    built_in = load_config("tiny", changes={"rooms.source": "procedural"})
    chosen = load_config("tiny", changes={"rooms.source": "hall", "actors.motion.source": "glide"})
    without = _sections(built_in)
    install(site / "one", "perpetua-hall", "0.1", points, CODE)
    install(site / "two", "perpetua-hall", "0.2", points, CODE)
    monkeypatch.syspath_prepend(str(site / "one"))
    first = _sections(chosen)
    assert _sections(built_in) == without, "packages that are not chosen do not count"
    monkeypatch.syspath_prepend(str(site / "two"))
    second = _sections(chosen)
    assert [name for name in first if first[name] != second[name]] == ["room", "motion", "actors"]
