"""Poses that stress clothes, and the dressed people that take them."""

import numpy as np
from scipy.spatial.transform import Rotation

from perpetua.scene.actor import BODY_JOINTS, BODY_PARENTS, BodyMotion

# Degrees about Y (negative swings what hangs down forward) and X, by joint, relative to parents.
POSES: dict[str, dict[str, tuple[float, float]]] = {
    "stride": {
        "left_hip": (-30.0, 0.0), "left_knee": (8.0, 0.0), "right_hip": (22.0, 0.0), "right_knee": (28.0, 0.0),
        "left_shoulder": (20.0, -78.0), "right_shoulder": (-22.0, 78.0), "spine2": (4.0, 0.0),
    },
    "jog": {
        "left_hip": (-50.0, 0.0), "left_knee": (70.0, 0.0), "right_hip": (18.0, 0.0), "right_knee": (45.0, 0.0),
        "left_shoulder": (35.0, -72.0), "right_shoulder": (-35.0, 72.0), "spine1": (8.0, 0.0),
    },
    "sit": {
        "left_hip": (-82.0, 0.0), "left_knee": (82.0, 0.0), "right_hip": (-82.0, 0.0), "right_knee": (82.0, 0.0),
        "left_shoulder": (-10.0, -75.0), "right_shoulder": (-10.0, 75.0),
    },
    "arms up": {"left_shoulder": (0.0, 55.0), "right_shoulder": (0.0, -55.0)},
}  # fmt: skip


def posed(name: str, pelvis_m: np.ndarray) -> BodyMotion:
    """One frame of a pose."""
    turns = np.tile(np.eye(3), (22, 1, 1))
    for joint, (about_y, about_x) in POSES[name].items():
        turn = Rotation.from_euler("xy", [about_x, about_y], degrees=True)
        turns[BODY_JOINTS.index(joint)] = turn.as_matrix()
    world = turns.copy()
    for index, parent in enumerate(BODY_PARENTS):
        if parent >= 0:
            world[index] = world[parent] @ turns[index]
    return BodyMotion(0, 24.0, world[None], pelvis_m[None], np.zeros((1, 4), dtype=bool))
