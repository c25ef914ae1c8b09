"""What is done to Infinigen's rooms before they are written, on small scenes of our own."""

import json
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from perpetua.resources import SCRIPT_FOLDER

pytestmark = pytest.mark.blender

CODE = """
import json, math, sys
sys.path.insert(0, sys.argv[1])
import bpy
import bmesh
import numpy as np
from mathutils import Matrix
from blender_scripts.infinigen import colors, light, settle
from blender_scripts.worker import plain_meshes

def clear():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.scene.world = bpy.data.worlds.new("world")
    bpy.context.scene.world.use_nodes = True

def box(name, low, high):
    low, high = np.array(low, float), np.array(high, float)
    mesh = bpy.data.meshes.new(name)
    editable = bmesh.new()
    placed = Matrix.Translation(0.5 * (low + high)) @ Matrix.Diagonal((*(high - low), 1.0))
    bmesh.ops.create_cube(editable, size=1.0, matrix=placed)
    editable.to_mesh(mesh)
    thing = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(thing)
    return thing

def settled():
    clear()
    made = {
        "floor": ("floor", box("floor", (-3, -3, -0.1), (3, 3, 0))),
        "table": ("table", box("table", (0, 0, 0.05), (1, 1, 0.75))),
        "cup": ("cup", box("cup", (0.4, 0.4, 0.76), (0.5, 0.5, 0.86))),
        "vase": ("vase", box("vase", (-1, -1, 0.5), (-0.9, -0.9, 0.7))),
        "books": ("books", box("books", (-1, -1, 0.7), (-0.9, -0.9, 0.8))),
        "cabinet": ("cabinet", box("cabinet", (2, 2, 1.0), (2.5, 2.5, 1.5))),
        "ceiling": ("ceiling", box("ceiling", (-3, -3, 2.7), (3, 3, 2.8))),
        "lamp": ("ceiling_lamp", box("lamp", (1, -1, 2.3), (1.2, -0.8, 2.5))),
        "held": ("ceiling_lamp", box("held", (-1, 1, 2.3), (-0.8, 1.2, 2.5))),
        "shaft": ("ceiling", box("shaft", (-0.79, 1, 2.2), (-0.7, 1.2, 2.7))),
        "chair": ("chair", box("chair", (-2, -2, -0.005), (-1.5, -1.5, 0.8))),
    }
    lights = []
    for name, place in (("own", (1.1, -0.9, 2.25)), ("other", (0, 0, 2.25))):
        light = bpy.data.objects.new(name, bpy.data.lights.new(name, "POINT"))
        light.location = place
        bpy.context.scene.collection.objects.link(light)
        lights.append(light)
    bpy.context.view_layer.update()
    things = [thing for _, thing in made.values()]
    gone = settle.settle(things, [category for category, _ in made.values()], lights)
    moved = {thing.name: thing.location.z for thing in things + lights}
    return {"gone": sorted(thing.name for thing in gone), "moved": moved}

def tamed():
    clear()
    answer = {}
    for name, category, color in json.loads(sys.argv[2]):
        thing = box(name, (0, 0, 0), (1, 1, 1))
        material = bpy.data.materials.new(name)
        material.use_nodes = True
        tree = material.node_tree
        surface = tree.nodes["Principled BSDF"]
        source = tree.nodes.new("ShaderNodeRGB")
        source.outputs[0].default_value = (*color, 1.0)
        tree.links.new(source.outputs[0], surface.inputs["Base Color"])
        thing.data.materials.append(material)
        colors.tame_colors([thing], [category])
        answer[name] = baked(thing, tree, surface)
    return answer

def baked(thing, tree, surface):
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(surface.inputs["Base Color"].links[0].from_socket, emission.inputs["Color"])
    tree.links.new(emission.outputs[0], tree.nodes["Material Output"].inputs["Surface"])
    image = bpy.data.images.new("target", 4, 4, float_buffer=True)
    target = tree.nodes.new("ShaderNodeTexImage")
    target.image = image
    tree.nodes.active = target
    thing.data.uv_layers.new(name="uv")
    square = [(0, 0), (1, 0), (1, 1), (0, 1)]
    for polygon in thing.data.polygons:
        for corner, loop in enumerate(polygon.loop_indices):
            thing.data.uv_layers[0].uv[loop].vector = square[corner]
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 1
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    bpy.context.view_layer.objects.active = thing
    bpy.ops.object.select_all(action="DESELECT")
    thing.select_set(True)
    bpy.ops.object.bake(type="EMIT", margin=0)
    return [float(value) for value in np.array(image.pixels).reshape(-1, 4)[5, :3]]

def lit(daytime, lamps_on, has_windows):
    clear()
    tree = bpy.context.scene.world.node_tree
    lamps = []
    for name, kind, energy in (("sun", "SUN", 40.0), ("lamp", "POINT", 100.0), ("portal", "AREA", 0.0)):
        lamp = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
        lamp.data.energy = energy
        bpy.context.scene.collection.objects.link(lamp)
        lamps.append(lamp)
    lamps[2].data.cycles.is_portal = True
    lamps[0].rotation_euler = (math.radians(30.0), 0.0, 0.0)
    bpy.context.view_layer.update()
    light.set_light(lamps, [5.0, 6.0, 2.7], daytime, lamps_on, has_windows)
    bpy.context.view_layer.update()
    left = {lamp.name: lamp.data.energy for lamp in bpy.data.objects if lamp.type == "LIGHT"}
    elevation = None
    if "sun" in left:
        elevation = math.asin((bpy.data.objects["sun"].matrix_world.to_3x3() @ Matrix.Identity(3).col[2]).z)
    own_sky = any(node.type == "MIX_SHADER" and any(
        link.from_node.name == "Background" for socket in node.inputs for link in socket.links) for node in tree.nodes)
    return {"lamps": left, "elevation": elevation, "own_sky": own_sky}

def plant():
    clear()
    mesh = bpy.data.meshes.new("plant")
    editable = bmesh.new()
    bmesh.ops.create_uvsphere(editable, u_segments=16, v_segments=10, radius=0.1)
    for k in range(200):
        corners = [editable.verts.new((0.01 * k + x, y, 0.3)) for x, y in ((0, 0), (0.005, 0), (0, 0.005))]
        editable.faces.new(corners)
    editable.to_mesh(mesh)
    thing = bpy.data.objects.new("plant", mesh)
    bpy.context.scene.collection.objects.link(thing)
    before = plain_meshes.triangle_count(mesh)
    plain_meshes.thin_leaves([thing], [before - 150])
    xs = sorted({round(vertex.co.x, 3) for vertex in mesh.vertices if vertex.co.z > 0.2 and vertex.co.y > 0.004})
    pot = sum(1 for face in mesh.polygons if face.center.z < 0.2)
    return {"before": before, "after": plain_meshes.triangle_count(mesh), "leaves_x": xs, "pot_faces": pot}

print("ANSWER" + json.dumps({
    "settled": settled(), "tamed": tamed(), "plant": plant(),
    "lit": {f"{d} {o} {w}": lit(d, o, w) for d in ("day", "evening", "night") for o in (True, False)
            for w in (True, False)},
}))
"""

