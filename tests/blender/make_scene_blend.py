"""Writes a .blend as a stranger might: ``python make_scene_blend.py scene.blend trap.txt library``.

Units are centimetres. It holds a room of 6 x 5 x 2.6 m, a table of a curve, a chair shown by collection instances, a
hidden object, a lamp, and code that would write ``trap.txt`` if it ran: a registered text, a driver and a compositor.
With "linked" for the last word, it links its chair from another file.
"""

import os
import sys
from pathlib import Path

import bpy
from mathutils import Matrix

SCENE, TRAP, MODE = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
CODE = f"open({TRAP!r}, 'w').write('ran')"


def box(name: str, low: tuple[float, float, float], high: tuple[float, float, float]) -> bpy.types.Object:
    """A box between two corners, centimetres."""
    x, y, z = zip(low, high, strict=True)
    corners = [(x[i], y[j], z[k]) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def build_room() -> None:
    """Floor, walls and ceiling in one mesh without a telling name, two metres above the origin and off it."""
    box("Cube", (1000, 2000, 180), (1600, 2500, 200))
    box("Wall.001", (990, 1990, 200), (1000, 2510, 460))
    box("Wall.002", (1600, 1990, 200), (1610, 2510, 460))
    box("Wall.003", (1000, 1990, 200), (1600, 2000, 460))
    box("Wall.004", (1000, 2500, 200), (1600, 2510, 460))
    box("Ceiling", (1000, 2000, 460), (1600, 2500, 470))
    box("Carpet", (1200, 2150, 200), (1400, 2300, 201))
    soft = box("Sofa", (1010, 2100, 200), (1090, 2300, 280))
    subdivision = soft.modifiers.new("smooth", "SUBSURF")
    subdivision.levels, subdivision.render_levels = 0, 11
    box("Secret", (1300, 2200, 300), (1310, 2210, 310)).hide_render = True


def add_instances() -> None:
    """Two chairs: one collection, shown twice, the second one mirrored."""
    chairs = bpy.data.collections.new("chairs")
    chair = box("Seat", (-20, -20, 0), (20, 20, 45))
    bpy.context.scene.collection.objects.unlink(chair)
    chairs.objects.link(chair)
    for x, sign in ((1300, 1), (1450, -1)):
        shown = bpy.data.objects.new("Dining Chair", None)
        shown.instance_type, shown.instance_collection = "COLLECTION", chairs
        shown.matrix_world = Matrix.Translation((x, 2400, 200)) @ Matrix.Diagonal((sign, 1, 1, 1))
        bpy.context.scene.collection.objects.link(shown)


def add_curve() -> None:
    """A round table top: a filled curve."""
    bpy.ops.curve.primitive_bezier_circle_add(radius=40, location=(1500, 2100, 270))
    table = bpy.context.object
    table.name = "Round Table"
    table.data.dimensions, table.data.fill_mode, table.data.extrude = "2D", "BOTH", 2


def add_traps() -> None:
    """Everything that runs or writes when a .blend is trusted."""
    text = bpy.data.texts.new("startup.py")
    text.use_module = True
    text.write(CODE)
    curve = bpy.data.objects["Sofa"].driver_add("location", 2)
    curve.driver.type = "SCRIPTED"
    curve.driver.expression = f"[0, {CODE}][0]"
    scene = bpy.context.scene
    scene.use_nodes = True
    output = scene.node_tree.nodes.new("CompositorNodeOutputFile")
    output.base_path = str(Path(TRAP).parent)
    image = bpy.data.images.new("outside", 8, 8)
    image.filepath_raw = str(Path(TRAP).parent / "outside.png")
    image.file_format = "PNG"
    image.save()
    material = bpy.data.materials.new("sofa cloth")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.load(str(Path(TRAP).parent / "outside.png"))
    principled = material.node_tree.nodes["Principled BSDF"]
    material.node_tree.links.new(node.outputs["Color"], principled.inputs["Base Color"])
    principled.inputs["Transmission Weight"].default_value = 1.0
    bpy.data.objects["Sofa"].data.materials.append(material)


def main() -> None:
    """Builds and saves."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if MODE == "linked":
        library = SCENE.with_name("library.blend")
        box("Chair", (0, 0, 0), (40, 40, 45))
        bpy.ops.wm.save_as_mainfile(filepath=str(library))
        bpy.ops.wm.read_factory_settings(use_empty=True)
        with bpy.data.libraries.load(str(library), link=True) as (source, target):
            target.objects = list(source.objects)
        for obj in target.objects:
            bpy.context.scene.collection.objects.link(obj)
    units = bpy.context.scene.unit_settings
    units.system, units.scale_length = "METRIC", 0.01
    build_room()
    if MODE != "linked":
        add_instances()
        add_curve()
        add_traps()
        lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
        lamp.data.energy = 600_000.0
        lamp.location = (1300, 2250, 430)
        bpy.context.scene.collection.objects.link(lamp)
    bpy.ops.wm.save_as_mainfile(filepath=str(SCENE), compress=True)


if __name__ == "__main__":
    main()
    # bpy 4.2 may crash as Python ends; the file is saved.
    os._exit(0)
