"""What the render stage hands on."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, UInt16

from perpetua.scene.actor import ActorMesh, BodyMotion
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room


@dataclass(frozen=True)
class RenderedView:
    """One view: ``jpeg`` as the camera file would hold it, planar depth (0: no surface), object index (0: none)."""

    camera: int
    jpeg: tuple[bytes, ...]
    depth_m: Float32[np.ndarray, "T H W"]
    object_index: UInt16[np.ndarray, "T H W"]


@dataclass(frozen=True)
class FilmedScene:
    """A scene and what was rendered of it; motions in the order of the actors, views in that of the cameras."""

    room: Room
    motions: tuple[BodyMotion, ...]
    actors: tuple[ActorMesh, ...]
    cameras: tuple[CameraPath, ...]
    views: tuple[RenderedView, ...]

    @property
    def frames(self) -> int:
        """How many frames there are."""
        return len(self.views[0].depth_m)
