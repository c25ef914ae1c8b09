"""Joints, sole points, two-bone chains, and how a foot rolls."""

import numpy as np
import pytest

from perpetua.motion.feet import FootShape, foot_track
from perpetua.motion.footsteps import Plant, step_timing
from perpetua.motion.ground import Ground
from perpetua.motion.kinematics import contact_positions, joint_positions, solve_two_bones
from perpetua.scene.actor import BodyMotion
from perpetua.testing.motion_samples import empty_room, sample_skeleton


def test_the_rest_pose_puts_every_joint_where_the_skeleton_has_it() -> None:
    skeleton = sample_skeleton()
    rest = BodyMotion(0, 24.0, np.tile(np.eye(3), (1, 22, 1, 1)), skeleton.joint_m[:1], np.ones((1, 4), bool))
    assert np.allclose(joint_positions(rest, skeleton)[0], skeleton.joint_m)
    assert np.allclose(contact_positions(rest, skeleton)[0], skeleton.contact_m)


def test_two_bones_reach_their_target_and_bend_to_the_wanted_side() -> None:
    rng = np.random.default_rng(3)
    upper_m, lower_m = np.array([0.01, 0.02, -0.41]), np.array([-0.03, 0.0, -0.40])
    root_m, bend = rng.normal(size=(50, 3)), np.tile([1.0, 0.0, 0.0], (50, 1))
    downwards = np.column_stack([rng.uniform(-0.4, 0.4, (50, 2)), rng.uniform(-1.0, -0.5, 50)])
    target_m = root_m + downwards / np.linalg.norm(downwards, axis=1)[:, None] * rng.uniform(0.2, 0.8, (50, 1))
    bones = solve_two_bones(root_m, target_m, bend, upper_m, lower_m, np.array([1.0, 0.0, 0.0]))
    knee_m = root_m + bones.world_from_upper @ upper_m
    assert np.allclose(knee_m + bones.world_from_lower @ lower_m, target_m, atol=1e-9)
    for rotation in (bones.world_from_upper, bones.world_from_lower):
        assert np.allclose(rotation @ np.swapaxes(rotation, 1, 2), np.eye(3), atol=1e-9)
        assert np.allclose(np.linalg.det(rotation), 1.0)
    along = (target_m - root_m) / np.linalg.norm(target_m - root_m, axis=1)[:, None]
    out_m = knee_m - root_m - np.sum((knee_m - root_m) * along, axis=1)[:, None] * along
    assert np.all(out_m[:, 0] > 0)


def test_a_target_out_of_reach_is_approached_as_far_as_the_chain_goes() -> None:
    bones = solve_two_bones(
        np.zeros((1, 3)),
        np.array([[0.0, 0.0, -2.0]]),
        np.array([[1.0, 0.0, 0.0]]),
        np.array([0.0, 0.0, -0.4]),
        np.array([0.0, 0.0, -0.4]),
        np.array([1.0, 0.0, 0.0]),
    )
    assert np.allclose(bones.end_m, [[0.0, 0.0, -0.8]], atol=1e-6)


def test_step_timing_agrees_with_measured_gait() -> None:
    # Adults at 1.3 m/s take 100 to 125 steps a minute and stand on a foot for 58 to 65% of the cycle.
    normal = step_timing(1.3, 0.0, 0.9, 1.0)
    assert 100 < 120 / normal.cycle_s < 125
    assert 0.58 < normal.support_s / normal.cycle_s < 0.65
    slow = step_timing(0.7, 0.0, 0.9, 1.0)
    assert slow.cycle_s > normal.cycle_s and slow.support_s / slow.cycle_s > normal.support_s / normal.cycle_s
    assert step_timing(0.0, 1.5, 0.9, 1.0).cycle_s < step_timing(0.0, 0.0, 0.9, 1.0).cycle_s


@pytest.mark.parametrize("stride_m", [0.0, 0.5, 1.4])
def test_a_foot_moves_without_jumps_and_its_contacts_do_not_move(stride_m: float) -> None:
    shape = FootShape(0.08, np.array([-0.05, 0.0, -0.08]), np.array([0.13, 0.0, -0.055]), np.array([0.17, 0.01, -0.08]))
    plants = (
        Plant(np.array([0.0, 0.1, 0.0]), 0.1, -np.inf, 0.5, np.zeros(2)),
        Plant(np.array([stride_m, 0.1, 0.0]), 0.2, 0.9, 1.6, np.zeros(2)),
        Plant(np.array([2 * stride_m, 0.1, 0.0]), 0.2, 2.0, np.inf, np.zeros(2)),
    )
    time_s = np.linspace(-0.5, 2.5, 6001)
    track = foot_track(plants, shape, 0.02, Ground(empty_room()), time_s)
    velocity_mps = np.diff(track.ankle_m, axis=0) / (time_s[1] - time_s[0])
    assert np.linalg.norm(velocity_mps, axis=1).max() < 8.0
    assert np.abs(np.diff(track.pitch_rad)).max() / (time_s[1] - time_s[0]) < 12.0
    swinging = ~track.on_floor
    assert np.isclose(swinging.mean() * 3.0, 0.8, atol=0.01)
    flat = track.heel_contact & track.toe_contact
    assert flat.sum() > 1000 and np.all(track.pitch_rad[flat] == 0.0)
    assert (track.pitch_rad.min() < -0.1) == (stride_m > 0.4), "a long stride lands on the heel"
