"""Writers of motion files, as independent of the readers as can be: matrices to Euler angles, axis-angle, names."""

import sys
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from perpetua.scene.actor import BODY_JOINTS, BODY_PARENTS, BodyMotion, Skeleton

# Y up, facing +Z at rest, from ours.
Y_UP_FROM_OURS = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


def y_up_rotations(motion: BodyMotion) -> Float64[np.ndarray, "T 22 3 3"]:
    """Global rotations of a body that is Y up and faces +Z at rest, in a Y-up world."""
    return np.asarray(Y_UP_FROM_OURS @ motion.world_from_joint @ Y_UP_FROM_OURS.T)


def local_rotations(rotation: Float64[np.ndarray, "T 22 3 3"]) -> Float64[np.ndarray, "T 22 3 3"]:
    """Rotations relative to the parent; the pelvis stays global."""
    local = rotation.copy()
    for joint, parent in enumerate(BODY_PARENTS):
        if parent >= 0:
            local[:, joint] = np.swapaxes(rotation[:, parent], 1, 2) @ rotation[:, joint]
    return local


def write_amass(path: Path, motion: BodyMotion, up: str = "z", keys: str = "smplx") -> None:
    """A file as AMASS has it (``keys`` "smplx", or "smplh" of the first generation), or BEDLAM2 ("poses")."""
    rotation = y_up_rotations(motion)
    pelvis_m = motion.pelvis_m @ Y_UP_FROM_OURS.T
    if up == "z":
        # The body model is Y up all the same: the pelvis's rotation stands it up.
        rotation, pelvis_m = Y_UP_FROM_OURS.T @ rotation, motion.pelvis_m
    pose = Rotation.from_matrix(local_rotations(rotation).reshape(-1, 3, 3)).as_rotvec().reshape(-1, 66)
    hands = np.tile(np.linspace(0.0, 0.3, 90), (len(pose), 1))
    trans = pelvis_m - np.array([0.003, -0.351, 0.012])
    if keys == "smplh":
        poses = np.concatenate([pose, hands], axis=1)
        np.savez(path, poses=poses, trans=trans, mocap_framerate=motion.fps, gender="male", betas=np.zeros(16))
    elif keys == "poses":
        poses = np.concatenate([pose, np.full((len(pose), 9), 0.1), hands], axis=1)
        np.savez(path, poses=poses, trans=trans, mocap_frame_rate=motion.fps, gender="neutral", betas=np.zeros(300))
    else:
        np.savez(
            path,
            trans=trans,
            root_orient=pose[:, :3],
            pose_body=pose[:, 3:],
            pose_hand=hands,
            betas=np.zeros(16),
            mocap_frame_rate=motion.fps,
        )


_MIXAMO = {
    "pelvis": "Hips", "spine1": "Spine", "spine2": "Spine1", "spine3": "Spine2", "neck": "Neck", "head": "Head",
    "left_collar": "LeftShoulder", "left_shoulder": "LeftArm", "left_elbow": "LeftForeArm", "left_wrist": "LeftHand",
    "left_hip": "LeftUpLeg", "left_knee": "LeftLeg", "left_ankle": "LeftFoot", "left_foot": "LeftToeBase",
}  # fmt: skip


def mixamo_name(joint: str) -> str:
    """Mixamo's name of one of our joints."""
    if joint.startswith("right"):
        return mixamo_name(joint.replace("right", "left")).replace("Left", "Right")
    return "mixamorig:" + _MIXAMO[joint]


