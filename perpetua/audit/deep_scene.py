"""What a sequence was made from, for checks against it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt16

from perpetua.scene.actor import ActorMesh
from perpetua.scene.room import Room


@dataclass(frozen=True)
class DeepScene:
    """The meshes that a sequence shows, and, where they are kept, the object indices that were rendered."""

    room: Room
    actors: tuple[ActorMesh, ...]
    object_index: tuple[UInt16[np.ndarray, "T H W"], ...] | None
