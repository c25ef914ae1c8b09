# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes the panes that one looks through out of a scene file's objects."""

import bpy

from blender_scripts.scene_files.mesh_faces import delete_faces
from blender_scripts.worker.categories import GLAZED
from blender_scripts.worker.opaque_materials import is_pane, shader_trees

# An object this thin and this wide is a sheet: a pane if it is of glass.
MAX_SHEET_M, MIN_SHEET_SIDE_M = 0.06, 0.3
# Glass lets more than this through.
GLASS_TRANSMISSION = 0.5


def cut_glass(obj: bpy.types.Object, category: str) -> bool:
    """Deletes the faces of an object's panes; True if nothing of it remains.

    Clear surfaces are panes anywhere; glass is one in windows, doors and cabinets, and as a thin sheet.
    """
    glazed = category in GLAZED or category == "window_frame" or _is_sheet(obj)
    panes = {
        index
        for index, material in enumerate(obj.data.materials)
        if is_pane(material) or (glazed and _is_glass(material))
    }
    faces = obj.data.polygons
    gone = {face.index for face in faces if face.material_index in panes}
    if 0 < len(gone) < len(faces):
        obj.data = obj.data.copy()
        delete_faces(obj.data, gone.__contains__)
    return len(gone) == len(faces)


def _is_sheet(obj: bpy.types.Object) -> bool:
    thin_m, side_m, _ = sorted(obj.dimensions)
    return thin_m <= MAX_SHEET_M and side_m >= MIN_SHEET_SIDE_M


def _is_glass(material: bpy.types.Material | None) -> bool:
    if material is None or not material.use_nodes:
        return False
    for tree in shader_trees(material.node_tree):
        for node in tree.nodes:
            if node.type in {"BSDF_GLASS", "BSDF_REFRACTION"}:
                return True
            if node.type == "BSDF_PRINCIPLED":
                passes = node.inputs["Transmission Weight"]
                if not passes.is_linked and passes.default_value > GLASS_TRANSMISSION:
                    return True
    return False