def write_bvh(
    path: Path, motion: BodyMotion, skeleton: Skeleton, zero_pose: Float64[np.ndarray, "22 3 3"] | None = None
) -> None:
    """A Y-up BVH file in centimetres with Mixamo's names.

    ``zero_pose`` are our joints' global rotations (in the file's axes) where every rotation of the file is zero; the
    T-pose if None.
    """
    zero = np.tile(np.eye(3), (22, 1, 1)) if zero_pose is None else zero_pose
    rotation = y_up_rotations(motion) @ np.swapaxes(zero, 1, 2)
    local = local_rotations(rotation)
    pelvis_cm = 100.0 * motion.pelvis_m @ Y_UP_FROM_OURS.T
    rest_cm = 100.0 * skeleton.joint_m @ Y_UP_FROM_OURS.T
    order: list[int] = []
    lines = ["HIERARCHY", *_bvh_joint(0, rest_cm, zero, order, ""), "MOTION", f"Frames: {len(local)}"]
    lines.append(f"Frame Time: {1.0 / motion.fps:.9f}")
    angles_deg = Rotation.from_matrix(local[:, order].reshape(-1, 3, 3)).as_euler("ZXY", degrees=True)
    for place, row in zip(pelvis_cm, angles_deg.reshape(len(local), -1), strict=True):
        lines.append(" ".join(f"{value:.6f}" for value in (*place, *row)))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _bvh_joint(
    joint: int, rest_cm: Float64[np.ndarray, "22 3"], zero: Float64[np.ndarray, "22 3 3"], order: list[int], pad: str
) -> list[str]:
    order.append(joint)
    parent = BODY_PARENTS[joint]
    offset = np.zeros(3) if parent < 0 else zero[parent] @ (rest_cm[joint] - rest_cm[parent])
    head = "ROOT" if parent < 0 else "JOINT"
    place = "Xposition Yposition Zposition " if parent < 0 else ""
    lines = [
        f"{pad}{head} {mixamo_name(BODY_JOINTS[joint])}",
        pad + "{",
        f"{pad}  OFFSET {offset[0]:.6f} {offset[1]:.6f} {offset[2]:.6f}",
        f"{pad}  CHANNELS {6 if parent < 0 else 3} {place}Zrotation Xrotation Yrotation",
    ]
    children = [child for child, above in enumerate(BODY_PARENTS) if above == joint]
    for child in children:
        lines += _bvh_joint(child, rest_cm, zero, order, pad + "  ")
    if not children:
        lines += [f"{pad}  End Site", pad + "  {", f"{pad}    OFFSET 0 0 0", pad + "  }"]
    return [*lines, pad + "}"]


def install_fake_kimodo(folder: Path, motions: dict[str, BodyMotion], skeleton: Skeleton) -> Path:
    """Puts the stand-in for Kimodo into a folder, with strides cut out of walks straight along +X.

    Args:
        folder: where the program goes.
        motions: word of a prompt -> the walk it stands for; "walk" serves all other prompts.
        skeleton: bones of the walks, which become Kimodo's.
    """
    program = folder / "kimodo_gen"
    source = Path(__file__).with_name("fake_kimodo.py").read_text(encoding="utf-8")
    program.write_text(source.replace("/usr/bin/env python3", sys.executable), encoding="utf-8")
    program.chmod(0o755)
    for word, motion in motions.items():
        stands = motion.contacts[:, :2].any(axis=1)
        first, _, last = np.flatnonzero(stands[1:] & ~stands[:-1])[1:4] + 1
        pelvis_m = motion.pelvis_m[first:last] @ Y_UP_FROM_OURS.T
        steps = np.arange(last - first) / (last - first)
        offset_m = pelvis_m - np.outer(steps, [0.0, 0.0, float(motion.pelvis_m[last, 0] - motion.pelvis_m[first, 0])])
        offset_m[:, [0, 2]] -= offset_m[:, [0, 2]].mean(axis=0)
        np.savez(
            folder / f"stride_{word}.npz",
            rotation=y_up_rotations(motion)[first:last],
            offset=offset_m,
            contacts=motion.contacts[first:last],
            length=motion.pelvis_m[last, 0] - motion.pelvis_m[first, 0],
            rest=skeleton.joint_m @ Y_UP_FROM_OURS.T,
        )
    return program
