"""Scene files through Blender: every format gives the same room, nothing in a file runs, bad ones say why."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from perpetua.errors import InputError
from perpetua.geometry.mesh import TriMesh
from perpetua.navigation.config import NavigationConfig
from perpetua.rooms.acceptance.build import build_room
from perpetua.rooms.config import RoomsConfig, SceneFileConfig
from perpetua.scene.room import Material, Room, SceneObject
from perpetua.seeding import StageSeed
from perpetua.testing.scene_samples import Y_UP_FROM_Z_UP, procedural_room, write_scene

pytestmark = [pytest.mark.blender, pytest.mark.slow]

SEED = StageSeed(5, 0, "room")
MAKE_BLEND = Path(__file__).parent / "make_scene_blend.py"

# What a saved room.blend holds: lights by power, texts, drivers, libraries, images, nodes that write.
INSPECT = """
import json, os, sys
import bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1], load_ui=False, use_scripts=False)
names = [tree.name for tree in bpy.data.node_groups]
answer = {
    "lights": {lamp.name: lamp.data.energy for lamp in bpy.data.objects if lamp.type == "LIGHT"},
    "texts": len(bpy.data.texts), "libraries": len(bpy.data.libraries), "scenes": len(bpy.data.scenes),
    "animated": [t.name for t in [*bpy.data.objects, *bpy.data.materials] if t.animation_data is not None],
    "compositor": [n.name for s in bpy.data.scenes if s.node_tree for n in s.node_tree.nodes],
    "images": [i.filepath for i in bpy.data.images if i.source == "FILE" and i.packed_file is None],
    "modifiers": sum(len(thing.modifiers) for thing in bpy.data.objects),
    "types": sorted({thing.type for thing in bpy.data.objects}),
    "seen_through": [m.name for m in bpy.data.materials if m.use_nodes for n in m.node_tree.nodes
                     if n.type == "BSDF_PRINCIPLED" and n.inputs["Transmission Weight"].default_value > 0],
}
with open(sys.argv[2], "w") as file:
    file.write(json.dumps(answer))
