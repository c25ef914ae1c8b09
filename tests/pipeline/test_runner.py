"""The runner on a table of three small stages: what is computed, what is skipped, what is published."""

import json
import shutil
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from perpetua.config import Config
from perpetua.errors import AuditError, RouteError
from perpetua.pipeline.layout import OutputLayout
from perpetua.pipeline.runner import RoomRun, stage_keys
from perpetua.pipeline.stages import STAGES, Stage, StageContext

RunCount = Counter[str]


def _section(*names: str) -> Callable[[Config], dict[str, Any]]:
    return lambda config: {name: config.model_dump(mode="json")[name] for name in names}


def _table(ran: RunCount, fail: str = "") -> tuple[Stage, ...]:
    def stage(work: Callable[[StageContext], object], name: str) -> Callable[[StageContext], object]:
        def run(context: StageContext) -> object:
            ran[name] += 1
            if name == fail:
                raise AuditError(f"{name} does not work out")
            return work(context)

        return run

    def draw(context: StageContext) -> object:
        return (int(context.seed.stream("x").integers(1000)),)

    def export(context: StageContext) -> object:
        target = context.folder / "sequence"
        target.mkdir()
        (target / "number.txt").write_text(str(context.many("room", int)[0]))
        return None

    def audit(context: StageContext) -> object:
        number = int((context.stage_folders["export"] / "sequence" / "number.txt").read_text())
        (context.folder / "audit.json").write_text(json.dumps({"number": number}))
        return None

    return (
        Stage(10, "room", 1, (), _section("rooms"), stage(draw, "room")),
        Stage(90, "export", 1, ("room",), _section("export"), stage(export, "export")),
        Stage(95, "audit", 1, ("export",), _section("audit"), stage(audit, "audit")),
    )


def _run(
    out: Path, ran: RunCount, config: Config | None = None, room: int = 0, fail: str = "", until: str = "audit"
) -> OutputLayout:
    config = config or Config()
    RoomRun(config, 7, room, out, "cpu", lambda event: None, _table(ran, fail)).run(until)
    return OutputLayout(out, config.export, 7, room)


def test_finished_room_is_published_and_not_computed_again(tmp_path: Path) -> None:
    ran: RunCount = Counter()
    layout = _run(tmp_path, ran)
    number = (layout.sequence_folder / "number.txt").read_text()
    _run(tmp_path, ran)
    assert ran == {"room": 1, "export": 1, "audit": 1}
    assert json.loads((layout.sequence_folder / "audit.json").read_text())["number"] == int(number)
    assert sorted(path.name for path in layout.sequence_folder.parent.iterdir()) == [layout.sequence_folder.name]


def test_until_stops_and_the_next_run_goes_on(tmp_path: Path) -> None:
    ran: RunCount = Counter()
    layout = _run(tmp_path, ran, until="room")
    assert not layout.sequence_folder.exists()
    _run(tmp_path, ran)
    assert ran == {"room": 1, "export": 1, "audit": 1}


def test_changed_setting_recomputes_its_stage_and_what_lies_downstream(tmp_path: Path) -> None:
    ran: RunCount = Counter()
    _run(tmp_path, ran)
    _run(tmp_path, ran, Config.model_validate({"audit": {"reprojection_px": 0.5}}))
    assert ran == {"room": 1, "export": 1, "audit": 2}
    _run(tmp_path, ran, Config.model_validate({"rooms": {"min_side_m": 4.0}}))
    assert ran == {"room": 2, "export": 2, "audit": 3}


def test_picture_of_a_replaced_sequence_is_removed(tmp_path: Path) -> None:
    layout = _run(tmp_path, Counter())
    layout.contact_sheet.parent.mkdir()
    layout.contact_sheet.write_text("old")
    _run(tmp_path, Counter())
    assert layout.contact_sheet.exists()
    _run(tmp_path, Counter(), Config.model_validate({"audit": {"reprojection_px": 0.5}}))
    assert not layout.contact_sheet.exists()


def test_a_room_that_moves_to_another_split_leaves_the_one_it_was_in(tmp_path: Path) -> None:
    before = _run(tmp_path, Counter())
    after = _run(tmp_path, Counter(), Config.model_validate({"export": {"splits": {"val": 1.0}}}))
    assert after.sequence_folder == tmp_path / "val" / before.sequence_folder.name
    assert after.sequence_folder.is_dir() and after.work_folder.is_dir() and not before.sequence_folder.exists()


