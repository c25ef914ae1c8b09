"""Shapes of hands: how far the joints of the fingers bend."""

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

# Bend of the three joints of each finger from the knuckle outward, radians: index, middle, pinky, ring, thumb, as
# SMPL-X orders them; the thumb's lies across the palm.
_RELAXED = ((0.21, 0.38, 0.24), (0.31, 0.45, 0.28), (0.42, 0.49, 0.31), (0.38, 0.49, 0.31), (0.10, 0.15, 0.15))
_FIST = ((1.25, 1.6, 1.0), (1.3, 1.65, 1.0), (1.3, 1.6, 1.0), (1.3, 1.65, 1.0), (0.5, 0.6, 0.7))
_SHAPES: dict[str, tuple[tuple[float, float, float], ...]] = {
    "relaxed": _RELAXED,
    "flat": ((0.05, 0.08, 0.05), (0.05, 0.08, 0.05), (0.08, 0.08, 0.05), (0.06, 0.08, 0.05), (0.05, 0.05, 0.05)),
    "fist": _FIST,
    "point": ((0.02, 0.05, 0.03), *_FIST[1:]),
    "thumb": (*_FIST[:4], (-0.25, -0.1, -0.1)),
    "grip": ((0.55, 0.75, 0.4), (0.65, 0.8, 0.4), (0.7, 0.8, 0.4), (0.68, 0.8, 0.4), (0.4, 0.35, 0.3)),
    "claw": ((0.45, 0.6, 0.4), (0.45, 0.6, 0.4), (0.5, 0.6, 0.4), (0.47, 0.6, 0.4), (0.2, 0.25, 0.2)),
}


def finger_rotations(
    shapes: tuple[str, str], weights: tuple[Float64[np.ndarray, " N"], Float64[np.ndarray, " N"]]
) -> Float64[np.ndarray, "N 30 3 3"]:
    """Rotations of the finger joints, left hand first, where each hand goes from relaxed (weight 0) to a shape (1)."""
    count = len(weights[0])
    turns = np.zeros((count, 30, 3))
    for hand, (shape, weight) in enumerate(zip(shapes, weights, strict=True)):
        bend_rad = np.array(_RELAXED) + weight[:, None, None] * (np.array(_SHAPES[shape]) - np.array(_RELAXED))
        # Fingers of the left hand point to +Y with the palm down; they close about X, the thumb about Z and Y.
        sign = -1.0 if hand == 0 else 1.0
        joints = slice(15 * hand, 15 * hand + 12)
        turns[:, joints, 0] = sign * bend_rad[:, :4].reshape(count, 12)
        thumb = slice(15 * hand + 12, 15 * hand + 15)
        turns[:, thumb, 2] = -sign * bend_rad[:, 4]
        turns[:, thumb, 1] = 0.4 * bend_rad[:, 4]
    return np.asarray(Rotation.from_rotvec(turns.reshape(-1, 3)).as_matrix().reshape(count, 30, 3, 3))
