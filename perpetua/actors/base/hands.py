"""Finger joints: SMPL-X's thirty, MakeHuman's bones for them, and how hands hang that do nothing."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

# The order of BodyMotion.finger_from_parent.
_FINGERS = ("index", "middle", "pinky", "ring", "thumb")
FINGER_JOINTS = tuple(
    f"{side}_{finger}{segment}" for side in ("left", "right") for finger in _FINGERS for segment in (1, 2, 3)
)
_MAKEHUMAN_NUMBERS = {"thumb": 1, "index": 2, "middle": 3, "ring": 4, "pinky": 5}
# How far each finger's three segments bend in a hand that does nothing, from the knuckle outward.
_RELAXED_DEG = {
    "index": (20.0, 26.0, 14.0),
    "middle": (26.0, 30.0, 17.0),
    "ring": (30.0, 33.0, 19.0),
    "pinky": (31.0, 33.0, 19.0),
    "thumb": (22.0, 14.0, 12.0),
}


def makehuman_bone(joint: str) -> str:
    """MakeHuman's name of the bone that starts at a finger joint."""
    side, name = joint.split("_")
    return f"finger{_MAKEHUMAN_NUMBERS[name[:-1]]}-{name[-1]}.{'L' if side == 'left' else 'R'}"


def parent_of(joint: str) -> str:
    """The joint that carries a finger joint."""
    side, name = joint.split("_")
    return f"{side}_wrist" if name[-1] == "1" else f"{side}_{name[:-1]}{int(name[-1]) - 1}"


def flat_direction(joint: str, direction: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "3"]:
    """Where a finger's segment points on a flat hand in the T-pose, given where it points with the wrist alone turned.

    Fingers lie level and closer together than MakeHuman's; the thumb stays as it is.
    """
    if "thumb" in joint:
        return direction
    level = direction * np.array([0.45, 1.0, 0.0])
    return np.asarray(level / np.linalg.norm(level))


@lru_cache(maxsize=1)
def relaxed_fingers() -> Float64[np.ndarray, "30 3 3"]:
    """Rotations of the finger joints relative to their parents, of hands that hang."""
    rotations = []
    for joint in FINGER_JOINTS:
        side, name = joint.split("_")
        sign = 1.0 if side == "left" else -1.0
        # Fingers bend towards the palm, which faces down in the T-pose; the thumb closes towards them.
        axis = np.array([0.0, -0.5, sign]) / np.hypot(1.0, 0.5) if "thumb" in name else np.array([-sign, 0.0, 0.0])
        bend = np.radians(_RELAXED_DEG[name[:-1]][int(name[-1]) - 1])
        rotations.append(Rotation.from_rotvec(bend * axis).as_matrix())
    return np.stack(rotations)
