"""A slanted plane and an actor that is a square before it, whose depth and index follow from a formula."""

import numpy as np
from jaxtyping import Float64

from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.pinhole import Intrinsics
from perpetua.geometry.transforms import look_at
from perpetua.rendering.config import RenderConfig
from perpetua.scene.actor import ActorMesh, ActorPart
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import AreaLight, Material, Room, SceneObject
from perpetua.scene.scene import RenderedView

FRAMES = 3
PLANE_INDEX, ACTOR_INDEX = 7, 41
# The slanted plane n . x = d; no symmetry that a wrong axis or sign could hide behind.
NORMAL = np.array([0.36, -0.48, 0.8])
OFFSET_M = -0.5
# The actor's front is a square patch parallel to the plane, this far before it at frame t.
PATCH_HEIGHT_M = np.array([0.3, 0.5, 0.75])
CONFIG = RenderConfig(width_px=64, height_px=48, samples=8, denoise=True)
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
TWO_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def in_plane(offset_m: float, half_side_m: float) -> Float64[np.ndarray, "4 3"]:
    """Corners of a square with ``NORMAL`` in the plane n . x = offset_m."""
    across = np.cross(NORMAL, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    up = np.cross(NORMAL, across)
    return np.asarray(NORMAL * offset_m + half_side_m * (SQUARE[:, :1] * across + SQUARE[:, 1:] * up))


def plane_room(power_w: float = 400.0) -> Room:
    """The plane under a lamp."""
    grey = Material("grey", (0.5, 0.5, 0.5), (0.2, 0.2, 0.2), pattern="checks", scale_m=0.5)
    plane = SceneObject(
        PLANE_INDEX, "plane", "wall", TriMesh(in_plane(OFFSET_M, 20.0), TWO_TRIANGLES), grey, False, True
    )
    light = AreaLight((2.0, -3.0, 5.0), (-0.3, 0.4, -1.0), (1.0, 0.5), power_w, (1.0, 0.95, 0.9))
    return Room("plane", "livingroom", SQUARE, 2.5, (plane,), (light,), None)


def patch() -> ActorMesh:
    """A red square that moves towards the cameras."""
    vertices_m = np.stack([in_plane(OFFSET_M + height_m, 0.5) for height_m in PATCH_HEIGHT_M]).astype(np.float32)
    uv = np.zeros((2, 3, 2), np.float32)
    image = np.full((4, 4, 3), (200, 30, 30), np.uint8)
    part = ActorPart("patch", TWO_TRIANGLES, uv, Material("red", (0.5, 0.5, 0.5), image=image))
    return ActorMesh(0, ACTOR_INDEX, "a red patch", (part,), vertices_m)


def two_cameras() -> tuple[CameraPath, ...]:
    """One centred camera, and one with its principal point off the centre and rectangular pixels; both move."""
    target_m = NORMAL * OFFSET_M + np.array([0.2, 0.1, 0.0])
    position_m = target_m + NORMAL * 2.5 + np.array([[0.4, -0.7, 0.6], [0.9, -0.4, 0.3], [1.5, 0.3, 0.1]])
    centred = CameraPath(0, look_at(position_m, np.tile(target_m, (FRAMES, 1))), Intrinsics.centred(64, 48, 1.1))
    skewed = Intrinsics(70.0, 55.0, 25.3, 29.1, 64, 48)
    wide = CameraPath(1, look_at(position_m[::-1] + np.array([-1.1, 0.2, 0.4]), np.tile(target_m, (FRAMES, 1))), skewed)
    return centred, wide


def assert_same(views: tuple[RenderedView, ...], others: tuple[RenderedView, ...]) -> None:
    """Pictures, depth and index agree bit for bit."""
    for view, other in zip(views, others, strict=True):
        assert view.jpeg == other.jpeg
        np.testing.assert_array_equal(view.depth_m, other.depth_m)
        np.testing.assert_array_equal(view.object_index, other.object_index)
