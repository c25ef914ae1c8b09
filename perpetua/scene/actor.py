"""What the route, motion and actor stages hand on. T frames, P vertices, F faces."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32

from perpetua.scene.room import Material

# SMPL-X's first 22 joints, the order of BodyMotion.world_from_joint, and each one's parent (-1: the world).
BODY_JOINTS = (
    "pelvis", "left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle",
    "right_ankle", "spine3", "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head",
    "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist",
)  # fmt: skip
BODY_PARENTS = (-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19)
CONTACTS = ("left_heel", "left_toe", "right_heel", "right_toe")


# How fast a person goes, from slowest to fastest.
PACES = ("stand", "stroll", "walk", "brisk", "jog")


@dataclass(frozen=True)
class Seat:
    """A place to sit, measured in the direction ``facing_rad`` in which the sitter looks.

    ``middle_m`` is on the surface under the sitter's hips, ``height_m`` its height above the floor. ``top_m`` is the
    height in the world of the highest place under hips and thighs. ``edge_m`` is how far ahead of the middle the
    surface ends. ``backs_m`` are pairs of a height above ``top_m`` and the distance to what is behind the middle there.
    """

    object_index: int
    middle_m: tuple[float, float, float]
    facing_rad: float
    height_m: float
    top_m: float
    edge_m: float
    backs_m: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Dwell:
    """A pause on a route, from ``first_frame`` to ``last_frame``, both included.

    ``purpose`` is "look" (at ``target_m``), "stand" (at a table, ``target_m`` on it) or "sit" (the route stands in
    front of the seat with its back to it; ``target_m`` is the middle of the ``seat``). ``object_index`` is what it is
    about; None for nothing in particular.
    """

    first_frame: int
    last_frame: int
    purpose: str
    object_index: int | None
    target_m: tuple[float, float, float]
    seat: Seat | None = None


@dataclass(frozen=True)
class Route:
    """Where one actor's body axis goes: ``position_m`` on the floor, ``heading_rad`` about Z (0 faces +X).

    ``description`` is what the actor does on it, in plain words; ``dwells`` its pauses, in order.
    """

    actor: int
    position_m: Float64[np.ndarray, "T 3"]
    heading_rad: Float64[np.ndarray, " T"]
    description: str = "walks"
    dwells: tuple[Dwell, ...] = ()


@dataclass(frozen=True)
class BodyMotion:
    """Full-body motion in the world.

    ``world_from_joint`` holds global rotations of ``BODY_JOINTS``. In the rest pose (all identity) the body stands
    in a T-pose facing +X with +Y to its left and +Z up. ``contacts`` follows ``CONTACTS``. ``finger_from_parent``
    holds rotations of SMPL-X's 30 finger joints (15 left, then 15 right) relative to their parents, identity for a
    flat hand in the rest pose; None leaves the hands relaxed.
    """

    actor: int
    fps: float
    world_from_joint: Float64[np.ndarray, "T 22 3 3"]
    pelvis_m: Float64[np.ndarray, "T 3"]
    contacts: Bool[np.ndarray, "T 4"]
    finger_from_parent: Float64[np.ndarray, "T 30 3 3"] | None = None


@dataclass(frozen=True)
class ActorPart:
    """Body, a garment, hair or shoes: triangles into the actor's vertices, UVs per corner, and a material."""

    name: str
    faces: Int32[np.ndarray, "F 3"]
    uv: Float32[np.ndarray, "F 3 2"]
    material: Material


@dataclass(frozen=True)
class ActorMesh:
    """A dressed body in motion; ``vertices_m`` in world coordinates at each frame."""

    actor: int
    object_index: int
    description: str
    parts: tuple[ActorPart, ...]
    vertices_m: Float32[np.ndarray, "T P 3"]

    @property
    def faces(self) -> Int32[np.ndarray, "F 3"]:
        """Faces of all parts, in the order of the parts."""
        return np.concatenate([part.faces for part in self.parts])


@dataclass(frozen=True)
class Skeleton:
    """A body's bones in the rest pose of ``BodyMotion`` (T-pose facing +X, soles on z = 0).

    ``joint_m`` holds the places of ``BODY_JOINTS``; ``contact_m`` the points of the soles named by ``CONTACTS``
    (they move rigidly with the ankle for heels and with the foot joint for toes). ``seat_m`` is how far below the hip
    joints the body ends when it sits; None where it was not measured.
    """

    joint_m: Float64[np.ndarray, "22 3"]
    contact_m: Float64[np.ndarray, "4 3"]
    seat_m: float | None = None
