"""Config files and settings that are wrong or meant to hurt: refused by key, value and rule, before anything begins."""

import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from perpetua.config import Config, load_config
from perpetua.errors import ConfigError
from tests.support.robustness import BadInput

MOST_SECONDS = 20.0

BAD_SETTINGS = (
    ("sequence.frames=1", "must be greater than or equal to 2, not 1"),
    ("sequence.frames=1e300", "must be a whole number"),
    ("sequence.frames=99999999999999999999999", "must be less than or equal to 100000"),
    ("sequence.frames=2.5", "must be a whole number"),
    ("sequence.frames=null", "must be a whole number"),
    ("sequence.frames=[24]", "must be a whole number"),
    ("sequence.fps=.inf", "must be a finite number"),
    ("sequence.fps=-.inf", "must be a finite number"),
    ("sequence.fps=0", "must be greater than 0"),
    ("render.width_px=100000", "must be less than or equal to 4096"),
    ("render.samples=true; rm -rf .", "must be a whole number"),
    ("rooms={}{}", "not valid YAML"),
    ("rooms=7", "config key 'rooms' is a section, not 7"),
    ("rooms.kinds=[]", "at least 1"),
    ("rooms.min_side_m=9", "min_side_m must not exceed max_side_m"),
    ("cameras.__class__=1", "unknown config key 'cameras.__class__'"),
    ("work.keep=some", "must be 'all', 'tracks' or 'none'"),
    ("export.splits={}", "export.splits"),
    ("export.splits.train=-1", "export.splits"),
    ("sequence.fps=!!python/object/apply:os.getcwd []", "not valid YAML"),
    ("=5", "--set takes KEY=VALUE"),
)


@pytest.mark.parametrize(("assignment", "says"), BAD_SETTINGS)
def test_bad_setting_is_refused(assignment: str, says: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_config("tiny", assignments=[assignment])
    assert says in str(caught.value)
    assert caught.value.exit_code == 2


def _write(content: bytes) -> Callable[[Path], None]:
    def spoil(path: Path) -> None:
        path.write_bytes(content)

    return spoil


# Ten aliases of ten aliases of ...: a few hundred bytes that say 10^12 objects.
_ALIASES = "\n".join(f"x{k}: &x{k} [{', '.join([f'*x{k - 1}'] * 10) if k else 'lol'}]" for k in range(12))


def _mapping_aliases(path: Path) -> None:
    lines = [f"x{k}: &x{k} {{a: {f'*x{k - 1}' if k else 1}, b: {f'*x{k - 1}' if k else 2}}}" for k in range(40)]
    path.write_text("\n".join([*lines, "sequence: {frames: *x39}"]))


BAD_FILES = (
    BadInput("not there", lambda path: None, "No such file"),
    BadInput("a folder", lambda path: path.mkdir(), "no regular file"),
    BadInput("a pipe, which would block for ever", lambda path: os.mkfifo(path), "no regular file"),
    BadInput("a device without end", lambda path: path.symlink_to("/dev/zero"), "no regular file"),
    BadInput("two megabytes", _write(b"#" * 2_000_000), "at most 1048576 are read"),
    BadInput("a picture", _write(b"\x89PNG\r\n\x1a\n" + bytes(range(256))), "cannot read config"),
    BadInput("zero bytes inside", _write(b"sequence: {frames: 4\x00}"), "not valid YAML"),
    BadInput("a list", _write(b"- sequence\n"), "must be a mapping"),
    BadInput("a tag that calls a function", _write(b"!!python/object/apply:os.system ['true']"), "not valid YAML"),
    BadInput("an alias of itself", _write(b"sequence: &a {frames: *a}"), "'sequence.frames' must be a whole number"),
    BadInput(
        "aliases for 10^12 values", _write(f"{_ALIASES}\nsequence: {{frames: *x11}}".encode()), "unknown config key"
    ),
    BadInput("nested mappings for 2^40 values", _mapping_aliases, "unknown config key"),
    BadInput("nested 500 deep", _write(b"[" * 500 + b"]" * 500), "nested too deeply"),
    BadInput("a key that is a number", _write(b"sequence: {1: 2}"), "config key 'sequence.1"),
    BadInput("a date where a number belongs", _write(b"sequence: {fps: 2024-02-31}"), "not valid YAML"),
)


@pytest.mark.parametrize("case", BAD_FILES, ids=str)
def test_bad_config_file_is_refused(tmp_path: Path, case: BadInput) -> None:
    path = tmp_path / "config.yaml"
    case.spoil(path)
    started = time.process_time()
    with pytest.raises(ConfigError) as caught:
        load_config("tiny", path)
    assert case.says in str(caught.value)
    assert len(str(caught.value)) < 50_000
    assert time.process_time() - started < MOST_SECONDS


_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)
_keys = st.sampled_from(
    [*Config.model_fields, "sequence.frames", "rooms.kinds", "export.splits", "actors.routes.paces"]
)


@settings(max_examples=100, deadline=None)
@given(key=_keys, value=_values)
def test_any_value_is_a_config_or_an_error(key: str, value: object) -> None:
    try:
        config = load_config("tiny", assignments=[f"{key}={yaml.safe_dump(value, default_flow_style=True)}"])
    except ConfigError as error:
        assert str(error)
    else:
        assert Config.model_validate(config.model_dump(mode="json")) == config
