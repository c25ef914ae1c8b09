"""Reads a config: the schema's defaults, then a preset, then a YAML file, then ``--set a.b=c``."""

import difflib
import reprlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from perpetua.config.schema import Config, field_table
from perpetua.errors import ConfigError
from perpetua.resources import PRESET_FOLDER

# Thousands of times as much as all settings take.
MOST_CONFIG_BYTES = 1 << 20
# Aliases in YAML can stand for more text than fits in memory.
_brief = reprlib.Repr()
_brief.maxlevel, _brief.maxstring, _brief.maxother = 2, 120, 120

# From the smallest to the largest.
PRESETS = ("tiny", "quick", "standard", "benchmark")


def presets() -> dict[str, Path]:
    """The presets that come with Perpetua: name -> YAML file."""
    return {name: PRESET_FOLDER / f"{name}.yaml" for name in PRESETS}


def load_config(
    preset: str | None = None,
    path: Path | None = None,
    assignments: Sequence[str] = (),
    changes: Mapping[str, Any] | None = None,
) -> Config:
    """The schema's defaults, then a preset, then a file, then changes.

    Args:
        preset: name of a preset.
        path: a YAML file with any part of the schema.
        assignments: changes as text, ``a.b=value``, the value in YAML.
        changes: changes as values, ``{"a.b": value}``.

    Raises:
        ConfigError: an unknown preset, an unreadable file, an unknown key, or a value out of range.
    """
    settings: dict[str, Any] = {}
    if preset is not None:
        known = presets()
        if preset not in known:
            raise ConfigError(f"the preset must be one of {', '.join(known)}, not '{preset}'{_nearest(preset, known)}")
        _merge(settings, _read_yaml(known[preset]))
    if path is not None:
        _merge(settings, _read_yaml(path))
    for assignment in assignments:
        _merge(settings, _parse_assignment(assignment))
    for key, value in (changes or {}).items():
        _merge(settings, _nested(key, value))
    try:
        return Config.model_validate(settings)
    except ValidationError as error:
        raise ConfigError("\n".join(_explain(dict(line)) for line in error.errors())) from None


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        if path.exists() and not path.is_file():
            raise ConfigError(f"config '{path}' must be a file of YAML, and is no regular file")
        if path.stat().st_size > MOST_CONFIG_BYTES:
            raise ConfigError(f"config '{path}' has {path.stat().st_size} bytes; at most {MOST_CONFIG_BYTES} are read")
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"cannot read config '{path}': {error.strerror}") from None
    except UnicodeDecodeError:
        raise ConfigError(f"cannot read config '{path}': it is not a text file in UTF-8") from None
    except RecursionError:
        raise ConfigError(f"config '{path}' is nested too deeply") from None
    except (yaml.YAMLError, ValueError) as error:
        raise ConfigError(f"config '{path}' is not valid YAML: {_yaml_problem(error)}") from None
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise ConfigError(f"config '{path}' must be a mapping of keys to values, not {type(content).__name__}")
    return content


def _yaml_problem(error: Exception) -> str:
    """Line and problem in one sentence."""
    if not isinstance(error, yaml.MarkedYAMLError) or error.problem_mark is None:
        return str(error)
    problem = str(error.problem)
    if "'\\t'" in problem:
        problem = "a tab stands where only spaces may: indent with spaces"
    return f"line {error.problem_mark.line + 1}: {problem}"


def _parse_assignment(assignment: str) -> dict[str, Any]:
    key, sign, text = assignment.partition("=")
    if not sign or not key.strip():
        raise ConfigError(f"--set takes KEY=VALUE such as sequence.frames=24, not '{assignment}'")
    try:
        value: Any = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"--set {key}: '{text}' is not valid YAML: {_yaml_problem(error)}") from None
    return _nested(key, value)


def _nested(key: str, value: Any) -> dict[str, Any]:
    for part in reversed(key.strip().split(".")):
        value = {part: value}
    return dict(value)


def _merge(settings: dict[Any, Any], changes: Mapping[Any, Any]) -> None:
    for key, value in changes.items():
        if isinstance(value, Mapping) and isinstance(settings.get(key), dict):
            _merge(settings[key], value)
        else:
            settings[key] = value


def _nearest(name: str, known: Iterable[str]) -> str:
    """A hint at what was meant; a key's last word alone counts as much as all of it."""
    ends = {key.rpartition(".")[2]: key for key in reversed(list(known))}
    lowered = {key.lower(): key for key in ends.values()} | {key.lower(): key for key in known}
    last = name.rpartition(".")[2].lower()
    near = [ends[last]] if last in ends else []
    near += [lowered[key] for key in difflib.get_close_matches(name.lower(), lowered, n=1)]
    near += [ends[end] for end in difflib.get_close_matches(last, ends, n=1)]
    return f"; did you mean '{near[0]}'?" if near else ""


# What pydantic says of a wrong type, in plain words.
_PLAIN_RULES = {
    "int_parsing": "must be a whole number",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "float_parsing": "must be a number",
    "float_type": "must be a number",
    "bool_parsing": "must be true or false",
    "bool_type": "must be true or false",
    "string_type": "must be text",
    "tuple_type": "must be a list such as [a, b]",
    "dict_type": "must be a mapping such as {a: 1}",
    "invalid_key": "must be the name of a setting",
}


def _explain(error: Mapping[str, Any]) -> str:
    location = [str(part) for part in error["loc"]]
    key = ".".join(location)
    table = field_table()
    if error["type"] == "extra_forbidden":
        sections = {name.rpartition(".")[0]: "" for name in table}
        return f"unknown config key '{key}'{_nearest(key, table | sections) or '; `perpetua config` lists all'}"
    if error["type"] in ("model_type", "model_attributes_type"):
        first = next(name for name in table if name.startswith(f"{key}."))
        return f"config key '{key}' is a section, not {_brief.repr(error['input'])}: set what is in it, such as {first}"
    rule = str(error["msg"]).removeprefix("Value error, ").replace("Input should be", "must be")
    rule = _PLAIN_RULES.get(error["type"], rule)
    documented = ".".join(part for part in location if not part.isdigit())
    meaning = table.get(documented, "")
    return f"config key '{key}' {rule}, not {_brief.repr(error['input'])}" + (f" ({meaning})" if meaning else "")
