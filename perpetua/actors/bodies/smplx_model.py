"""SMPL-X model files, and their bodies posed by the smplx package.

Model: Pavlakos et al., "Expressive Body Capture" (2019), https://smpl-x.is.tue.mpg.de. Files are the licence holder's.
They are opened without pickle, so that nothing in them is run: the package's own loader allows it, and is not used.
Tensors do not leave this module.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64, Int32

from perpetua.errors import AssetError
from perpetua.io.npz import ArchiveError, NpzFile, open_npz
from perpetua.scene.actor import BODY_JOINTS, BODY_PARENTS, BodyMotion

VERTEX_COUNT, FACE_COUNT, JOINT_COUNT = 10475, 20908, 55
LEFT_EYE, RIGHT_EYE = 23, 24
_FINGERS_FROM = 25
_FINGER_PARENTS = tuple(
    parent
    for wrist, first in ((20, 25), (21, 40))
    for finger in range(5)
    for parent in (wrist, first + 3 * finger, first + 3 * finger + 1)
)
# The jaw and both eyes hang on the head; then come the fingers, left before right.
PARENTS = (*BODY_PARENTS, 15, 15, 15, *_FINGER_PARENTS)
# Of a file's shape directions the last ones are expressions: 100 of 400; smaller files hold 10 of the body's.
_FULL_DIRECTIONS, _FULL_BETAS, _SMALL_BETAS = 400, 300, 10
# SMPL-X has X to the body's left, Y up and Z forward; BodyMotion has X forward, Y to the left and Z up.
_SMPLX_FROM_OURS = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


@dataclass(frozen=True)
class SmplxModel:
    """A model file's arrays, in SMPL-X's axes; ``uv`` and ``uv_faces`` are None in files that have none."""

    path: Path
    template_m: Float32[np.ndarray, "10475 3"]
    shape_directions_m: Float32[np.ndarray, "10475 3 B"]
    pose_directions_m: Float32[np.ndarray, "486 31425"]
    joint_regressor: Float32[np.ndarray, "55 10475"]
    weights: Float32[np.ndarray, "10475 55"]
    faces: Int32[np.ndarray, "20908 3"]
    uv: Float32[np.ndarray, "U 2"] | None
    uv_faces: Int32[np.ndarray, "20908 3"] | None


def _array(path: Path, file: NpzFile, key: str) -> np.ndarray:
    if key not in file:
        raise AssetError(f"SMPL-X model file '{path}' must hold the array '{key}': download the file again")
    try:
        return file.read(key)
    except ArchiveError as error:
        raise AssetError(
            f"SMPL-X model file '{path}' must hold '{key}' as a plain array of numbers, which opens without pickle: "
            f"{error}; download the file again"
        ) from None


def _shaped(path: Path, key: str, array: np.ndarray, shape: tuple[int | None, ...]) -> np.ndarray:
    fits = len(array.shape) == len(shape) and all(
        want is None or have == want for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits or not np.issubdtype(array.dtype, np.number) or not np.isfinite(array).all():
        wanted = " x ".join("any" if want is None else str(want) for want in shape)
        raise AssetError(
            f"'{key}' of SMPL-X model file '{path}' must be {wanted} finite numbers, not {array.dtype} of shape "
            f"{array.shape}: give the SMPL-X files (SMPL and SMPL-H have other shapes)"
        )
    return array


def usable_betas(directions: int) -> int:
    """How many of a file's shape directions are the body's; the smplx package cuts to as many without an error."""
    return _FULL_BETAS if directions >= _FULL_DIRECTIONS else min(_SMALL_BETAS, directions)


def _check_betas(path: Path, directions: int, betas: int) -> None:
    usable = usable_betas(directions)
    if betas > usable:
        raise AssetError(
            f"SMPL-X model file '{path}' has {directions} shape directions, of which {usable} are the body's (files "
            f"with fewer than {_FULL_DIRECTIONS} have {_SMALL_BETAS}), and actors.smplx.betas is {betas}: set it to at "
            f"most {usable}, or give the file with {_FULL_DIRECTIONS}"
        )


def _check_tree(path: Path, kinematic_tree: np.ndarray) -> None:
    parents = _shaped(path, "kintree_table", kinematic_tree, (2, JOINT_COUNT))[0].astype(np.int64)
    if tuple(parents[1:].tolist()) != PARENTS[1:]:
        raise AssetError(f"SMPL-X model file '{path}' must have SMPL-X's tree of joints: give an unchanged file")


def _indices(path: Path, key: str, array: np.ndarray, below: int) -> Int32[np.ndarray, "20908 3"]:
    faces = _shaped(path, key, array, (FACE_COUNT, 3)).astype(np.int64)
    if faces.min() < 0 or faces.max() >= below:
        raise AssetError(f"'{key}' of SMPL-X model file '{path}' must count from 0 to {below - 1}: download it again")
    return faces.astype(np.int32)


@lru_cache(maxsize=3)
def load_model(path: Path, betas: int) -> SmplxModel:
    """Reads a model file of the smplx package's layout, keeping the first ``betas`` shape directions.

    Raises:
        AssetError: the file is missing, is not SMPL-X's, needs pickle to be opened, or has too few directions.
    """
    try:
        with open_npz(path) as file:
            return _read(path, file, betas)
    except ArchiveError as error:
        raise AssetError(
            f"SMPL-X model file '{path}' must be an .npz file that opens without pickle: {error}; get it from "
            "https://smpl-x.is.tue.mpg.de and set actors.smplx.folder to its folder"
        ) from None


def _read(path: Path, file: NpzFile, betas: int) -> SmplxModel:
    shapes = _shaped(path, "shapedirs", _array(path, file, "shapedirs"), (VERTEX_COUNT, 3, None))
    _check_betas(path, shapes.shape[2], betas)
    _check_tree(path, _array(path, file, "kintree_table"))
    poses = _shaped(path, "posedirs", _array(path, file, "posedirs"), (VERTEX_COUNT, 3, 9 * (JOINT_COUNT - 1)))
    plain = {
        key: _shaped(path, key, _array(path, file, key), shape).astype(np.float32)
        for key, shape in (
            ("v_template", (VERTEX_COUNT, 3)),
            ("J_regressor", (JOINT_COUNT, VERTEX_COUNT)),
            ("weights", (VERTEX_COUNT, JOINT_COUNT)),
        )
    }
    textured = "vt" in file and "ft" in file
    uv = _shaped(path, "vt", _array(path, file, "vt"), (None, 2)).astype(np.float32) if textured else None
    return SmplxModel(
        path,
        plain["v_template"],
        shapes[:, :, :betas].astype(np.float32),
        np.ascontiguousarray(poses.reshape(3 * VERTEX_COUNT, -1).T.astype(np.float32)),
        plain["J_regressor"],
        plain["weights"],
        _indices(path, "f", _array(path, file, "f"), VERTEX_COUNT),
        uv,
        _indices(path, "ft", _array(path, file, "ft"), len(uv)) if uv is not None else None,
    )


def in_our_axes(vectors: Float64[np.ndarray, "*shape 3"]) -> Float64[np.ndarray, "*shape 3"]:
    """SMPL-X's vectors as ours: facing +X, Z up."""
    return np.asarray(vectors @ _SMPLX_FROM_OURS)


