from pathlib import Path

import pytest
import yaml

from perpetua.config import Config, field_table, load_config, presets
from perpetua.config.reference import annotated_yaml
from perpetua.errors import ConfigError


def test_every_setting_documents_its_meaning() -> None:
    undocumented = [key for key, meaning in field_table().items() if len(meaning) < 5]
    assert undocumented == []


def test_every_number_has_a_range() -> None:
    def numbers_without_bounds(section: type, prefix: str) -> list[str]:
        found = []
        for name, field in section.model_fields.items():  # type: ignore[attr-defined]
            if isinstance(field.annotation, type) and hasattr(field.annotation, "model_fields"):
                found += numbers_without_bounds(field.annotation, f"{prefix}{name}.")
            elif field.annotation in (int, float) and not field.metadata:
                found.append(prefix + name)
        return found

    assert numbers_without_bounds(Config, "") == []


@pytest.mark.parametrize("preset", ["tiny", "quick", "standard", "benchmark"])
def test_preset_loads(preset: str) -> None:
    assert preset in presets()
    assert load_config(preset).actors.count == 4


def test_benchmark_preset_has_the_reference_scale() -> None:
    config = load_config("benchmark")
    assert config.sequence.frames == 240
    assert max(config.render.width_px, config.render.height_px) == 512
    assert config.tracks.count == 1024


@pytest.mark.parametrize(
    ("assignment", "expected"),
    [
        ("render.sampels=4", "unknown config key 'render.sampels'; did you mean 'render.samples'?"),
        ("rendr.samples=4", "unknown config key 'rendr'; did you mean 'render'?"),
        ("render.samples=0", "'render.samples' must be greater than or equal to 1, not 0"),
        ("frames=4", "unknown config key 'frames'; did you mean 'sequence.frames'?"),
        ("render.Sampels=4", "did you mean 'render.samples'?"),
        ("weather=rain", "unknown config key 'weather'; `perpetua config` lists all"),
        ("sequence=3", "'sequence' is a section, not 3: set what is in it, such as sequence.frames"),
        ("sequence.frames=abc", "'sequence.frames' must be a whole number, not 'abc'"),
        ("sequence.frames=2.5", "'sequence.frames' must be a whole number, not 2.5"),
        ("render.denoise=perhaps", "'render.denoise' must be true or false, not 'perhaps'"),
        ("sequence.fps=.nan", "'sequence.fps' must be a finite number"),
        ("rooms.kinds=[garage]", "'rooms.kinds.0' must be 'bathroom', 'bedroom'"),
        ("export.splits.val=0.5", "config key 'export.splits' must have shares that sum to 1"),
        ("frames", "--set takes KEY=VALUE"),
        ("a=[", "not valid YAML"),
    ],
)
def test_bad_setting_names_key_value_and_range(assignment: str, expected: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_config("tiny", assignments=[assignment])
    assert expected in str(caught.value)
    assert caught.value.exit_code == 2


def test_file_overrides_preset_and_assignment_overrides_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("sequence: {frames: 9, fps: 5}\n")
    config = load_config("tiny", path, ["sequence.fps=7"])
    assert (config.sequence.frames, config.sequence.fps) == (9, 7.0)
    assert config.render.width_px == load_config("tiny").render.width_px


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        ("sequence:\n\tframes: 4\n", "line 2: a tab stands where only spaces may: indent with spaces"),
        ("a: [\n", "line 2: "),
        ("- 1\n", "must be a mapping of keys to values, not list"),
    ],
)
def test_bad_config_file_says_where(tmp_path: Path, content: str, expected: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(content)
    with pytest.raises(ConfigError) as caught:
        load_config(path=path)
    assert expected in str(caught.value)


def test_changes_by_value_come_last() -> None:
    config = load_config(
        "tiny", assignments=["actors.count=2"], changes={"actors.count": 3, "rooms.kinds": ["kitchen"]}
    )
    assert config.actors.count == 3
    assert config.rooms.kinds == ("kitchen",)
    with pytest.raises(ConfigError, match=r"did you mean 'actors\.count'"):
        load_config("tiny", changes={"actors.counts": 3})


@pytest.mark.parametrize("content", ["- 1\n", "a: [\n", "!!python/object/apply:os.system ['true']\n"])
def test_bad_config_file_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "bad.yaml"
    path.write_text(content)
    with pytest.raises(ConfigError, match=r"bad\.yaml"):
        load_config(path=path)


def test_annotated_yaml_reads_back_as_the_same_config(tmp_path: Path) -> None:
    config = load_config("quick")
    path = tmp_path / "all.yaml"
    path.write_text(annotated_yaml(config))
    assert Config.model_validate(yaml.safe_load(path.read_text())) == config
