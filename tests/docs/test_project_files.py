"""Files around the code agree with each other: Makefile, CI, citation, changelog, hooks."""

import re
import shlex
import tomllib
from datetime import date
from typing import Any

import pytest
import yaml

from tests.support.paths import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
# A variable set before a command, and what follows a make target on its line.
_TARGET = re.compile(r"^(\w+):(?!=).*\n((?:\t.*\n)+)", re.MULTILINE)


def _text(path: str) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


def _yaml(path: str) -> Any:
    return yaml.safe_load(_text(path))


def _recipes() -> dict[str, list[str]]:
    return {name: recipe.strip().split("\n\t") for name, recipe in _TARGET.findall(_text("Makefile"))}


@pytest.mark.parametrize("target", ["setup", "lint", "types", "docs", "test"])
def test_what_make_runs_ci_runs(target: str) -> None:
    missing = [command for command in _recipes()[target] if command not in _text(".ci/run")]
    assert missing == []


def test_fast_tests_leave_out_every_mark() -> None:
    marks = {mark.partition(":")[0] for mark in PROJECT["tool"]["pytest"]["ini_options"]["markers"]}
    (command,) = _recipes()["fast"]
    words = shlex.split(command)
    assert words[words.index("-m", words.index("pytest")) + 1] == " and ".join(f"not {mark}" for mark in sorted(marks))


def test_contributing_names_every_make_target() -> None:
    assert set(re.findall(r"`make (\w+)`", _text("CONTRIBUTING.md"))) == set(_recipes())


def test_hosted_ci_runs_what_everybody_runs() -> None:
    (job,) = _yaml(".github/workflows/ci.yml")["jobs"].values()
    assert job["steps"][-1] == {"run": ".ci/run"}


def test_citation_and_changelog_have_the_version() -> None:
    citation = _yaml("CITATION.cff")
    assert citation["version"] == PROJECT["project"]["version"]
    released = re.findall(r"^## (\d+\.\d+\.\d+) - (\S+)$", _text("CHANGELOG.md"), re.MULTILINE)
    assert released[0] == (citation["version"], citation["date-released"].isoformat())
    assert [date.fromisoformat(day) for _, day in released] == sorted(
        (date.fromisoformat(day) for _, day in released), reverse=True
    )


def test_citation_has_what_its_schema_demands() -> None:
    citation = _yaml("CITATION.cff")
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert citation["license"] == PROJECT["project"]["license"]


def test_hooks_run_what_lint_and_types_run() -> None:
    entries = [hook["entry"] for repo in _yaml(".pre-commit-config.yaml")["repos"] for hook in repo["hooks"]]
    checked = [command.removesuffix(" .") for target in ("lint", "types") for command in _recipes()[target]]
    assert [command for command in checked if not any(entry.startswith(command) for entry in entries)] == []


@pytest.mark.parametrize("form", ["bug", "idea"])
def test_issue_forms_ask(form: str) -> None:
    page = _yaml(f".github/ISSUE_TEMPLATE/{form}.yml")
    assert page["name"] and page["description"]
    assert any(part["validations"]["required"] for part in page["body"])
