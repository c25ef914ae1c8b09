"""The Infinigen source without Infinigen: what it asks for, reads back, and does when objects go wrong."""

import importlib
import json
import sys
import time
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from perpetua.errors import EnvironmentSetupError, RoomError
from perpetua.navigation.config import NavigationConfig
from perpetua.rooms import infinigen
from perpetua.rooms.acceptance.build import REPORT_FILE, build_room
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.rooms.infinigen import InfinigenRooms, dimensions_m
from perpetua.rooms.source import RoomRejected, RoomWish, draw_wish
from perpetua.seeding import StageSeed
from tests.support.paths import ROOT

SEED = StageSeed(7, 0, "room")
CONFIG = RoomsConfig(timeout_s=10.0)


def wish(kind: RoomKind) -> RoomWish:
    """A room of the middle size, by day."""
    return RoomWish(kind, (6.0, 6.0, 2.8), "day", True)


# A tetrahedron and a square floor, written as the Blender script writes them.
WRITE_ROOM = """
import json, sys
from pathlib import Path
import numpy as np
job = json.loads(Path(sys.argv[1]).read_text())
folder = Path(job["folder"])
vertices_m = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1],
                       [-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]], np.float64)
faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 1, 2], [0, 2, 3]], np.int32)
np.savez(folder / "meshes.npz", vertices_m=vertices_m, faces=faces, vertex_start=[0, 4, 8], face_start=[0, 4, 6],
         collider_vertices_m=vertices_m[4:] - [0, 0, 0.01], collider_faces=faces[4:])
objects = [
    {"object_index": 1, "name": "bed_0", "category": "bed", "walkable": False, "opaque": True},
    {"object_index": 2, "name": "floor_0", "category": "floor", "walkable": True, "opaque": True},
]
square = [[-3, -3], [3, -3], [3, 3], [-3, 3]]
table = {"kind": job["kind"], "floor_polygon_m": square, "height_m": job["dimensions_m"][2], "objects": objects}
(folder / "room.json").write_text(json.dumps(table))
(folder / "room.blend").write_bytes(json.dumps(job).encode())
"""


def _use_script(monkeypatch: pytest.MonkeyPatch, folder: Path, code: str) -> None:
    script = folder / "script.py"
    script.write_text(code, encoding="utf-8")
    monkeypatch.setattr(infinigen, "SCRIPT", script)


def _categories() -> ModuleType:
    return importlib.import_module("blender_scripts.worker.categories")


@pytest.mark.parametrize(
    ("name", "category"),
    [
        ("room_floor_00", "floor"),
        ("room_wall_corners_00", "wall"),
        ("room_wall_back_05", "wall"),
        ("room_ceiling_back_00", "ceiling"),
        ("kitchen_cabinet_00.003", "kitchen_cabinet"),
        ("kitchen_upper_cabinet_02", "kitchen_cabinet"),
        ("kitchen_countertop_00.001", "kitchen_counter"),
        ("sofa_01", "sofa"),
        ("bed.001", "bed"),
        ("bedside_table.002", "bedside_table"),
        ("bedside_lamp", "table_lamp"),
        ("_table_coffee_legged_rand", "coffee_table"),
        ("cushion_bed_pillow_rand.001", "pillow"),
        ("dining_chair_03", "chair"),
        ("desk_chair_00", "desk_chair"),
        ("desk_00", "desk"),
        ("storage_rand.004", "cabinet"),
        ("bathroom_sink_00", "sink"),
        ("rug_rand", "rug"),
        ("uv_sphere_rand_effect_screw_ring.007", "clutter"),
        ("bedazzled_thing", "clutter"),
    ],
)
def test_names_become_plain_nouns(name: str, category: str) -> None:
    assert _categories().category_of(name) == category


def test_dimensions_stay_in_their_limits_and_follow_the_seed() -> None:
    config = RoomsConfig(min_side_m=5.0, max_side_m=6.0, min_height_m=2.5, max_height_m=2.7)
    draws = [draw_wish("kitchen", config, StageSeed(7, room, "room").stream("wish", 0)).size_m for room in range(200)]
    low, high = np.min(draws, axis=0), np.max(draws, axis=0)
    assert (low >= [5.0, 5.0, 2.5]).all() and (high <= [6.0, 6.0, 2.7]).all()
    assert (high - low > [0.9, 0.9, 0.18]).all()
    assert draws[3] == draw_wish("kitchen", config, StageSeed(7, 3, "room").stream("wish", 0)).size_m
    assert dimensions_m(RoomWish("bathroom", (5.0, 6.0, 2.6), "day", True)) == [4.0, 4.8, 2.6]


