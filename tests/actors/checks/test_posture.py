"""Joints that bend as nobody's do, and hands in their owner's trunk, are found."""

from dataclasses import replace

import numpy as np
import pytest

from perpetua.actors.checks.penetration import bones_ending_at, make_probe
from perpetua.actors.checks.posture import hands_in_trunk, joint_excess
from perpetua.motion.config import MotionConfig
from perpetua.motion.kinematics import joint_index, joint_positions
from perpetua.motion.procedural import ProceduralMotion
from perpetua.motion.rotations import about_y, about_z
from perpetua.scene.actor import BodyMotion
from perpetua.seeding import StageSeed
from perpetua.testing.motion_samples import empty_room, sample_route, sample_skeleton
from tests.actors.checks.test_validation import _tubes

SKELETON = sample_skeleton()


def _walker(words: str = "walks") -> BodyMotion:
    route = replace(sample_route("straight", 24.0), description=words)
    return ProceduralMotion().make(route, SKELETON, empty_room(), 24.0, MotionConfig(), StageSeed(4, 0, "motion"))


@pytest.mark.parametrize("words", ["walks", "walks with arms crossed", "stretches", "talks on the phone"])
def test_people_who_move_naturally_have_no_excess(words: str) -> None:
    excess_rad, _, joint = joint_excess(_walker(words))
    assert excess_rad == 0.0 and joint == "nothing"


@pytest.mark.parametrize(
    ("parent", "joint", "turn", "named"),
    [
        ("right_hip", "right_knee", about_y(np.array([-0.5]))[0], "right knee"),
        ("left_shoulder", "left_elbow", about_z(np.array([0.5]))[0], "left elbow"),
        ("right_shoulder", "right_elbow", about_z(np.array([-0.5]))[0], "right elbow"),
    ],
)
def test_a_joint_that_bends_the_wrong_way_is_named(parent: str, joint: str, turn: np.ndarray, named: str) -> None:
    motion = _walker()
    world = motion.world_from_joint.copy()
    world[30, joint_index(joint)] = world[30, joint_index(parent)] @ turn
    excess_rad, frame, name = joint_excess(replace(motion, world_from_joint=world))
    assert name == named and frame == 30 and 0.4 < excess_rad < 0.5


def test_a_head_turned_backwards_is_named() -> None:
    motion = _walker()
    world = motion.world_from_joint.copy()
    world[12, joint_index("head")] = world[12, joint_index("spine3")] @ about_z(np.array([2.4]))[0]
    excess_rad, frame, name = joint_excess(replace(motion, world_from_joint=world))
    assert (name, frame) == ("neck", 12) and abs(excess_rad - 0.65) < 0.01


def test_a_hand_in_the_trunk_is_measured() -> None:
    motion = _walker()
    mesh = _tubes(SKELETON, motion, 0)
    joint_m = joint_positions(motion, SKELETON)
    frames = np.arange(0, 40, 8)
    probe = make_probe(mesh, joint_m, frames, mesh.vertices_m.shape[1])
    assert hands_in_trunk(mesh, probe, frames).value_m == 0.0
    hand = np.isin(probe.bone_of, bones_ending_at(("left_wrist",)))
    vertices_m = mesh.vertices_m.copy()
    # The trunk's tubes are 5 cm thick.
    middle_m = 0.5 * (joint_m[16, joint_index("spine2")] + joint_m[16, joint_index("spine1")])
    vertices_m[16, hand] = middle_m + np.array([0.0, 0.02, 0.0])
    worst = hands_in_trunk(replace(mesh, vertices_m=vertices_m), probe, frames)
    assert worst.frame == 16 and 0.015 < worst.value_m < 0.05
