"""What the keys of stages depend on: every setting that decides what comes out, and no other."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, get_args

import pytest
from pydantic.fields import FieldInfo

from perpetua.config import Config, load_config
from perpetua.errors import ConfigError
from perpetua.io.section import Section
from perpetua.pipeline.runner import stage_keys
from perpetua.pipeline.stages import STAGES
from perpetua.routes import casting


def _leaves(section: type[Section], prefix: str = "") -> Iterator[tuple[str, FieldInfo]]:
    for name, field in section.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, Section):
            yield from _leaves(field.annotation, f"{prefix}{name}.")
        else:
            yield prefix + name, field


def _others(value: Any, field: FieldInfo) -> Iterator[Any]:
    """Values that may be allowed where ``value`` is the default."""
    if isinstance(value, bool):
        yield not value
    elif isinstance(value, int | float):
        yield from (value + 1, value - 1, value * 1.01, value * 0.99, value / 2, 1, 0.5)
    elif isinstance(value, tuple | list):
        yield from (list(value[:1]), list(value[1:]), ["waves the right hand"], ["normals"])
    elif isinstance(value, dict):
        yield {"train": 0.5, "val": 0.5}
    elif value is None:
        yield 0.5
    for choice in get_args(field.annotation):
        yield choice
        yield from get_args(choice)
    yield from ("clips", "smplx", "infinigen", "other")


# What decides how the work is done, or what is kept of it, and not what comes out.
IN_NO_KEY = {"work.keep", "render.threads", "render.frame_timeout_s", "render.max_restarts", "render.blender"}


@pytest.mark.parametrize(("key", "field"), [pytest.param(key, field, id=key) for key, field in _leaves(Config)])
def test_every_setting_is_in_some_key(
    key: str, field: FieldInfo, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each leaf of the schema, set to another value that it allows, changes the key of the finished sequence."""
    for name in ("everyday", "other"):
        (tmp_path / f"{name}.yaml").write_text(f"- walks\n- looks at {name} objects\n")
    monkeypatch.setattr(casting, "ACTION_FOLDER", tmp_path)
    base = load_config(assignments=("rooms.source=procedural",))
    before = base.model_dump()
    for part in key.split("."):
        before = before[part]
    for value in _others(before, field):
        if key == "actors.motion.actions" and value != "other":
            continue
        # A name may be well formed and stand for nothing.
        with suppress(ConfigError):
            changed = load_config(assignments=("rooms.source=procedural",), changes={key: value})
            keys = stage_keys(changed, 0, 0)
            if changed != base:
                break
    else:
        pytest.fail(f"no other value was found for {key} = {before!r}")
    same = keys == stage_keys(base, 0, 0)
    assert same == (key in IN_NO_KEY), f"{key} = {value!r}"


def test_every_setting_that_a_sequence_depends_on_is_in_some_key() -> None:
    base = stage_keys(Config(), 0, 0)
    assert stage_keys(Config(), 1, 0)["room"] != base["room"]
    assert stage_keys(Config(), 0, 1)["room"] != base["room"]
    longer = stage_keys(Config.model_validate({"sequence": {"frames": 9}}), 0, 0)
    changed = {name for name in base if base[name] != longer[name]}
    assert changed == {stage.name for stage in STAGES} - {"room", "navigation"}
