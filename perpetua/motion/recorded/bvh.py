"""A BVH file as a clip: joints by name, whatever pose the skeleton has when all its rotations are zero.

The zero pose of a BVH file is a T-pose in one collection, an A-pose in another, and in a third a figure with every
bone along one axis. Each bone is swung from the zero pose to the T-pose by the shortest turn, parents first; that
gives the rotation between the file's joint frame and ours. It is how SOMA's and LaFAN1's frames are laid out.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from perpetua.errors import AssetError
from perpetua.motion.recorded.bvh_file import BvhMotion, read_bvh
from perpetua.motion.recorded.clip import OURS_FROM_Y_UP, Clip, check_clip, fill_missing, is_y_up
from perpetua.motion.recorded.skeleton_names import NAMINGS, NameMatch, match_names
from perpetua.motion.rotations import frames_along
from perpetua.scene.actor import BODY_JOINTS, BODY_PARENTS

# Bones of our T-pose: from, to, direction, and by how much a zero pose may differ because proportions do (degrees).
_DOWN, _LEFT, _RIGHT, _UP = (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)
_TOES = (0.94, 0.0, -0.34)
_BONES: dict[str, tuple[str, tuple[float, float, float], float]] = {
    "left_hip": ("left_knee", _DOWN, 12.0), "right_hip": ("right_knee", _DOWN, 12.0),
    "left_knee": ("left_ankle", _DOWN, 12.0), "right_knee": ("right_ankle", _DOWN, 12.0),
    "left_ankle": ("left_foot", _TOES, 30.0), "right_ankle": ("right_foot", _TOES, 30.0),
    "spine1": ("spine2", _UP, 35.0), "spine2": ("spine3", _UP, 35.0), "spine3": ("neck", _UP, 35.0),
    "neck": ("head", _UP, 35.0),
    "left_collar": ("left_shoulder", _LEFT, 40.0), "right_collar": ("right_shoulder", _RIGHT, 40.0),
    "left_shoulder": ("left_elbow", _LEFT, 12.0), "right_shoulder": ("right_elbow", _RIGHT, 12.0),
    "left_elbow": ("left_wrist", _LEFT, 12.0), "right_elbow": ("right_wrist", _RIGHT, 12.0),
}  # fmt: skip
# A zero pose whose pelvis frame is this near to the file's axes is along them (sine of the angle).
_UPRIGHT = 0.2
# A collection along one axis turns legs and feet about the body's left, arms about its front.
_ARMS = ("collar", "shoulder", "elbow", "wrist")


def read_bvh_clip(path: Path, up: str = "auto") -> Clip:
    """One motion from a BVH file.

    Args:
        path: the file; its unit of length does not matter.
        up: "y", "z", or "auto": the axis along which the body stands.

    Raises:
        AssetError: not a valid BVH file, or a skeleton whose joints are not known.
    """
    motion = read_bvh(path)
    match = match_names([joint.name for joint in motion.joints])
    if match.missing:
        known = ", ".join(naming.name for naming in NAMINGS)
        raise AssetError(
            f"'{path}' has a skeleton that is not known (nearest: {match.naming.name}); it lacks the joints "
            f"{list(match.missing)}: rename its joints as one of {known} has them"
        )
    head_m = motion.position[:, match.index["head"]] - motion.position[:, match.index["pelvis"]]
    y_up = up == "y" or (up == "auto" and is_y_up(head_m))
    ours_from_file = OURS_FROM_Y_UP if y_up else np.eye(3)
    rest = motion.rest_position @ ours_from_file.T
    zero_pose = _zero_pose(rest, match, path)
    known_joints = {
        name: ours_from_file @ motion.rotation[:, match.index[name]] @ ours_from_file.T @ zero_pose[name]
        for name in BODY_JOINTS
        if name in match.index
    }
    return check_clip(
        Clip(
            path.name,
            motion.fps,
            fill_missing(known_joints),
            motion.position[:, match.index["pelvis"]] @ ours_from_file.T,
            _leg(motion, match),
        )
    )


def _leg(motion: BvhMotion, match: NameMatch) -> float:
    hip, knee, ankle = (motion.rest_position[match.index[f"left_{name}"]] for name in ("hip", "knee", "ankle"))
    return float(np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))


def _zero_pose(rest: Float64[np.ndarray, "J 3"], match: NameMatch, path: Path) -> dict[str, Float64[np.ndarray, "3 3"]]:
    """How each of our joints, from our T-pose, is turned when every rotation of the file is zero."""
    place = {name: rest[index] for name, index in match.index.items()}
    turned = {"pelvis": _pelvis_frame(place, path)}
    for joint, parent in enumerate(BODY_PARENTS):
        name = BODY_JOINTS[joint]
        if parent < 0:
            continue
        # Collar bones point where they may: arms are turned from the chest.
        above = turned["spine3" if name.endswith("shoulder") else BODY_JOINTS[parent]]
        end = _BONES[name][0] if name in _BONES else ""
        if name not in place or end not in place or np.linalg.norm(place[end] - place[name]) < 1e-9:
            turned[name] = above
            continue
        _, direction, tolerance_deg = _BONES[name]
        spare = above @ np.array([1.0, 0.0, 0.0] if name.partition("_")[2] in _ARMS else [0.0, 1.0, 0.0])
        swing = _swing(above @ np.array(direction), place[end] - place[name], spare, tolerance_deg)
        turned[name] = swing @ above
    return turned


def _pelvis_frame(place: dict[str, Float64[np.ndarray, "3"]], path: Path) -> Float64[np.ndarray, "3 3"]:
    spine = [name for name in ("spine1", "spine2", "spine3", "neck", "head") if name in place]
    up = place[spine[-1]] - place["pelvis"]
    left = place["left_hip"] - place["right_hip"]
    if np.linalg.norm(np.cross(up, left)) < 1e-6 * float(np.linalg.norm(up)):
        raise AssetError(f"'{path}': hips and spine of the skeleton lie on one line; no front can be told")
    columns = frames_along(left[None], up[None])[0]
    frame = np.stack([np.cross(columns[:, 0], columns[:, 1]), columns[:, 0], columns[:, 1]], axis=1)
    # A head somewhat before the pelvis is how people are built, not how they are turned.
    upright = np.rint(frame)
    return upright if np.abs(frame - upright).max() < _UPRIGHT else frame


def _swing(
    start: Float64[np.ndarray, "3"],
    end: Float64[np.ndarray, "3"],
    spare_axis: Float64[np.ndarray, "3"],
    tolerance_deg: float,
) -> Float64[np.ndarray, "3 3"]:
    """The shortest turn from one direction to another; about ``spare_axis`` where they are opposite."""
    first, second = start / np.linalg.norm(start), end / np.linalg.norm(end)
    angle_rad = float(np.arccos(np.clip(first @ second, -1.0, 1.0)))
    if np.rad2deg(angle_rad) < tolerance_deg:
        return np.eye(3)
    axis = np.cross(first, second)
    axis = spare_axis if np.rad2deg(angle_rad) > 170.0 else axis / np.linalg.norm(axis)
    return np.asarray(Rotation.from_rotvec(angle_rad * axis).as_matrix())
