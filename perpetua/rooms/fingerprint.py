"""One number that two rooms share only if they are the same room."""

import hashlib

import numpy as np

from perpetua.scene.room import Room


def room_sha256(room: Room) -> str:
    """SHA-256 over the outline and every object's index, name, category, flags and world mesh, bit by bit."""
    digest = hashlib.sha256(f"{room.kind} {room.height_m!r}".encode())
    digest.update(np.ascontiguousarray(room.floor_polygon_m).tobytes())
    for obj in room.objects:
        said = (
            obj.object_index,
            obj.name,
            obj.category,
            obj.walkable,
            obj.opaque,
            len(obj.mesh.vertices_m),
        )
        digest.update(repr(said).encode())
        digest.update(np.ascontiguousarray(obj.mesh.vertices_m).tobytes())
        digest.update(np.ascontiguousarray(obj.mesh.faces).tobytes())
    return digest.hexdigest()
