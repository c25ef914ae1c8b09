"""The body that clothes are made for, and places on the base mesh by which patterns are drawn."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float64, Int32
from scipy import sparse

from perpetua.actors.base.base_mesh import base_mesh
from perpetua.actors.base.hands import FINGER_JOINTS
from perpetua.actors.base.piece import Surface
from perpetua.actors.base.rig import base_weights, joint_index, rest_joints
from perpetua.actors.base.surface import catmull_clark, triangles

_ARM = ("shoulder", "elbow", "forearm", "wrist")


@dataclass(frozen=True)
class Wearer:
    """A shaped body: all base mesh vertices in MakeHuman's rest pose, helper geometry included."""

    vertices_m: Float64[np.ndarray, "P 3"]


def weight_of(weights: Float64[np.ndarray, "P J"], joints: tuple[str, ...]) -> Float64[np.ndarray, " P"]:
    """Skinning weight of the named joints of both sides together."""
    columns = [joint_index(f"{side}_{joint}") for side in ("left", "right") for joint in joints]
    return np.asarray(weights[:, columns].sum(axis=1))


def arm_weight(weights: Float64[np.ndarray, "P J"]) -> Float64[np.ndarray, " P"]:
    """How much a vertex belongs to an arm, fingers included, 0 to 1."""
    fingers = [joint_index(joint) for joint in FINGER_JOINTS]
    return np.asarray(weight_of(weights, _ARM) + weights[:, fingers].sum(axis=1))


@lru_cache(maxsize=1)
def template_joints() -> Float64[np.ndarray, "52 3"]:
    """Joints of the unshaped base mesh."""
    return rest_joints(base_mesh().vertices_m)


def _along_m(template_m: Float64[np.ndarray, "P 3"], chain: tuple[str, str, str]) -> Float64[np.ndarray, " P"]:
    """Distance from the first joint of a left limb along its two bones; the right one is its mirror image."""
    mirrored = np.stack([template_m[:, 0], np.abs(template_m[:, 1]), template_m[:, 2]], axis=1)
    start, middle, end = (template_joints()[joint_index(f"left_{name}")] for name in chain)
    upper, lower = middle - start, end - middle
    length = float(np.linalg.norm(upper))
    upper, lower = upper / length, lower / np.linalg.norm(lower)
    beyond = (mirrored - middle) @ (upper + lower) > 0
    return np.where(beyond, length + (mirrored - middle) @ lower, (mirrored - start) @ upper)


def along_arm_m(template_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """Distance from the shoulder along upper arm and forearm on the base mesh; both arms alike."""
    return _along_m(template_m, ("shoulder", "elbow", "wrist"))


def along_leg_m(template_m: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, " P"]:
    """Distance from the hip along thigh and shin on the base mesh; both legs alike. The ankle is at 0.81 m."""
    return _along_m(template_m, ("hip", "knee", "ankle"))


@lru_cache(maxsize=4)
def _refined_group(group: str) -> tuple[sparse.csr_matrix, Int32[np.ndarray, "F 3"], Int32[np.ndarray, " V"]]:
    quads = base_mesh().groups[group].faces
    used, local = np.unique(quads, return_inverse=True)
    operator, refined = catmull_clark(local.reshape(-1, 4), len(used))
    return operator, triangles(refined), used.astype(np.int32)


def refined_group(wearer: Wearer, group: str) -> Surface:
    """A helper of the base mesh, subdivided once, on this body."""
    operator, faces, used = _refined_group(group)
    return Surface(
        np.asarray(operator @ base_mesh().vertices_m[used]),
        np.asarray(operator @ wearer.vertices_m[used]),
        np.asarray(operator @ base_weights()[used]),
        faces,
    )
