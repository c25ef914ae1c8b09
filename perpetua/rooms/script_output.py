"""Reads the room that a Blender script left in a folder: ``room.json``, ``meshes.npz`` and ``room.blend``."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from perpetua.geometry.mesh import TriMesh
from perpetua.scene.room import Room, SceneObject


def read_room(folder: Path, name: str, blend_path: Path) -> Room:
    """The room that a script left in a folder.

    Args:
        folder: holds ``room.json`` and ``meshes.npz``.
        name: what the room shall be called.
        blend_path: where its .blend is.
    """
    table = json.loads((folder / "room.json").read_text(encoding="utf-8"))
    with np.load(folder / "meshes.npz", allow_pickle=False) as arrays:
        vertices_m, faces = arrays["vertices_m"], arrays["faces"]
        vertex_start, face_start = arrays["vertex_start"], arrays["face_start"]
    objects = tuple(
        _scene_object(
            entry,
            TriMesh(
                vertices_m[vertex_start[k] : vertex_start[k + 1]].copy(),
                faces[face_start[k] : face_start[k + 1]].copy(),
            ),
        )
        for k, entry in enumerate(table["objects"])
    )
    return Room(
        name=name,
        kind=table["kind"],
        floor_polygon_m=np.array(table["floor_polygon_m"], np.float64),
        height_m=table["height_m"],
        objects=objects,
        lights=(),
        blend_path=blend_path,
    )


def _scene_object(entry: dict[str, Any], mesh: TriMesh) -> SceneObject:
    return SceneObject(
        object_index=entry["object_index"],
        name=entry["name"],
        category=entry["category"],
        mesh=mesh,
        material=None,
        walkable=entry["walkable"],
        opaque=entry["opaque"],
    )
