"""Fingers: the motion's, and relaxed ones."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from perpetua.actors.base import base_mesh as makehuman
from perpetua.actors.base import rig
from perpetua.actors.base.base_mesh import Traits
from perpetua.actors.base.hands import FINGER_JOINTS, makehuman_bone, parent_of, relaxed_fingers
from perpetua.scene.actor import BodyMotion


@pytest.fixture(scope="module")
def vertices_m() -> np.ndarray:
    return makehuman.shape(Traits(True, 0.7, 0.5, 0.5, 0.4, 0.3, 0.2, 0.6, 0.2), {})


def t_pose(bound: rig.BoundRig, fingers: np.ndarray | None) -> BodyMotion:
    return BodyMotion(
        0,
        24.0,
        np.tile(np.eye(3), (1, 22, 1, 1)),
        bound.tpose_joint_m[:1].copy(),
        np.zeros((1, 4), dtype=bool),
        None if fingers is None else fingers[None],
    )


FLAT = np.tile(np.eye(3), (30, 1, 1))


def heads(vertices_m: np.ndarray, fingers: np.ndarray | None) -> dict[str, np.ndarray]:
    bound = rig.bind(vertices_m)
    posed = rig.skin(bound, vertices_m, rig.base_weights(), t_pose(bound, fingers))[0].astype(np.float64)
    return dict(rig.bone_heads(posed))


def test_thirty_joints_hang_on_the_wrists() -> None:
    assert len(FINGER_JOINTS) == 30 and relaxed_fingers().shape == (30, 3, 3)
    for joint in FINGER_JOINTS:
        top = joint
        while top in FINGER_JOINTS:
            top = parent_of(top)
        assert top == f"{joint.split('_')[0]}_wrist"


def test_a_flat_hand_has_level_fingers(vertices_m: np.ndarray) -> None:
    joints = rig.bind(vertices_m).tpose_joint_m
    for joint in FINGER_JOINTS:
        if joint.endswith("1") and "thumb" not in joint:
            first, second = rig.joint_index(joint), rig.joint_index(f"{joint[:-1]}2")
            bone = joints[second] - joints[first]
            bone /= np.linalg.norm(bone)
            assert abs(bone[2]) < 0.02 and abs(bone[1]) > 0.97, joint


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
def test_relaxed_fingers_bend_towards_the_palm_the_little_one_most(
    vertices_m: np.ndarray, side: str, sign: float
) -> None:
    flat, relaxed = heads(vertices_m, FLAT), heads(vertices_m, None)
    drops = []
    for finger in ("index", "middle", "ring", "pinky"):
        tip = makehuman_bone(f"{side}_{finger}3")
        moved = relaxed[tip] - flat[tip]
        assert moved[2] < -0.008 and sign * moved[1] < -0.002, finger
        start = makehuman_bone(f"{side}_{finger}1")
        drops.append(-moved[2] / np.linalg.norm(flat[tip] - flat[start]))
    assert drops[0] < drops[1] < drops[3]


def test_one_finger_of_the_motion_moves_that_finger_alone(vertices_m: np.ndarray) -> None:
    bent = FLAT.copy()
    place = FINGER_JOINTS.index("left_middle1")
    bent[place] = Rotation.from_rotvec([-np.radians(90.0), 0.0, 0.0]).as_matrix()
    flat, after = heads(vertices_m, FLAT), heads(vertices_m, bent)
    knuckle, tip = makehuman_bone("left_middle1"), makehuman_bone("left_middle3")
    assert np.linalg.norm(after[tip] - flat[tip]) > 0.04
    down = after[tip] - flat[knuckle]
    assert down[2] / np.linalg.norm(down) < -0.9, "bent by a right angle it points down"
    for bone in ("finger2-3.L", "finger4-3.L", "finger3-3.R", "finger1-3.L"):
        assert np.linalg.norm(after[bone] - flat[bone]) < 0.004, bone


def test_fingers_turn_with_the_wrist(vertices_m: np.ndarray) -> None:
    bound = rig.bind(vertices_m)
    still = t_pose(bound, None)
    turned = still.world_from_joint.copy()
    wrist = rig.joint_index("left_wrist")
    turn = Rotation.from_rotvec([0.3, 0.0, 0.5]).as_matrix()
    turned[0, wrist] = turn
    before, after = rig.world_rotations(still), rig.world_rotations(replace(still, world_from_joint=turned))
    for joint in FINGER_JOINTS[:15]:
        index = rig.joint_index(joint)
        assert np.allclose(after[0, index], turn @ before[0, index])
