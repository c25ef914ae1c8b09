"""A small furnished room with a window and a shut cupboard, and walking capsules, for the tests of cameras."""

import numpy as np
import trimesh
from jaxtyping import Float64

from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.pinhole import Intrinsics
from perpetua.geometry.transforms import look_at
from perpetua.scene.actor import ActorMesh, ActorPart
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Material, Room, SceneObject

GREY = Material("grey", (0.5, 0.5, 0.5))
WIDTH_M, DEPTH_M, HEIGHT_M = 6.0, 5.0, 2.6
CUPBOARD_LOW_M, CUPBOARD_HIGH_M = np.array([2.1, -2.4, 0.02]), np.array([2.9, -1.2, 2.0])
TABLE_M = np.array([0.0, 0.0, 0.75])


def camera_room() -> Room:
    """6 x 5 m; the window is a hole in the wall at y = 2.5; the table's top is a single sheet."""
    sheets = [
        _sheet((-3, -2.5, 0), (3, -2.5, 0), (3, 2.5, 0), (-3, 2.5, 0)),
        _sheet((-3, -2.5, HEIGHT_M), (-3, 2.5, HEIGHT_M), (3, 2.5, HEIGHT_M), (3, -2.5, HEIGHT_M)),
        _sheet((-3, -2.5, 0), (-3, 2.5, 0), (-3, 2.5, HEIGHT_M), (-3, -2.5, HEIGHT_M)),
        _sheet((3, -2.5, 0), (3, 2.5, 0), (3, 2.5, HEIGHT_M), (3, -2.5, HEIGHT_M)),
        _sheet((-3, -2.5, 0), (3, -2.5, 0), (3, -2.5, HEIGHT_M), (-3, -2.5, HEIGHT_M)),
        _sheet((-3, 2.5, 0), (3, 2.5, 0), (3, 2.5, 0.9), (-3, 2.5, 0.9)),
        _sheet((-3, 2.5, 2.0), (3, 2.5, 2.0), (3, 2.5, HEIGHT_M), (-3, 2.5, HEIGHT_M)),
        _sheet((-0.6, -0.4, 0.75), (0.6, -0.4, 0.75), (0.6, 0.4, 0.75), (-0.6, 0.4, 0.75)),
    ]
    cupboard = trimesh.creation.box(CUPBOARD_HIGH_M - CUPBOARD_LOW_M)
    cupboard.apply_translation(0.5 * (CUPBOARD_LOW_M + CUPBOARD_HIGH_M))
    meshes = [*sheets, as_tri_mesh(cupboard)]
    objects = tuple(
        SceneObject(i + 1, f"thing_{i}", "thing", mesh, GREY, i == 0, True) for i, mesh in enumerate(meshes)
    )
    polygon_m = np.array([[-3.0, -2.5], [3.0, -2.5], [3.0, 2.5], [-3.0, 2.5]])
    return Room("camera_room", "livingroom", polygon_m, HEIGHT_M, objects, (), None)


def as_tri_mesh(shape: trimesh.Trimesh) -> TriMesh:
    """Perpetua's mesh of trimesh's."""
    return TriMesh(np.asarray(shape.vertices, np.float64), np.asarray(shape.faces, np.int32))


def walker(actor: int, path_m: Float64[np.ndarray, "T 2"]) -> ActorMesh:
    """An upright capsule 1.7 m tall and 0.4 m wide whose axis follows ``path_m``."""
    capsule = trimesh.creation.capsule(height=1.3, radius=0.2, count=[10, 10])
    shape = as_tri_mesh(capsule.apply_translation([0.0, 0.0, -capsule.bounds[0, 2]]))
    offset_m = np.concatenate([path_m, np.zeros((len(path_m), 1))], axis=1)
    vertices_m = (shape.vertices_m[None] + offset_m[:, None]).astype(np.float32)
    part = ActorPart("body", shape.faces, np.zeros((len(shape.faces), 3, 2), np.float32), GREY)
    return ActorMesh(actor, 100 + actor, "capsule", (part,), vertices_m)


def walkers(frames: int) -> tuple[ActorMesh, ...]:
    """Four capsules that cross the room's free floor without meeting."""
    ends_m = [
        ((-2.2, -1.6), (-1.0, -1.2)),
        ((-1.8, 1.4), (-0.4, 1.2)),
        ((0.6, 1.3), (1.6, 0.4)),
        ((0.9, -1.2), (-0.1, -0.9)),
    ]
    fraction = np.linspace(0.0, 1.0, frames)[:, None]
    return tuple(
        walker(i, (1.0 - fraction) * np.array(start) + fraction * np.array(end))
        for i, (start, end) in enumerate(ends_m)
    )


def camera_path(position_m: Float64[np.ndarray, "T 3"], target_m: Float64[np.ndarray, "3"]) -> CameraPath:
    """A level camera with a field of view of 60 degrees that looks at one point."""
    world_from_camera = look_at(position_m, np.broadcast_to(target_m, position_m.shape).copy())
    return CameraPath(0, world_from_camera, Intrinsics.centred(64, 48, np.radians(60.0)))


def _sheet(*corners: tuple[float, float, float]) -> TriMesh:
    return TriMesh(np.array(corners, np.float64), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
