"""Scene files for tests, made of rooms of the procedural source."""

import tempfile
from pathlib import Path

import numpy as np
import trimesh

from perpetua.navigation.config import NavigationConfig
from perpetua.rooms.acceptance.build import build_room
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

Y_UP_FROM_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def procedural_room(kind: RoomKind, room: int = 0) -> Room:
    """A furnished room of meshes and plain materials."""
    config = RoomsConfig(source="procedural", kinds=(kind,))
    with tempfile.TemporaryDirectory() as scratch:
        return build_room(config, NavigationConfig(), StageSeed(11, room, "room"), Path(scratch))


def write_scene(room: Room, path: Path, world_from_file: np.ndarray = Y_UP_FROM_Z_UP) -> Path:
    """Writes a room as .glb, .gltf or .obj, named objects and one colour each; Y up unless told otherwise.

    Args:
        room: made of meshes and materials.
        path: file to write; its suffix is the format.
        world_from_file: applied to all vertices, f64[4, 4].
    """
    scene = trimesh.Scene()
    for obj in room.objects:
        mesh = trimesh.Trimesh(obj.mesh.vertices_m, obj.mesh.faces, process=False)
        assert obj.material is not None
        material = trimesh.visual.material.PBRMaterial(
            name=obj.material.name,
            baseColorFactor=[*obj.material.base_color, 1.0],
            roughnessFactor=obj.material.roughness,
        )
        mesh.visual = trimesh.visual.TextureVisuals(material=material)
        scene.add_geometry(mesh, node_name=obj.name, geom_name=obj.name)
    scene.apply_transform(world_from_file)
    if path.suffix == ".gltf":
        for name, content in trimesh.exchange.gltf.export_gltf(scene).items():
            (path if name == "model.gltf" else path.parent / name).write_bytes(content)
    else:
        scene.export(str(path))
    return path
