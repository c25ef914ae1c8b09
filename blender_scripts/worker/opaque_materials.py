# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes every surface opaque, so that depth and object index belong to what the picture shows.

Window panes and glass doors are cut out; other glass keeps its colour and gloss but lets no ray through.
"""

from collections.abc import Iterator

import bmesh
import bpy

# Principled surfaces that let more than this through are panes that one looks through.
_PANE_ALPHA = 0.5


def shader_trees(tree: bpy.types.NodeTree) -> Iterator[bpy.types.NodeTree]:
    """The node tree and every group inside it, each once."""
    waiting, seen = [tree], {tree.name_full}
    while waiting:
        current = waiting.pop()
        yield current
        for node in current.nodes:
            if node.type == "GROUP" and node.node_tree is not None and node.node_tree.name_full not in seen:
                seen.add(node.node_tree.name_full)
                waiting.append(node.node_tree)


def is_pane(material: bpy.types.Material | None) -> bool:
    """Whether a material is thin clear glass: a principled surface of low, constant alpha."""
    if material is None or not material.use_nodes:
        return False
    for tree in shader_trees(material.node_tree):
        for node in tree.nodes:
            if node.type == "BSDF_PRINCIPLED":
                alpha = node.inputs["Alpha"]
                if not alpha.is_linked and alpha.default_value < _PANE_ALPHA:
                    return True
    return False


def cut_panes(mesh: bpy.types.Mesh) -> None:
    """Deletes the faces of clear glass, unless nothing would remain."""
    panes = {index for index, material in enumerate(mesh.materials) if is_pane(material)}
    if not panes:
        return
    editable = bmesh.new()
    editable.from_mesh(mesh)
    faces = [face for face in editable.faces if face.material_index in panes]
    if len(faces) < len(editable.faces):
        bmesh.ops.delete(editable, geom=faces, context="FACES")
        editable.to_mesh(mesh)
    editable.free()


def make_opaque(material: bpy.types.Material) -> None:
    """Takes transmission, alpha and transparent shaders out of a material."""
    # Bump keeps the look of displacement and leaves the surface where the mesh is.
    material.displacement_method = "BUMP"
    for tree in shader_trees(material.node_tree):
        for node in list(tree.nodes):
            if node.type == "BSDF_PRINCIPLED":
                _set_constant(tree, node.inputs["Transmission Weight"], 0.0)
                _set_constant(tree, node.inputs["Alpha"], 1.0)
            elif node.type == "BSDF_TRANSPARENT":
                _replace(tree, node, "ShaderNodeBsdfTranslucent")
            elif node.type in {"BSDF_GLASS", "BSDF_REFRACTION"}:
                _replace(tree, node, "ShaderNodeBsdfAnisotropic")


def _set_constant(tree: bpy.types.NodeTree, socket: bpy.types.NodeSocket, value: float) -> None:
    for link in list(socket.links):
        tree.links.remove(link)
    socket.default_value = value


def _replace(tree: bpy.types.NodeTree, node: bpy.types.Node, new_type: str) -> None:
    """Puts a shader of another type in the node's place, with the same colour."""
    new = tree.nodes.new(new_type)
    color = node.inputs["Color"]
    new.inputs["Color"].default_value = color.default_value
    for link in list(color.links):
        tree.links.new(link.from_socket, new.inputs["Color"])
    for link in list(node.outputs[0].links):
        tree.links.new(new.outputs[0], link.to_socket)
    tree.nodes.remove(node)
