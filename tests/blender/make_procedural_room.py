"""Writes a .blend with procedural and plain materials: ``python make_procedural_room.py room.blend``.

Two boards share one mesh: checks of 0.5 m in object space, inside two nested groups and a mixture of shaders. A third
one is plain green, a fourth is a screen that shines in checks. A lamp shines on them.
"""

import sys

import bpy

RED, BLUE, GREEN = (0.7, 0.05, 0.05, 1.0), (0.05, 0.1, 0.7, 1.0), (0.05, 0.6, 0.05, 1.0)
LAYERS = {"Sheen Weight": 0.8, "Sheen Roughness": 0.03, "Coat Weight": 1.0, "Coat Roughness": 0.7}


def checks_group() -> bpy.types.NodeTree:
    """A group that hands out a shader: half diffuse, half principled, both with the checks' colour.

    Its sheen, which only shows at the rim, and a dull coat come from the group's inputs.
    """
    group = bpy.data.node_groups.new("checks", "ShaderNodeTree")
    group.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    group.interface.new_socket("Extra", in_out="INPUT", socket_type="NodeSocketShader")
    for name, value in LAYERS.items():
        group.interface.new_socket(name, in_out="INPUT", socket_type="NodeSocketFloat").default_value = value
    start, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    place, checker = group.nodes.new("ShaderNodeTexCoord"), group.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = RED, BLUE
    checker.inputs["Scale"].default_value = 2.0
    shift = group.nodes.new("ShaderNodeVectorMath")
    shift.inputs[1].default_value = (0.001, 0.001, 0.1)
    group.links.new(place.outputs["Object"], shift.inputs[0])
    group.links.new(shift.outputs[0], checker.inputs["Vector"])
    principled, mix = group.nodes.new("ShaderNodeBsdfPrincipled"), group.nodes.new("ShaderNodeMixShader")
    principled.inputs["Roughness"].default_value = 0.9
    for name in LAYERS:
        group.links.new(start.outputs[name], principled.inputs[name])
    group.links.new(checker.outputs["Color"], principled.inputs["Base Color"])
    group.links.new(start.outputs["Extra"], mix.inputs[1])
    group.links.new(principled.outputs[0], mix.inputs[2])
    group.links.new(mix.outputs[0], end.inputs["Shader"])
    return group


def checked_material() -> bpy.types.Material:
    """The group, fed with a diffuse shader of the first colour at a tenth of the mixture; and a fine bump."""
    material = bpy.data.materials.new("checked")
    material.use_nodes = True
    material.displacement_method = "BUMP"
    tree = material.node_tree
    tree.nodes.clear()
    output, node = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeGroup")
    node.node_tree = checks_group()
    node.node_tree.nodes["Mix Shader"].inputs[0].default_value = 0.9
    extra = tree.nodes.new("ShaderNodeBsdfDiffuse")
    extra.inputs["Color"].default_value = RED
    tree.links.new(extra.outputs[0], node.inputs["Extra"])
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    noise, displacement = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeDisplacement")
    noise.inputs["Scale"].default_value = 3.0
    displacement.inputs["Scale"].default_value = 0.02
    tree.links.new(noise.outputs[0], displacement.inputs["Height"])
    tree.links.new(displacement.outputs[0], output.inputs["Displacement"])
    return material


def plain_material() -> bpy.types.Material:
    """Green, without textures."""
    material = bpy.data.materials.new("plain")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = GREEN
    return material


def screen_material() -> bpy.types.Material:
    """A black surface that gives light of its own, in checks."""
    material = bpy.data.materials.new("screen")
    material.use_nodes = True
    tree = material.node_tree
    shader, checker = tree.nodes["Principled BSDF"], tree.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = GREEN, BLUE
    shader.inputs["Base Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    shader.inputs["Emission Strength"].default_value = 3.0
    tree.links.new(checker.outputs["Color"], shader.inputs["Emission Color"])
    return material


def main() -> None:
    """Builds and saves the scene."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    mesh = bpy.data.meshes.new("board")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(checked_material())
    plain = mesh.copy()
    plain.materials[0] = plain_material()
    screen = mesh.copy()
    screen.materials[0] = screen_material()
    places = [(mesh, -2.1, 0.0), (mesh, 0.0, 0.0), (plain, 2.1, 0.0), (screen, 0.0, 2.1)]
    for index, (data, x, y) in enumerate(places, start=1):
        obj = bpy.data.objects.new(f"board_{index}", data)
        obj.location, obj.pass_index = (x, y, 0.0), index
        scene.collection.objects.link(obj)
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "AREA"))
    lamp.location, lamp.data.energy, lamp.data.size = (0.5, 0.3, 3.0), 300.0, 2.0
    scene.collection.objects.link(lamp)
    bpy.ops.wm.save_as_mainfile(filepath=sys.argv[1])


if __name__ == "__main__":
    main()