def test_damaged_stage_is_computed_again(tmp_path: Path) -> None:
    ran: RunCount = Counter()
    layout = _run(tmp_path, ran, until="export")
    (layout.work_folder / "10_room" / "value.json").write_text("[1")
    _run(tmp_path, ran)
    assert ran == {"room": 2, "export": 1, "audit": 1}


def test_failure_is_recorded_and_forgotten_when_mended(tmp_path: Path) -> None:
    ran: RunCount = Counter()
    with pytest.raises(AuditError):
        _run(tmp_path, ran, fail="export")
    layout = OutputLayout(tmp_path, Config().export, 7, 0)
    assert json.loads(layout.failure_file.read_text()) == {
        "stage": "export", "reason": "export does not work out", "exit_code": 1,
    }  # fmt: skip
    _run(tmp_path, ran)
    assert not layout.failure_file.exists()
    assert ran["room"] == 1


def _drawn_until(good: int, tried: list[int]) -> tuple[Stage, ...]:
    """A table whose routes number ``good`` is the first that works out."""

    def routes(context: StageContext) -> object:
        tried.append(context.seed.redraw)
        if context.seed.redraw < good:
            raise RouteError(f"routes {context.seed.redraw} are too close")
        return (int(context.seed.stream("x").integers(10**6)),)

    room, export, audit = _table(Counter())
    row = Stage(30, "routes", 1, ("room",), _section("actors"), routes, redraw=lambda rejected, config: rejected)
    return (room, row, replace(export, needs=("room", "routes")), audit)


def test_rejected_draw_is_drawn_again_and_never_tried_twice(tmp_path: Path) -> None:
    tried: list[int] = []
    run = partial(RoomRun, Config(), 7, 0, tmp_path, "cpu", lambda event: None, _drawn_until(2, tried))
    run().run("routes")
    run().run("audit")
    assert tried == [0, 1, 2]
    shutil.rmtree(tmp_path / ".work")
    run().run("audit")
    assert tried == [0, 1, 2]
    audit = json.loads((tmp_path / "train" / "seed7-room0000" / "audit.json").read_text())
    assert audit["rejected_draws"] == 2


def test_draws_end_with_the_last_reason(tmp_path: Path) -> None:
    tried: list[int] = []
    config = Config.model_validate({"redraw": {"routes_per_room": 1, "rooms": 1}})
    for _ in range(2):
        with pytest.raises(RouteError, match="routes 3 are too close"):
            RoomRun(config, 7, 0, tmp_path, "cpu", lambda event: None, _drawn_until(9, tried)).run("audit")
    assert tried == [0, 1, 2, 3, 3]


def test_room_is_drawn_anew_when_its_routes_are_spent() -> None:
    config = Config.model_validate({"redraw": {"routes_per_room": 1}})
    keys = [stage_keys(config, 7, 0, rejected) for rejected in range(3)]
    assert keys[0]["room"] == keys[1]["room"] != keys[2]["room"]
    assert len({key["routes"] for key in keys}) == 3


def test_room_does_not_depend_on_the_others(tmp_path: Path) -> None:
    alone = _run(tmp_path / "a", Counter(), room=2)
    for room in range(3):
        _run(tmp_path / "b", Counter(), room=room)
    numbers = [(tmp_path / "b" / "train" / f"seed7-room{room:04d}" / "number.txt").read_text() for room in range(3)]
    assert (alone.sequence_folder / "number.txt").read_text() == numbers[2]
    assert len(set(numbers)) == 3


def test_every_setting_that_a_sequence_depends_on_is_in_some_key() -> None:
    base = stage_keys(Config(), 0, 0)
    assert stage_keys(Config(), 1, 0)["room"] != base["room"]
    assert stage_keys(Config(), 0, 1)["room"] != base["room"]
    longer = stage_keys(Config.model_validate({"sequence": {"frames": 9}}), 0, 0)
    changed = {name for name in base if base[name] != longer[name]}
    assert changed == {stage.name for stage in STAGES} - {"room", "navigation"}
