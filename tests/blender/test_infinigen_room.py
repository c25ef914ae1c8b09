"""One real Infinigen room, made twice: the same bits, plain and opaque, exactly what its .blend renders."""

import json
import re
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from perpetua.geometry.mesh import join
from perpetua.geometry.raycast import Caster
from perpetua.navigation.config import NavigationConfig
from perpetua.navigation.grid import build_nav_grid
from perpetua.rooms.acceptance.checks import check_room
from perpetua.rooms.config import RoomsConfig
from perpetua.rooms.fingerprint import room_sha256
from perpetua.rooms.infinigen import InfinigenRooms
from perpetua.rooms.source import RoomWish
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

pytestmark = [pytest.mark.blender, pytest.mark.infinigen, pytest.mark.slow]

CONFIG = RoomsConfig(kinds=("bathroom",), min_side_m=5.0, max_side_m=6.0)
SEED = StageSeed(4, 0, "room")
WISH = RoomWish("bathroom", (6.2, 6.6, 2.8), "evening", True)

# Opens a .blend as the render stage does, and says what is in it.
INSPECT = """
import json, sys
import bpy, numpy as np
bpy.ops.wm.open_mainfile(filepath=sys.argv[1], load_ui=False, use_scripts=False)
things = {}
for thing in bpy.context.scene.objects:
    if thing.type == "MESH":
        mesh = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        mesh.calc_loop_triangles()
        corners = [[thing.matrix_world @ mesh.vertices[i].co for i in face.vertices] for face in mesh.loop_triangles]
        corners = np.array(corners, np.float64).reshape(-1, 3)
        things[thing.pass_index] = {
            "triangles": len(mesh.loop_triangles), "modifiers": len(thing.modifiers),
            "particles": len(thing.particle_systems), "hidden": thing.hide_render, "parent": thing.parent is not None,
            "centre": corners.mean(0).tolist(), "low": corners.min(0).tolist(), "high": corners.max(0).tolist(),
        }
shaders = set()
for tree in [m.node_tree for m in bpy.data.materials if m.node_tree] + list(bpy.data.node_groups):
    for node in tree.nodes:
        shaders.add(node.type)
        if node.type == "BSDF_PRINCIPLED":
            alpha, transmission = node.inputs["Alpha"], node.inputs["Transmission Weight"]
            if alpha.is_linked or alpha.default_value < 1 or transmission.is_linked or transmission.default_value > 0:
                shaders.add("SEE_THROUGH")
answer = {
    "things": things, "shaders": sorted(shaders),
    "other": sorted({thing.type for thing in bpy.data.objects} - {"MESH", "LIGHT"}),
    "displacement": sorted({material.displacement_method for material in bpy.data.materials}),
    "lamp_w": sum(lamp.energy for lamp in bpy.data.lights if lamp.type != "SUN"),
    "sun_w_m2": [lamp.energy for lamp in bpy.data.lights if lamp.type == "SUN"],
    "world": bpy.context.scene.world is not None,
    "unpacked": [i.name for i in bpy.data.images if i.users and i.type == "IMAGE" and i.packed_file is None],
    "libraries": len(bpy.data.libraries),
    "drivers": sum(1 for t in bpy.data.objects if t.animation_data is not None),
}
open(sys.argv[2], "w").write(json.dumps(answer))
"""


@pytest.fixture(scope="module")
def rooms(tmp_path_factory: pytest.TempPathFactory) -> tuple[Room, Room]:
    """The same seed in two processes and two folders."""
    first, second = (
        InfinigenRooms().make(WISH, CONFIG, SEED, 0, tmp_path_factory.mktemp(name)) for name in ("a", "bb")
    )
    return first, second


