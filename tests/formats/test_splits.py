"""Splits are drawn for each room by itself."""

import json
from pathlib import Path

import pytest

from perpetua.config import load_config
from perpetua.errors import ConfigError
from perpetua.formats.config import ExportConfig, split_of_room
from perpetua.pipeline.layout import RunLayout, open_run, read_run, sequence_name

THREE = ExportConfig(splits={"train": 0.7, "val": 0.2, "test": 0.1})


def test_all_rooms_train_by_default() -> None:
    assert {split_of_room(ExportConfig(), 7, room) for room in range(50)} == {"train"}


def test_shares_are_kept_and_seeds_differ() -> None:
    drawn = [split_of_room(THREE, 7, room) for room in range(3000)]
    for name, fraction in THREE.splits.items():
        # Four standard deviations of a binomial count.
        assert abs(drawn.count(name) / 3000 - fraction) < 4.0 * (fraction * (1.0 - fraction) / 3000) ** 0.5
    assert drawn != [split_of_room(THREE, 8, room) for room in range(3000)]


def test_a_split_does_not_depend_on_the_order_of_the_shares_or_on_other_rooms() -> None:
    turned = ExportConfig(splits={"test": 0.1, "val": 0.2, "train": 0.7})
    assert [split_of_room(turned, 7, room) for room in range(200)] == [
        split_of_room(THREE, 7, room) for room in range(200)
    ]


def test_a_split_without_rooms_gets_none() -> None:
    assert {split_of_room(ExportConfig(splits={"a": 0.0, "b": 1.0, "c": 0.0}), 7, room) for room in range(50)} == {"b"}


def test_known_rooms_stay_where_they_are() -> None:
    """The draw is part of published data: no change of the code may move a room."""
    assert [split_of_room(THREE, 7, room) for room in range(12)] == [
        "train", "train", "train", "train", "train", "train", "train", "train", "val", "train", "train", "test",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("splits", "message"),
    [
        ("{train: 0.9}", "sum to 0.9"),
        ("{train: 1.5, val: -0.5}", "shares in 0..1"),
        ("{../up: 1.0}", "cannot be a split"),
        ("{.work: 1.0}", "cannot be a split"),
    ],
)
def test_wrong_shares_are_refused(splits: str, message: str) -> None:
    with pytest.raises(ConfigError, match="splits.*" + message):
        load_config("tiny", assignments=[f"export.splits={splits}"])


def test_every_path_of_a_room_follows_its_split(tmp_path: Path) -> None:
    """Also after the config went through run.json, whose keys are sorted."""
    fractions = ["export.splits.train=0.7", "export.splits.val=0.2", "export.splits.test=0.1"]
    config = load_config("tiny", assignments=fractions)
    open_run(tmp_path, 7, range(3), config, False)
    stored = read_run(tmp_path).config.export
    for room in range(40):
        layout = RunLayout(tmp_path, config.export, 7).room(room)
        assert layout.sequence_folder == tmp_path / split_of_room(THREE, 7, room) / sequence_name(7, room)
        assert RunLayout(tmp_path, stored, 7).room(room).sequence_folder == layout.sequence_folder


def test_the_folder_of_another_split_is_found_and_the_work_area_is_not(tmp_path: Path) -> None:
    layout = RunLayout(tmp_path, ExportConfig(), 7).room(3)
    for parent in ("train", "val", ".work", "mine"):
        (tmp_path / parent / "seed7-room0003").mkdir(parents=True)
    for parent in ("train", "val", ".work"):
        (tmp_path / parent / "seed7-room0003" / "audit.json").write_text(json.dumps({}))
    assert layout.other_sequence_folders == [tmp_path / "val" / "seed7-room0003"]
