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
from perpetua.pipeline.layout import RoomLayout, RunLayout
from perpetua.pipeline.runner import RoomRun, stage_keys
from perpetua.pipeline.stages import Stage, StageContext, UndeclaredInputError

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
        number = int((context.folder_of("export") / "sequence" / "number.txt").read_text())
        (context.folder / "audit.json").write_text(json.dumps({"number": number}))
        return None

    return (
        Stage(10, "room", 1, (), _section("rooms"), stage(draw, "room")),
        Stage(90, "export", 1, ("room",), _section("export"), stage(export, "export")),
        Stage(95, "audit", 1, ("export",), _section("audit"), stage(audit, "audit")),
    )


def _run(
    out: Path, ran: RunCount, config: Config | None = None, room: int = 0, fail: str = "", until: str = "audit"
) -> RoomLayout:
    config = config or Config()
    RoomRun(config, 7, room, out, "cpu", lambda event: None, _table(ran, fail)).run(until)
    return RunLayout(out, config.export, 7).room(room)


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
    layout = RunLayout(tmp_path, Config().export, 7).room(0)
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


def test_a_published_room_is_made_again_as_it_was_where_its_stages_are_asked_for(tmp_path: Path) -> None:
    tried: list[int] = []
    run = partial(RoomRun, Config(), 7, 0, tmp_path, "cpu", lambda event: None, _drawn_until(2, tried))
    run().run("audit")
    shutil.rmtree(tmp_path / ".work")
    again = run()
    again.run("routes", even_if_published=True)
    assert tried == [0, 1, 2, 2]
    assert (
        again.keys["routes"]
        == json.loads((tmp_path / ".work/seed7-room0000/30_routes/manifest.json").read_text())["key"]
    )


@pytest.mark.parametrize("read", ["upstream", "folder_of"])
def test_a_stage_that_reads_what_it_does_not_declare_fails_at_once(tmp_path: Path, read: str) -> None:
    room, export, audit = _table(Counter())
    sly = replace(audit, run=lambda context: getattr(context, read)("room"))
    with pytest.raises(UndeclaredInputError, match="stage 'audit' reads 'room', which its row"):
        RoomRun(Config(), 7, 0, tmp_path, "cpu", lambda event: None, (room, export, sly)).run("audit")


def test_what_stages_share_is_made_once_a_room_and_freed_with_it(tmp_path: Path) -> None:
    made: list[int] = []

    def share(context: StageContext) -> object:
        if "bodies" not in context.shared:
            made.append(context.seed.room)
            context.shared["bodies"] = "drawn"
        return (1,)

    first, second = (Stage(number, name, 1, (), _section("rooms"), share) for number, name in ((10, "a"), (20, "b")))
    for room in (0, 1):
        run = RoomRun(Config(), 7, room, tmp_path, "cpu", lambda event: None, (first, second, *_table(Counter())))
        run.run("b")
        assert run.shared == {}
    assert made == [0, 1]