@pytest.fixture(scope="module")
def blend(rooms: tuple[Room, Room], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What the first room's .blend holds."""
    answer = tmp_path_factory.mktemp("inspection") / "answer.json"
    subprocess.run([sys.executable, "-c", INSPECT, str(rooms[0].blend_path), str(answer)], check=True)
    content: dict[str, Any] = json.loads(answer.read_text(encoding="utf-8"))
    return content


def test_one_seed_gives_the_same_room_in_two_processes(rooms: tuple[Room, Room]) -> None:
    assert room_sha256(rooms[0]) == room_sha256(rooms[1])


def test_the_room_is_acceptable_and_origin_is_on_its_floor(rooms: tuple[Room, Room]) -> None:
    room = rooms[0]
    check_room(room, CONFIG, NavigationConfig())
    assert build_nav_grid(room, NavigationConfig()).free_floor_m2 >= CONFIG.min_free_floor_m2
    floor = next(obj for obj in room.objects if obj.category == "floor")
    np.testing.assert_allclose(floor.mesh.vertices_m[:, 2], 0.0, atol=1e-6)
    low, high = floor.mesh.vertices_m.min(0), floor.mesh.vertices_m.max(0)
    np.testing.assert_allclose(low[:2], -high[:2], atol=1e-4)
    np.testing.assert_allclose(high[:2], room.floor_polygon_m.max(0), atol=1e-3)
    # Shafts of skylights rise above the ceiling.
    ceiling_m = min(obj.mesh.vertices_m[:, 2].min() for obj in room.objects if obj.category == "ceiling")
    assert abs(ceiling_m - room.height_m) < 0.05


def test_names_are_plain_nouns_with_a_number(rooms: tuple[Room, Room]) -> None:
    names = [obj.name for obj in rooms[0].objects]
    assert len(set(names)) == len(names) and "floor_0" in names
    assert all(re.fullmatch(rf"{obj.category}_\d+", obj.name) for obj in rooms[0].objects)


def test_triangles_are_those_that_the_blend_renders(rooms: tuple[Room, Room], blend: dict[str, Any]) -> None:
    objs = blend["things"]
    assert sorted(int(index) for index in objs) == [obj.object_index for obj in rooms[0].objects]
    for obj in rooms[0].objects:
        rendered = objs[str(obj.object_index)]
        assert rendered["triangles"] == len(obj.mesh.faces), obj.name
        corners_m = obj.mesh.vertices_m[obj.mesh.faces].reshape(-1, 3)
        np.testing.assert_allclose(rendered["centre"], corners_m.mean(0), atol=1e-5, err_msg=obj.name)
        np.testing.assert_allclose(rendered["low"], corners_m.min(0), atol=1e-5, err_msg=obj.name)
        np.testing.assert_allclose(rendered["high"], corners_m.max(0), atol=1e-5, err_msg=obj.name)


def test_the_blend_is_plain_and_complete(blend: dict[str, Any]) -> None:
    for obj in blend["things"].values():
        assert (obj["modifiers"], obj["particles"], obj["hidden"], obj["parent"]) == (0, 0, False, False)
    assert blend["other"] == []
    assert blend["displacement"] == ["BUMP"]
    assert (blend["unpacked"], blend["libraries"], blend["drivers"]) == ([], 0, 0)
    assert blend["world"]


def test_no_surface_lets_a_camera_ray_through(blend: dict[str, Any]) -> None:
    see_through = {"SEE_THROUGH", "BSDF_TRANSPARENT", "BSDF_GLASS", "BSDF_REFRACTION", "VOLUME_ABSORPTION"}
    assert see_through.isdisjoint(blend["shaders"])


def test_the_outline_runs_along_the_walls(rooms: tuple[Room, Room]) -> None:
    room = rooms[0]
    walls = Caster(join([obj.mesh for obj in room.objects if obj.category == "wall"]))
    corners_m = np.column_stack([room.floor_polygon_m, np.full(len(room.floor_polygon_m), 0.05)])
    assert walls.closest_distance(corners_m).max() < 0.01
    # The middle of each side too, unless a door or a window reaches the floor there.
    middle_m = 0.5 * (corners_m + np.roll(corners_m, -1, axis=0))
    assert np.median(walls.closest_distance(middle_m)) < 0.01


def test_infinigens_colliders_are_near_what_is_rendered(
    rooms: tuple[Room, Room],
) -> None:
    assert rooms[0].blend_path is not None
    gap = json.loads((rooms[0].blend_path.parent / "collider_gap.json").read_text(encoding="utf-8"))
    assert gap["median_m"] < 0.005
    assert gap["median_m"] <= gap["p95_m"] <= gap["p99_m"] <= gap["max_m"]
    assert 0.0 <= gap["share_beyond_2_cm"] < 0.3


def test_the_evening_sun_is_low(blend: dict[str, Any]) -> None:
    assert blend["sun_w_m2"] == [pytest.approx(0.8)]


def test_lamps_are_on(rooms: tuple[Room, Room], blend: dict[str, Any]) -> None:
    side_m = np.ptp(rooms[0].floor_polygon_m, axis=0)
    assert blend["lamp_w"] >= 1.0 * side_m[0] * side_m[1]