def shaped_m(model: SmplxModel, betas: Float64[np.ndarray, " B"]) -> Float64[np.ndarray, "10475 3"]:
    """The body of these shape parameters in the T-pose, in our axes."""
    offsets = np.einsum("pdb,b->pd", model.shape_directions_m.astype(np.float64), betas)
    return in_our_axes(model.template_m + offsets)


def rest_joints_m(model: SmplxModel, vertices_m: Float64[np.ndarray, "10475 3"]) -> Float64[np.ndarray, "55 3"]:
    """The joints of a body in the T-pose."""
    return np.asarray(model.joint_regressor.astype(np.float64) @ vertices_m)


def local_rotations(
    motion: BodyMotion, relaxed_fingers: Float64[np.ndarray, "30 3 3"]
) -> Float64[np.ndarray, "T 55 3 3"]:
    """A motion as SMPL-X's pose: each joint relative to its parent, in SMPL-X's axes; jaw and eyes rest."""
    frames = len(motion.pelvis_m)
    local = np.tile(np.eye(3), (frames, JOINT_COUNT, 1, 1))
    local[:, 0] = motion.world_from_joint[:, 0]
    for joint in range(1, len(BODY_JOINTS)):
        parent_from_world = np.swapaxes(motion.world_from_joint[:, BODY_PARENTS[joint]], 1, 2)
        local[:, joint] = parent_from_world @ motion.world_from_joint[:, joint]
    fingers = motion.finger_from_parent
    local[:, _FINGERS_FROM:] = relaxed_fingers if fingers is None else fingers
    return np.asarray(_SMPLX_FROM_OURS @ local @ _SMPLX_FROM_OURS.T)


def posed_m(
    model: SmplxModel,
    vertices_m: Float64[np.ndarray, "10475 3"],
    local_rotation: Float64[np.ndarray, "T 55 3 3"],
    pelvis_m: Float64[np.ndarray, "T 3"],
) -> Float32[np.ndarray, "T 10475 3"]:
    """A shaped body in motion, in our axes: the smplx package's linear blend skinning with pose corrections.

    Args:
        model: whose weights, corrections and joints are used.
        vertices_m: the body in the T-pose, in our axes.
        local_rotation: from ``local_rotations``.
        pelvis_m: where the pelvis joint is at each frame.
    """
    import torch
    from smplx.lbs import lbs

    from perpetua.optimisation.adam import deterministic_torch

    template = torch.from_numpy((vertices_m @ _SMPLX_FROM_OURS.T).astype(np.float32))[None]
    pose = torch.from_numpy(local_rotation.astype(np.float32))
    no_betas, no_shapes = torch.zeros((1, 1)), torch.zeros((VERTEX_COUNT, 3, 1))
    tensors = tuple(
        torch.from_numpy(array) for array in (model.pose_directions_m, model.joint_regressor, model.weights)
    )
    parents = torch.tensor(PARENTS, dtype=torch.long)
    world_m = np.empty((len(pelvis_m), VERTEX_COUNT, 3), dtype=np.float32)
    with deterministic_torch(), torch.no_grad():
        # One frame at a time: memory stays small, and a frame's bits do not depend on how many others there are.
        for frame in range(len(pelvis_m)):
            vertices, joints = lbs(
                no_betas, pose[frame : frame + 1], template, no_shapes, tensors[0], tensors[1], parents, tensors[2],
                pose2rot=False,
            )  # fmt: skip
            from_pelvis_m = (vertices[0] - joints[0, :1]).numpy().astype(np.float64)
            world_m[frame] = in_our_axes(from_pelvis_m) + pelvis_m[frame]
    return world_m
