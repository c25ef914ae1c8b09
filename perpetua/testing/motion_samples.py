"""A plausible skeleton and routes of many kinds, for tests of motion."""

import numpy as np

from perpetua.geometry.mesh import TriMesh
from perpetua.scene.actor import BODY_JOINTS, Route, Skeleton
from perpetua.scene.room import Material, Room, SceneObject

# Left half of a body of 1.7 m, metres.
_JOINTS = {
    "pelvis": (0.0, 0.0, 0.93),
    "left_hip": (0.0, 0.09, 0.90),
    "spine1": (-0.01, 0.0, 1.04),
    "left_knee": (0.01, 0.10, 0.49),
    "spine2": (-0.01, 0.0, 1.16),
    "left_ankle": (-0.02, 0.10, 0.075),
    "spine3": (0.0, 0.0, 1.22),
    "left_foot": (0.11, 0.105, 0.025),
    "neck": (-0.01, 0.0, 1.43),
    "left_collar": (0.0, 0.07, 1.36),
    "head": (0.02, 0.0, 1.52),
    "left_shoulder": (-0.01, 0.165, 1.38),
    "left_elbow": (-0.02, 0.43, 1.37),
    "left_wrist": (-0.01, 0.67, 1.37),
}
ROUTE_KINDS = ("stand", "straight", "curve", "spot", "slow", "brisk", "sideways", "backwards", "oblique", "random")


def empty_room() -> Room:
    """A bare floor of 40 by 40 metres."""
    corners_m = np.array([[-20.0, -20.0, 0.0], [20.0, -20.0, 0.0], [20.0, 20.0, 0.0], [-20.0, 20.0, 0.0]])
    mesh = TriMesh(corners_m, np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    floor = SceneObject(1, "floor", "floor", mesh, Material("grey", (0.5, 0.5, 0.5)), True, True)
    return Room("empty", "livingroom", corners_m[:, :2].copy(), 2.8, (floor,), (), None)


def sample_skeleton(height_m: float = 1.7) -> Skeleton:
    """A body of plausible proportions."""
    mirrored = {name.replace("left", "right"): (x, -y, z) for name, (x, y, z) in _JOINTS.items() if "left" in name}
    places = _JOINTS | mirrored
    joint_m = np.array([places[name] for name in BODY_JOINTS]) * height_m / 1.7
    contact_m = np.array([[-0.07, 0.1, 0.0], [0.15, 0.11, 0.0], [-0.07, -0.1, 0.0], [0.15, -0.11, 0.0]])
    return Skeleton(joint_m, contact_m * height_m / 1.7)


def sample_route(kind: str, fps: float, seconds: float = 4.5, actor: int = 0) -> Route:
    """A route of a kind, the same curve at any frame rate."""
    time_s = np.linspace(0.0, seconds, 2001)
    along_rad, speed_mps, heading_rad = np.zeros(2001), np.zeros(2001), np.zeros(2001)
    ramp = np.clip((time_s - 0.8) / 0.6, 0.0, 1.0) - np.clip((time_s - seconds + 1.6) / 0.6, 0.0, 1.0)
    if kind == "straight":
        speed_mps = 1.2 * ramp
    elif kind == "curve":
        speed_mps, heading_rad = np.full(2001, 1.1), 1.1 * np.sin(1.3 * time_s)
    elif kind == "spot":
        heading_rad = np.cumsum(1.2 * ramp) * (time_s[1] - time_s[0])
    elif kind == "slow":
        speed_mps, heading_rad = np.full(2001, 0.35), 0.25 * time_s
    elif kind == "brisk":
        speed_mps = np.full(2001, 1.8)
    elif kind == "sideways":
        speed_mps, along_rad = 0.4 * ramp, np.full(2001, 0.5 * np.pi)
    elif kind == "backwards":
        speed_mps, along_rad = 0.5 * ramp, np.full(2001, np.pi)
    elif kind == "oblique":
        speed_mps, along_rad = 1.4 * ramp, np.full(2001, -0.6)
    elif kind == "random":
        speed_mps = 0.75 + 0.7 * np.sin(1.7 * time_s) * np.cos(0.6 * time_s + actor)
        heading_rad = 1.5 * np.sin(0.9 * time_s + actor) + 0.5 * np.sin(2.3 * time_s)
    step_m = speed_mps[:, None] * np.stack([np.cos(heading_rad + along_rad), np.sin(heading_rad + along_rad)], axis=1)
    place_m = np.cumsum(step_m, axis=0) * (time_s[1] - time_s[0])
    frames_s = np.arange(max(2, round(seconds * fps))) / fps
    x_m, y_m, frame_rad = (np.interp(frames_s, time_s, row) for row in (place_m[:, 0], place_m[:, 1], heading_rad))
    return Route(actor, np.stack([x_m, y_m, np.zeros(len(frames_s))], axis=1), frame_rad)
