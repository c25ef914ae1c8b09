"""SMPL-X, SMPL-H and SMPL motion in .npz files as AMASS, BEDLAM2 and Kimodo write them.

Sources: https://amass.is.tue.mpg.de (archive, keys of both generations of files),
https://github.com/vchoutas/smplx (order of joints; body and hand poses are axis-angle relative to the parent),
https://bedlam2.is.tue.mpg.de (``poses[T,165]``, Y up).
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from perpetua.errors import AssetError
from perpetua.motion.recorded.archive import read_arrays
from perpetua.motion.recorded.clip import OURS_FROM_Y_UP, Clip, check_clip, check_frames, is_y_up
from perpetua.scene.actor import BODY_PARENTS

# Thigh and shin of SMPL-X's mean body, metres: files give the shape, but not the model that turns it into a length.
_MEAN_LEG_M = 0.81
_RATE_KEYS = ("mocap_frame_rate", "mocap_framerate", "fps")
# Width of ``poses`` -> first column of its hands: SMPL (no fingers), SMPL-H, SMPL-X (jaw and eyes come before).
_HAND_COLUMN = {66: None, 72: None, 156: 66, 165: 75}


def read_amass(path: Path, up: str = "auto") -> Clip:
    """One motion from an AMASS-like .npz file.

    Args:
        path: holds ``trans`` with ``root_orient``, ``pose_body`` (and ``pose_hand``), or with ``poses``.
        up: "y", "z", or "auto": the axis along which the body stands.

    Raises:
        AssetError: keys are missing, shapes do not fit, or numbers are not finite.
    """
    arrays = read_arrays(path, ("trans", "root_orient", "pose_body", "pose_hand", "poses", *_RATE_KEYS))
    body, hands = _poses(arrays, path)
    check_frames(path.name, len(body))
    trans = _rows(arrays, "trans", path, 3)
    if len(trans) != len(body):
        raise AssetError(f"'{path}' has {len(trans)} rows of trans and {len(body)} of poses; they must be as many")
    for name, rows in (("trans", trans), ("poses", body), ("pose_hand", hands)):
        if rows is not None and not np.isfinite(rows).all():
            raise AssetError(f"'{path}' holds {name} that are not finite numbers: repair the file")
    from_parent = Rotation.from_rotvec(body.reshape(-1, 3)).as_matrix().reshape(-1, 22, 3, 3)
    rotation = _chain(from_parent)
    y_up = up == "y" or (up == "auto" and is_y_up(rotation[:, 0, :, 1]))
    ours_from_file = OURS_FROM_Y_UP if y_up else np.eye(3)
    fingers = None
    if hands is not None:
        bent = Rotation.from_rotvec(hands.reshape(-1, 3)).as_matrix().reshape(-1, 30, 3, 3)
        fingers = OURS_FROM_Y_UP @ bent @ OURS_FROM_Y_UP.T
    return check_clip(
        Clip(
            path.name,
            _rate(arrays, path),
            ours_from_file @ rotation @ OURS_FROM_Y_UP.T,
            # The place of the pelvis in the rest pose is missing from ``trans``: a constant, which nothing here needs.
            trans @ ours_from_file.T,
            _MEAN_LEG_M,
            finger_from_parent=fingers,
        )
    )


def _poses(
    arrays: dict[str, np.ndarray], path: Path
) -> tuple[Float64[np.ndarray, "T 66"], Float64[np.ndarray, "T 90"] | None]:
    if "poses" in arrays:
        width = arrays["poses"].shape[-1] if arrays["poses"].ndim == 2 else -1
        if width not in _HAND_COLUMN:
            raise AssetError(
                f"'{path}' has poses of shape {arrays['poses'].shape}; a row must hold {sorted(_HAND_COLUMN)} numbers"
            )
        poses, first = _rows(arrays, "poses", path, width), _HAND_COLUMN[width]
        return poses[:, :66], None if first is None else poses[:, first : first + 90]
    body = np.concatenate([_rows(arrays, "root_orient", path, 3), _rows(arrays, "pose_body", path, 63)], axis=1)
    if "pose_hand" not in arrays:
        return body, None
    hands = _rows(arrays, "pose_hand", path, 90)
    if len(hands) != len(body):
        raise AssetError(f"'{path}' has {len(hands)} rows of pose_hand and {len(body)} of pose_body")
    return body, hands


def _rows(arrays: dict[str, np.ndarray], name: str, path: Path, width: int) -> Float64[np.ndarray, "T K"]:
    if name not in arrays:
        raise AssetError(
            f"'{path}' lacks '{name}'; a clip holds trans, root_orient, pose_body and mocap_frame_rate, "
            "or trans, poses and mocap_framerate"
        )
    values = arrays[name]
    if values.ndim != 2 or values.shape[1] != width or values.dtype.kind not in "iuf":
        raise AssetError(f"'{path}' has '{name}' of shape {values.shape}, {values.dtype}; (T, {width}) is needed")
    return values.astype(np.float64)


def _rate(arrays: dict[str, np.ndarray], path: Path) -> float:
    for key in _RATE_KEYS:
        if key in arrays and arrays[key].size == 1 and arrays[key].dtype.kind in "iuf":
            return float(arrays[key].reshape(()))
    raise AssetError(f"'{path}' lacks a frame rate; one of {list(_RATE_KEYS)} must hold one number")


def _chain(from_parent: Float64[np.ndarray, "T 22 3 3"]) -> Float64[np.ndarray, "T 22 3 3"]:
    rotation = from_parent.copy()
    for joint, parent in enumerate(BODY_PARENTS):
        if parent >= 0:
            rotation[:, joint] = rotation[:, parent] @ from_parent[:, joint]
    return rotation