def test_the_room_comes_back_as_the_script_wrote_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    _use_script(monkeypatch, tmp_path, WRITE_ROOM)
    room = InfinigenRooms().make(wish("bedroom"), CONFIG, SEED, 0, tmp_path)
    assert [(obj.object_index, obj.category, obj.walkable) for obj in room.objects] == [
        (1, "bed", False),
        (2, "floor", True),
    ]
    assert np.array_equal(room.objects[0].mesh.faces, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    floor = room.objects[1].mesh
    assert np.array_equal(floor.vertices_m, [[-3, -3, 0], [3, -3, 0], [3, 3, 0], [-3, 3, 0]])
    assert np.array_equal(floor.faces, [[0, 1, 2], [0, 2, 3]])
    assert room.kind == "bedroom" and room.next_object_index == 3
    # The .blend is all that stays, beside the room, and how far the colliders are off.
    assert room.blend_path == tmp_path / "room.blend"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["collider_gap.json", "room.blend", "script.py"]
    gap = json.loads((tmp_path / "collider_gap.json").read_text())
    # Most of the surface is the floor, whose collider lies a centimetre below; the tetrahedron has none.
    assert gap["median_m"] == pytest.approx(0.01, abs=1e-4)
    assert gap["max_m"] == pytest.approx(0.5)
    assert 0.01 < gap["share_beyond_2_cm"] < 0.1


def test_the_wish_reaches_the_generator(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    _use_script(monkeypatch, tmp_path, WRITE_ROOM)
    wished = RoomWish("kitchen", (6.0, 5.5, 2.7), "night", False)
    room = InfinigenRooms().make(wished, CONFIG.model_copy(update={"max_memory_mb": 900.0}), SEED, 0, tmp_path)
    assert room.blend_path is not None
    job = json.loads(room.blend_path.read_text())
    assert (job["kind"], job["daytime"], job["lamps_on"]) == ("kitchen", "night", False)
    assert job["dimensions_m"] == dimensions_m(wished)
    assert job["max_memory_mb"] == 900.0


def test_a_generator_that_takes_too_much_memory_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    scripts = str(ROOT)
    greedy = f"""
import sys, time
sys.path.insert(0, {scripts!r})
from blender_scripts.worker.link import Worker
from blender_scripts.infinigen.watchdog import Watchdog
Watchdog(Worker(), 200.0).start()
hoard = bytearray(300_000_000)
time.sleep(30)
"""
    _use_script(monkeypatch, tmp_path, greedy)
    with pytest.raises(RoomRejected, match=r"rooms\.max_memory_mb = 200") as rejection:
        InfinigenRooms().make(wish("kitchen"), CONFIG, SEED, 0, tmp_path)
    assert rejection.value.rule == "memory"


def test_the_job_depends_on_seed_and_attempt_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    _use_script(monkeypatch, tmp_path, WRITE_ROOM)

    def job(folder: str, seed: StageSeed, attempt: int) -> dict[str, object]:
        scratch = tmp_path / folder
        scratch.mkdir()
        room = InfinigenRooms().make(wish("bedroom"), CONFIG, seed, attempt, scratch)
        assert room.blend_path is not None
        asked = json.loads(room.blend_path.read_text())
        return {key: asked[key] for key in ("kind", "seed", "dimensions_m")}

    first = job("a", SEED, 0)
    assert job("b", SEED, 0) == first
    assert job("c", SEED, 1) != first
    assert job("d", StageSeed(7, 1, "room"), 0) != first


def test_a_crash_is_a_rejection_with_the_last_lines(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    _use_script(monkeypatch, tmp_path, "raise ValueError('no place for the bathtub')")
    with pytest.raises(RoomRejected, match="no place for the bathtub") as rejection:
        InfinigenRooms().make(wish("bathroom"), CONFIG, SEED, 0, tmp_path)
    assert rejection.value.rule == "crash"


def test_a_hanging_generator_is_stopped(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    _use_script(monkeypatch, tmp_path, "import time; time.sleep(600)")
    begin = time.monotonic()
    with pytest.raises(RoomRejected, match=r"rooms\.timeout_s = 1 ") as rejection:
        InfinigenRooms().make(wish("kitchen"), CONFIG.model_copy(update={"timeout_s": 1.0}), SEED, 0, tmp_path)
    assert rejection.value.rule == "timeout"
    assert time.monotonic() - begin < 500.0


def test_missing_infinigen_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "infinigen2", None)
    with pytest.raises(EnvironmentSetupError, match=r"pip install 'perpetua\[infinigen\]'"):
        InfinigenRooms().draws(CONFIG)


def test_redraws_are_counted_by_reason(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    # The script's room has a bed alone, which makes no kitchen.
    _use_script(monkeypatch, tmp_path, WRITE_ROOM)
    config = RoomsConfig(kinds=("kitchen",), max_redraws=2)
    with pytest.raises(RoomError, match=r"3 draws of a kitchen.*furniture \(3 x\)"):
        build_room(config, NavigationConfig(), SEED, tmp_path)


def test_the_report_tells_figures_and_redraws(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    flag = f"from pathlib import Path\nflag = Path({str(tmp_path / 'flag')!r})\n"
    fail_once = flag + "if not flag.exists():\n    flag.touch()\n    raise SystemExit('first draw')\n"
    _use_script(monkeypatch, tmp_path, fail_once + WRITE_ROOM)
    build_room(RoomsConfig(kinds=("bedroom",), daytimes=("night",)), NavigationConfig(), SEED, tmp_path)
    report = json.loads((tmp_path / REPORT_FILE).read_text())
    assert (report["kind"], report["objects"], report["triangles"]) == ("bedroom", 2, 6)
    assert report["wish"]["daytime"] == "night"
    # Six metres square less 0.28 m on every side and what the bed takes.
    assert 25.0 < report["free_floor_m2"] < 29.6
    assert [redraw["rule"] for redraw in report["redraws"]] == ["crash"]
    assert "first draw" in report["redraws"][0]["reason"]
    assert report["collider_gap"]["max_m"] == pytest.approx(0.5)
    assert not (tmp_path / "collider_gap.json").exists()


def test_a_rejected_draw_is_followed_by_another(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    flag = f"from pathlib import Path\nflag = Path({str(tmp_path / 'flag')!r})\n"
    fail_once = flag + "if not flag.exists():\n    flag.touch()\n    raise SystemExit('first draw')\n"
    _use_script(monkeypatch, tmp_path, fail_once + WRITE_ROOM)
    room = build_room(RoomsConfig(kinds=("bedroom",)), NavigationConfig(), SEED, tmp_path)
    assert room.kind == "bedroom"
