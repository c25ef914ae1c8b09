"""A scene: a furnished room, people in motion, cameras, and what was rendered of them."""

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
class Scene:
    """A room and what is in it, as far as it is known: what a stage has not made yet is empty.

    ``motions`` are in the order of the actors, ``views`` in that of the cameras. Rays at the room come from
    ``room.surfaces``, ``room.obstacles`` and ``room.opaque``.
    """

    room: Room
    actors: tuple[ActorMesh, ...] = ()
    cameras: tuple[CameraPath, ...] = ()
    motions: tuple[BodyMotion, ...] = ()
    views: tuple[RenderedView, ...] = ()

    @property
    def frames(self) -> int:
        """How many frames were rendered."""
        return len(self.views[0].depth_m)

    @property
    def object_index(self) -> tuple[UInt16[np.ndarray, "T H W"], ...] | None:
        """The rendered object indices of all views; None where nothing was rendered."""
        return tuple(view.object_index for view in self.views) or None