os._exit(0)
"""


def _make(path: Path, scratch: Path, **settings: Any) -> Room:
    scratch.mkdir(exist_ok=True)
    config = RoomsConfig(source="file", max_redraws=1, file=SceneFileConfig(path=str(path), **settings))
    return build_room(config, NavigationConfig(), SEED, scratch)


def _refusal(path: Path, scratch: Path, **settings: Any) -> str:
    with pytest.raises(InputError) as error:
        _make(path, scratch, **settings)
    assert error.value.exit_code == 2
    return str(error.value)


def _blend(folder: Path, mode: str) -> Path:
    folder.mkdir()
    path = folder / "scene.blend"
    subprocess.run([sys.executable, str(MAKE_BLEND), str(path), str(folder.parent / "trap.txt"), mode], check=True)
    return path


@pytest.mark.parametrize("suffix", [".glb", ".gltf", ".obj"])
def test_every_format_gives_the_room_that_was_written(tmp_path: Path, suffix: str) -> None:
    original = procedural_room("kitchen")
    moved = np.eye(4)
    moved[:3, 3] = [12.0, -7.0, 1.25]
    room = _make(write_scene(original, tmp_path / f"scene{suffix}", Y_UP_FROM_Z_UP @ moved), tmp_path / "work")
    assert room.kind == "scene"
    assert room.height_m == pytest.approx(original.height_m, abs=0.05)
    assert [obj.object_index for obj in room.objects] == list(range(1, len(original.objects) + 1))
    whole, wanted = ([obj.mesh for obj in made.objects] for made in (room, original))
    assert sum(len(mesh.faces) for mesh in whole) == sum(len(mesh.faces) for mesh in wanted)
    floor_m = next(obj.mesh for obj in original.objects if obj.category == "floor").vertices_m
    shift_m = np.append(0.5 * (floor_m.min(0) + floor_m.max(0))[:2], floor_m[:, 2].max())
    by_name = {obj.name: obj for obj in room.objects}
    for obj in original.objects:
        again = by_name[obj.name]
        np.testing.assert_allclose(again.mesh.vertices_m.min(0), obj.mesh.vertices_m.min(0) - shift_m, atol=2e-4)
        np.testing.assert_allclose(again.mesh.vertices_m.max(0), obj.mesh.vertices_m.max(0) - shift_m, atol=2e-4)
        assert again.walkable == (again.category in {"floor", "rug"})
    assert {obj.category for obj in room.objects} >= {"floor", "wall", "ceiling", "kitchen_counter", "fridge"}


@pytest.fixture(scope="module")
def blend_room(tmp_path_factory: pytest.TempPathFactory) -> tuple[Room, Path]:
    folder = tmp_path_factory.mktemp("blend")
    return _make(_blend(folder / "given", "whole"), folder / "work"), folder


def test_a_blend_in_centimetres_becomes_a_room_in_metres(blend_room: tuple[Room, Path]) -> None:
    room = blend_room[0]
    assert np.ptp(room.floor_polygon_m, axis=0) == pytest.approx([6.0, 5.0], abs=1e-4)
    assert room.height_m == pytest.approx(2.6, abs=0.03)
    by_name = {obj.name: obj for obj in room.objects}
    # A box that only its place tells to be the floor.
    assert (by_name["Cube"].category, by_name["Cube"].walkable) == ("floor", True)
    assert by_name["Cube"].mesh.vertices_m[:, 2].max() == pytest.approx(0.0, abs=1e-5)
    assert by_name["Carpet"].category == "rug"
    assert "Secret" not in by_name
    chairs = [obj for obj in room.objects if obj.name.startswith("Seat")]
    assert [obj.category for obj in chairs] == ["chair", "chair"]
    middles_m = sorted(float(obj.mesh.vertices_m[:, 0].mean()) for obj in chairs)
    assert middles_m == pytest.approx([0.0, 1.5], abs=1e-4)
    for obj in chairs:
        assert _volume_m3(obj.mesh) == pytest.approx(0.4 * 0.4 * 0.45, rel=1e-4)
    assert by_name["Round Table"].category == "table"
    # Subdivided as it is rendered, but three times instead of eleven.
    assert len(by_name["Sofa"].mesh.faces) == 2 * 6 * 4**3


def _volume_m3(mesh: TriMesh) -> float:
    """Positive where faces look out."""
    a, b, c = mesh.vertices_m[mesh.faces].transpose(1, 0, 2)
    return float((a * np.cross(b, c)).sum() / 6.0)


def test_nothing_in_a_blend_runs_and_nothing_of_it_is_kept(blend_room: tuple[Room, Path]) -> None:
    room, folder = blend_room
    assert not (folder / "trap.txt").exists()
    assert sorted(path.name for path in folder.iterdir()) == ["given", "outside.png", "work"]
    answer = folder / "work" / "answer.json"
    subprocess.run([sys.executable, "-c", INSPECT, str(room.blend_path), str(answer)], check=True)
    held = json.loads(answer.read_text(encoding="utf-8"))
    assert (held["texts"], held["libraries"], held["scenes"], held["modifiers"]) == (0, 0, 1, 0)
    assert held["animated"] == held["compositor"] == held["images"] == held["seen_through"] == []
    assert held["types"] == ["LIGHT", "MESH"]
    # 600 kW at 100 times the distance are 60 W, enough for 30 square metres.
    assert held["lights"] == {"Lamp": pytest.approx(60.0)}
    assert not (folder / "trap.txt").exists()


def test_two_runs_give_the_same_room(blend_room: tuple[Room, Path], tmp_path: Path) -> None:
    first, folder = blend_room
    again = _make(folder / "given" / "scene.blend", tmp_path / "work")
    assert [obj.name for obj in first.objects] == [obj.name for obj in again.objects]
    for one, other in zip(first.objects, again.objects, strict=True):
        assert np.array_equal(one.mesh.vertices_m, other.mesh.vertices_m)
        assert np.array_equal(one.mesh.faces, other.mesh.faces)


def test_a_blend_that_links_others_is_refused(tmp_path: Path) -> None:
    message = _refusal(_blend(tmp_path / "given", "linked"), tmp_path / "work")
    assert "takes parts from other .blend files (library.blend)" in message
    assert "Make Local" in message


def test_a_damaged_blend_is_refused(tmp_path: Path) -> None:
    (tmp_path / "scene.blend").write_bytes(b"BLENDER-v402" + bytes(range(256)) * 8)
    assert "scene.blend': Blender" in _refusal(tmp_path / "scene.blend", tmp_path / "work")


def test_one_mesh_is_parted_into_floor_and_rest(tmp_path: Path) -> None:
    # Floor, walls and ceiling of one unnamed mesh, seen from inside, with a block in it.
    import trimesh

    shell = trimesh.creation.box(bounds=np.array([[0, 0, 0], [6, 5, 2.7]]))
    shell.invert()
    block = trimesh.creation.box(bounds=np.array([[1, 1, 0], [2, 2, 0.8]]))
    both = trimesh.util.concatenate([shell, block])
    both.apply_transform(Y_UP_FROM_Z_UP)
    trimesh.Scene({"scan": both}).export(str(tmp_path / "scene.glb"))
    room = _make(tmp_path / "scene.glb", tmp_path / "work")
    assert [(obj.category, obj.walkable) for obj in room.objects] == [("clutter", False), ("floor", True)]
    # The block stands on the shell's floor, which is whole beneath it.
    assert [len(obj.mesh.faces) for obj in room.objects] == [22, 2]
    assert room.height_m == pytest.approx(2.7, abs=0.03)


def _room_of(objs: list[SceneObject]) -> Room:
    square_m = np.array([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]])
    return Room("bad", "scene", square_m, 2.5, tuple(objs), (), None)


def _box(name: str, low: tuple[float, float, float], high: tuple[float, float, float]) -> SceneObject:
    import trimesh

    box = trimesh.creation.box(bounds=[low, high])
    mesh = TriMesh(np.array(box.vertices, np.float64), np.array(box.faces, np.int32))
    return SceneObject(1, name, name, mesh, Material("paint", (0.5, 0.5, 0.5)), False, True)


def _floor() -> list[SceneObject]:
    return [_box("floor", (-3, -3, -0.1), (3, 3, 0)), _box("ceiling", (-3, -3, 2.5), (3, 3, 2.6))]


def _only_walls(path: Path) -> None:
    walls = [_box("wall", (-3, y, 0), (3, y + 0.1, 2.5)) for y in (-3, 3)]
    write_scene(_room_of([*walls, _box("pole", (0, 0, 0), (0.1, 0.1, 2))]), path)


def _full(path: Path) -> None:
    write_scene(_room_of([*_floor(), _box("cabinet", (-2.35, -2.35, 0), (2.35, 2.35, 1.5))]), path)


def _not_a_number(path: Path) -> None:
    broken = _box("vase", (0, 0, 0), (0.2, 0.2, 0.4))
    broken.mesh.vertices_m[3, 1] = np.nan
    write_scene(_room_of([*_floor(), broken]), path)


def _scaled(factor: float) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        write_scene(_room_of(_floor()), path, Y_UP_FROM_Z_UP @ np.diag([factor, factor, factor, 1.0]))

    return write


def _doors_of_20_m(path: Path) -> None:
    objs = [*_floor(), _box("door", (-0.5, 2.9, 0), (0.5, 3.0, 2.05))]
    write_scene(_room_of(objs), path, Y_UP_FROM_Z_UP @ np.diag([10.0, 10.0, 10.0, 1.0]))


def _nothing(path: Path) -> None:
    write_scene(_room_of(_floor()), path)
    text = json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]}).encode()
    text += b" " * (-len(text) % 4)
    header = b"glTF" + (2).to_bytes(4, "little") + (20 + len(text)).to_bytes(4, "little")
    path.write_bytes(header + len(text).to_bytes(4, "little") + b"JSON" + text)


@pytest.mark.parametrize(
    ("write", "expected"),
    [
        (_nothing, "holds nothing that has a surface"),
        (_only_walls, "it has no floor"),
        (_full, "rooms.min_free_floor_m2 is 6.0"),
        (_not_a_number, "1 vertices of 'vase' are no finite numbers"),
        (_doors_of_20_m, "tallest door measures 20.5 m"),
        (_scaled(0.01), "ceiling measures 0.025 m"),
        (_scaled(100.0), "set rooms.file.metres_per_unit, perhaps to 0.01"),
    ],
)
def test_bad_scenes_say_what_is_wrong(tmp_path: Path, write: Callable[[Path], None], expected: str) -> None:
    write(tmp_path / "scene.obj" if write is _not_a_number else tmp_path / "scene.glb")
    path = next(tmp_path.glob("scene.[og]*"))
    assert expected in _refusal(path, tmp_path / "work")


def test_a_folder_goes_on_with_the_next_file(tmp_path: Path) -> None:
    given = tmp_path / "given"
    given.mkdir()
    (given / "a.glb").write_bytes(b"no glTF")
    write_scene(_room_of(_floor()), given / "b.glb")
    rooms = {_make(given, tmp_path / "work").name}
    assert rooms == {"file_b"}
    (given / "b.glb").write_bytes(b"no glTF either")
    message = _refusal(given, tmp_path / "work")
    assert "a.glb" in message and "b.glb" in message


def test_a_glb_goes_through_the_whole_pipeline(tmp_path: Path) -> None:
    write_scene(procedural_room("livingroom"), tmp_path / "scene.glb")
    arguments = ["--preset", "tiny", "--seed", "3", "--device", "cpu", "--set", "sequence.frames=3"]
    arguments += ["--set", "rooms.source=file", "--set", f"rooms.file.path={tmp_path / 'scene.glb'}"]
    command = [sys.executable, "-c", "from perpetua.cli.app import main; main()", "generate", *arguments]
    done = subprocess.run(
        [*command, "--out", str(tmp_path / "out")], capture_output=True, text=True, check=False, timeout=900
    )
    assert done.returncode == 0, done.stdout + done.stderr
    sequence = tmp_path / "out" / "train" / "seed3-room0000"
    assert np.load(sequence / "tracks_xyz.npy").shape[0] == 3
    for view in range(4):
        depth_m = np.load(sequence / str(view) / "depth.npy")
        assert (depth_m > 0).mean() > 0.6
        assert depth_m.max() < 12.0
