# SPDX-License-Identifier: GPL-3.0-or-later
"""Takes faces out of a mesh."""

from collections.abc import Callable

import bmesh
import bpy


def delete_faces(mesh: bpy.types.Mesh, gone: Callable[[int], bool]) -> None:
    """Deletes the faces whose index satisfies ``gone``, and what only they used."""
    editable = bmesh.new()
    editable.from_mesh(mesh)
    bmesh.ops.delete(editable, geom=[face for face in editable.faces if gone(face.index)], context="FACES")
    editable.to_mesh(mesh)
    editable.free()
