"""The one schema: each stage's section joined; read from YAML, then changed by ``--set a.b=c``."""

import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml
from pydantic import Field, ValidationError

from perpetua.actors.config import ActorsConfig
from perpetua.audit.config import AuditConfig
from perpetua.cameras.config import CamerasConfig
from perpetua.config_base import Section
from perpetua.errors import ConfigError
from perpetua.formats.config import ExportConfig
from perpetua.navigation.config import NavigationConfig
from perpetua.pipeline.config import RedrawConfig
from perpetua.rendering.config import RenderConfig
from perpetua.rooms.config import RoomsConfig
from perpetua.tracks.config import TracksConfig

PRESET_FOLDER = Path(__file__).parent.parent / "configs"


class SequenceConfig(Section):
    """Length and rate of a sequence."""

    frames: int = Field(120, ge=2, le=100_000, description="frames of a sequence")
    fps: float = Field(24.0, gt=0.0, le=1000.0, description="frames per second")


class Config(Section):
    """All settings of a run."""

    sequence: SequenceConfig = Field(default_factory=SequenceConfig)
    rooms: RoomsConfig = Field(default_factory=RoomsConfig)
    navigation: NavigationConfig = Field(default_factory=NavigationConfig)
    actors: ActorsConfig = Field(default_factory=ActorsConfig)
    cameras: CamerasConfig = Field(default_factory=CamerasConfig)
    render: RenderConfig = Field(default_factory=RenderConfig)
    tracks: TracksConfig = Field(default_factory=TracksConfig)
    export: ExportConfig = Field(default_factory=ExportConfig)
    audit: AuditConfig = Field(default_factory=AuditConfig)
    redraw: RedrawConfig = Field(default_factory=RedrawConfig)


def presets() -> dict[str, Path]:
    """The presets that come with Perpetua: name -> YAML file."""
    return {path.stem: path for path in sorted(PRESET_FOLDER.glob("*.yaml"))}


def load_config(preset: str | None = None, path: Path | None = None, assignments: Sequence[str] = ()) -> Config:
    """The schema's defaults, then a preset, then a file, then assignments ``a.b=value`` (value in YAML).

    Raises:
        ConfigError: an unknown preset, an unreadable file, an unknown key, or a value out of range.
    """
    settings: dict[str, Any] = {}
    if preset is not None:
        known = presets()
        if preset not in known:
            raise ConfigError(f"--preset must be one of {sorted(known)}, not '{preset}'{_nearest(preset, known)}")
        _merge(settings, _read_yaml(known[preset]))
    if path is not None:
        _merge(settings, _read_yaml(path))
    for assignment in assignments:
        _merge(settings, _parse_assignment(assignment))
    try:
        return Config.model_validate(settings)
    except ValidationError as error:
        raise ConfigError("\n".join(_explain(dict(line)) for line in error.errors())) from None


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot read config '{path}': {error}") from None
    except yaml.YAMLError as error:
        raise ConfigError(f"config '{path}' is not valid YAML: {error}") from None
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise ConfigError(f"config '{path}' must be a mapping of keys to values, not {type(content).__name__}")
    return content


def _parse_assignment(assignment: str) -> dict[str, Any]:
    key, sign, text = assignment.partition("=")
    if not sign or not key.strip():
        raise ConfigError(f"--set takes KEY=VALUE such as sequence.frames=24, not '{assignment}'")
    try:
        value: Any = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise ConfigError(f"--set {key}: '{text}' is not valid YAML: {error}") from None
    for part in reversed(key.strip().split(".")):
        value = {part: value}
    return dict(value)


def _merge(settings: dict[str, Any], changes: Mapping[str, Any]) -> None:
    for key, value in changes.items():
        if isinstance(value, Mapping) and isinstance(settings.get(key), dict):
            _merge(settings[key], value)
        else:
            settings[key] = value


def field_table(section: type[Section] = Config, prefix: str = "") -> dict[str, str]:
    """Every key of the schema with its description: ``{"sequence.frames": "frames of a sequence"}``."""
    table: dict[str, str] = {}
    for name, field in section.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, Section):
            table |= field_table(inner, f"{prefix}{name}.")
        else:
            table[prefix + name] = field.description or ""
    return table


def annotated_yaml(config: Config) -> str:
    """Every setting as YAML, each with its meaning and range as a comment."""
    return "\n".join(_annotated_lines(config, ""))


def _annotated_lines(section: Section, indent: str) -> list[str]:
    lines: list[str] = []
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        if isinstance(value, Section):
            lines += [f"{indent}{name}:", *_annotated_lines(value, indent + "  ")]
        else:
            limits = ", ".join(_limit(rule) for rule in field.metadata)
            text = yaml.safe_dump(section.model_dump(mode="json")[name], default_flow_style=True).split("\n")[0]
            lines.append(f"{indent}{name}: {text}  # {field.description}" + (f" [{limits}]" if limits else ""))
    return lines


def _limit(rule: object) -> str:
    """One bound of a field as people write it."""
    signs = {"Ge": ">=", "Gt": ">", "Le": "<=", "Lt": "<"}
    name = type(rule).__name__
    if name in signs:
        return f"{signs[name]} {getattr(rule, name.lower())}"
    return str(rule)


def _nearest(name: str, known: Mapping[str, Any]) -> str:
    near = difflib.get_close_matches(name, list(known), n=1)
    return f"; did you mean '{near[0]}'?" if near else ""


def _explain(error: Mapping[str, Any]) -> str:
    location = [str(part) for part in error["loc"]]
    key = ".".join(location)
    if error["type"] == "extra_forbidden":
        table = field_table()
        sections = {name.rpartition(".")[0]: "" for name in table}
        return f"unknown config key '{key}'{_nearest(key, table | sections)}"
    rule = str(error["msg"]).removeprefix("Value error, ").replace("Input should be", "must be")
    documented = ".".join(part for part in location if not part.isdigit())
    meaning = field_table().get(documented, "")
    return f"config key '{key}' {rule}, not {error['input']!r}" + (f" ({meaning})" if meaning else "")
