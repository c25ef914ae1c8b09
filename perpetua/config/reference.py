"""All settings with their meanings, for people: as YAML that can be read again, and as Markdown tables."""

import inspect
from collections.abc import Iterator, Mapping
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

import yaml
from pydantic.fields import FieldInfo

from perpetua.config import PRESETS, Config, load_config
from perpetua.io.section import Section

_INTRODUCTION = (
    "A setting is changed by `--set KEY=VALUE`, or in a YAML file given to `--config`. This page is what",
    "`perpetua config --format markdown` prints; without `--format` it prints YAML that `--config` reads again.",
)
_TABLE_HEAD = ("| setting | default | allowed | meaning |", "|---|---|---|---|")
_SIGNS = {"Ge": "≥", "Gt": ">", "Le": "≤", "Lt": "<"}


def annotated_yaml(config: Config, notes: Mapping[str, str] | None = None) -> str:
    """Every setting as YAML, each with its meaning and range as a comment.

    Args:
        config: the values.
        notes: what is added to the comments of settings, by their names ``a.b``.
    """
    return "\n".join(_annotated_lines(config, "", notes or {}))


def _annotated_lines(section: Section, title: str, notes: Mapping[str, str]) -> list[str]:
    lines: list[str] = []
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        path = f"{title}.{name}" if title else name
        indent = "  " * path.count(".")
        if isinstance(value, Section):
            lines += [f"{indent}{name}:", *_annotated_lines(value, path, notes)]
        else:
            limits = allowed(field)
            comment = f"{field.description}" + (f" [{limits}]" if limits else "")
            comment += f"; {notes[path]}" if path in notes else ""
            lines.append(f"{indent}{name}: {_written(section, name)}  # {comment}")
    return lines


def markdown_page(config: Config) -> str:
    """Every setting as tables, one for each section, after a table of what the presets change."""
    lines = ["# Settings", "", *_INTRODUCTION, "", "## Presets", "", *_preset_table()]
    for title, section in _sections(config, ""):
        names = [name for name in type(section).model_fields if not isinstance(getattr(section, name), Section)]
        if names:
            about = inspect.cleandoc(type(section).__doc__ or "").split("\n")[0]
            lines += ["", f"## {title}", "", about, "", *_TABLE_HEAD]
        for name in names:
            field = type(section).model_fields[name]
            cells = (f"`{title}.{name}`", f"`{_written(section, name)}`", allowed(field), field.description or "")
            lines.append(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |")
    return "\n".join(lines)


def allowed(field: FieldInfo) -> str:
    """What a setting may be: names to choose from, or bounds; empty where its meaning says all."""
    names = [str(name) for kind in _kinds(field.annotation) if get_origin(kind) is Literal for name in get_args(kind)]
    return ", ".join(names) if names else ", ".join(_limit(rule) for rule in field.metadata)


def _kinds(annotation: Any) -> Iterator[Any]:
    """A type and what unions and tuples of it hold."""
    if get_origin(annotation) in (Union, UnionType, tuple):
        for inner in get_args(annotation):
            yield from _kinds(inner)
    else:
        yield annotation


def _limit(rule: object) -> str:
    """One bound of a field as people write it."""
    name = type(rule).__name__
    if name == "MinLen":
        return f"at least {getattr(rule, 'min_length')} of them"  # noqa: B009
    bound = getattr(rule, name.lower())
    return f"{_SIGNS[name]} {bound if isinstance(bound, int) else format(bound, 'g')}"


def _sections(section: Section, title: str) -> Iterator[tuple[str, Section]]:
    if title:
        yield title, section
    for name in type(section).model_fields:
        inner = getattr(section, name)
        if isinstance(inner, Section):
            yield from _sections(inner, f"{title}.{name}" if title else name)


def _written(section: Section, name: str) -> str:
    """A value in YAML, on one line."""
    value = section.model_dump(mode="json")[name]
    return yaml.safe_dump(value, default_flow_style=True, width=10_000).split("\n")[0]


def _preset_table() -> Iterator[str]:
    """The settings in which presets differ, one row each."""
    configs = [dict(_flat(load_config(name), "")) for name in PRESETS]
    yield f"| setting | {' | '.join(f'`{name}`' for name in PRESETS)} |"
    yield "|---" * (len(PRESETS) + 1) + "|"
    for key in configs[0]:
        values = [values[key] for values in configs]
        if len(set(values)) > 1:
            yield f"| `{key}` | {' | '.join(values)} |"


def _flat(config: Config, title: str) -> Iterator[tuple[str, str]]:
    for path, section in _sections(config, title):
        for name in type(section).model_fields:
            if not isinstance(getattr(section, name), Section):
                yield f"{path}.{name}", _written(section, name)