COLORS = [
    ("neon", "wall", (0.05, 0.8, 0.1)),
    ("pastel", "wall", (0.6, 0.7, 0.65)),
    ("brick", "wall", (0.35, 0.18, 0.14)),
    ("black", "wall", (0.001, 0.001, 0.001)),
    ("blue_ceiling", "ceiling", (0.05, 0.1, 0.9)),
    ("sofa", "sofa", (0.05, 0.8, 0.1)),
    ("chair", "chair", (0.1, 0.2, 0.3)),
    ("shelf", "cabinet", (0.0, 0.0, 0.0)),
]


@pytest.fixture(scope="module")
def answer() -> dict[str, Any]:
    """What the scripts made of the small scenes."""
    command = [sys.executable, "-c", CODE, str(SCRIPT_FOLDER.parent), json.dumps(COLORS)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    line = next(line for line in done.stdout.splitlines() if line.startswith("ANSWER"))
    content: dict[str, Any] = json.loads(line.removeprefix("ANSWER"))
    return content


def test_objects_settle_on_what_is_below_them(answer: dict[str, Any]) -> None:
    moved = answer["settled"]["moved"]
    assert moved["table"] == pytest.approx(-0.05, abs=1e-4)
    # The cup was 1 cm above the table, and follows it down.
    assert moved["cup"] == pytest.approx(-0.06, abs=1e-4)
    assert moved["chair"] == moved["floor"] == moved["cabinet"] == 0.0


def test_ceiling_lamps_are_lifted_to_the_ceiling(answer: dict[str, Any]) -> None:
    moved = answer["settled"]["moved"]
    assert moved["lamp"] == pytest.approx(0.2, abs=1e-4)
    assert moved["own"] == pytest.approx(2.45, abs=1e-4)
    assert moved["other"] == pytest.approx(2.25)
    assert moved["held"] == 0.0


def test_small_objects_in_the_air_are_left_out_with_what_stands_on_them(answer: dict[str, Any]) -> None:
    assert answer["settled"]["gone"] == ["books", "vase"]


def _saturation(color: list[float]) -> float:
    return 1.0 - min(color) / max(color)


def test_wall_colours_are_calm_and_natural_ones_stay(answer: dict[str, Any]) -> None:
    tamed = answer["tamed"]
    assert _saturation(tamed["neon"]) == pytest.approx(0.32, abs=0.01)
    assert int(np.argmax(tamed["neon"])) == 1
    np.testing.assert_allclose(tamed["pastel"], (0.6, 0.7, 0.65), atol=1e-3)
    np.testing.assert_allclose(tamed["brick"], (0.35, 0.18, 0.14), atol=1e-3)
    assert max(tamed["black"]) == pytest.approx(0.08, abs=1e-3)
    assert _saturation(tamed["blue_ceiling"]) == pytest.approx(0.15, abs=0.01)


def test_furniture_keeps_strong_colours(answer: dict[str, Any]) -> None:
    tamed = answer["tamed"]
    assert _saturation(tamed["sofa"]) == pytest.approx(0.75, abs=0.01)
    np.testing.assert_allclose(tamed["chair"], (0.1, 0.2, 0.3), atol=1e-3)
    assert max(tamed["shelf"]) == pytest.approx(0.035, abs=1e-3)


def test_sun_and_sky_follow_the_time_of_day(answer: dict[str, Any]) -> None:
    lit = answer["lit"]
    day, evening, night = (lit[f"{daytime} True True"] for daytime in ("day", "evening", "night"))
    assert day["lamps"]["sun"] == 8.0 and day["own_sky"]
    assert day["elevation"] == pytest.approx(np.radians(60.0), abs=1e-3)
    assert 0.0 < evening["lamps"]["sun"] < 1.0 and not evening["own_sky"]
    assert evening["elevation"] == pytest.approx(np.radians(9.0), abs=1e-3)
    assert "sun" not in night["lamps"] and not night["own_sky"]


def test_lamps_are_off_when_wished_and_something_always_shines(answer: dict[str, Any]) -> None:
    lit = answer["lit"]
    for daytime in ("day", "evening", "night"):
        on, off = lit[f"{daytime} True True"]["lamps"], lit[f"{daytime} False True"]["lamps"]
        # By day lamps are weaker than what comes in at the windows.
        assert on["lamp"] == (35.0 if daytime == "day" else 100.0) and "ceiling_panel" not in on
        assert "lamp" not in off and 0.0 < off["ceiling_panel"] < 0.2 * 100.0
        assert off["portal"] == on["portal"] == 0.0
    assert lit["day False False"]["lamps"]["lamp"] == 100.0


def test_leaves_are_taken_evenly_and_the_pot_stays(answer: dict[str, Any]) -> None:
    plant = answer["plant"]
    assert plant["before"] - plant["after"] == 150
    assert plant["pot_faces"] == 160
    steps = np.diff(plant["leaves_x"])
    assert len(plant["leaves_x"]) == 50 and steps.max() < 0.06
