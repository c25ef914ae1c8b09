"""What every motion source keeps, on every kind of route and at every frame rate.

A source that needs files or programs has a sample, which makes them and returns the config that uses them.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from perpetua.motion.config import MotionConfig
from perpetua.motion.kinematics import contact_positions, joint_index, joint_positions
from perpetua.motion.source import MOTION_SOURCES
from perpetua.scene.actor import BodyMotion, Route
from perpetua.seeding import StageSeed
from perpetua.testing.chosen import names_of, samples_of
from perpetua.testing.motion_samples import ROUTE_KINDS, empty_room, sample_route, sample_skeleton

SEED = StageSeed(11, 2, "motion")
SKELETON = sample_skeleton()
ROOM = empty_room()
kinds = pytest.mark.parametrize("kind", ROUTE_KINDS)
rates = pytest.mark.parametrize("fps", [12.0, 24.0, 30.0])
CONFIGS: dict[str, MotionConfig] = {}


@pytest.fixture(scope="module", autouse=True)
def _configs(package: str, no_assets: Path) -> None:
    samples = samples_of(package, "MOTION_SAMPLES")
    for source in names_of(MOTION_SOURCES, package):
        folder = no_assets / source
        folder.mkdir()
        CONFIGS[source] = samples[source](folder) if source in samples else MotionConfig(source=source)
        assert CONFIGS[source].source == source


def _make(source: str, route: Route, fps: float, action: str = "walks") -> BodyMotion:
    told = replace(route, description=action)
    return MOTION_SOURCES[source]().make(told, SKELETON, ROOM, fps, CONFIGS[source], SEED)


@kinds
@rates
def test_feet_are_planted_and_the_body_follows_the_route(source: str, kind: str, fps: float) -> None:
    route = sample_route(kind, fps)
    motion = _make(source, route, fps)
    contact_m = contact_positions(motion, SKELETON)
    both = motion.contacts[1:] & motion.contacts[:-1]
    moved_m = np.linalg.norm(np.diff(contact_m, axis=0), axis=2)
    assert moved_m[both].max() < 1e-3
    assert np.abs(contact_m[..., 2][motion.contacts]).max() < 2e-3
    assert contact_m[..., 2].min() > -5e-3
    assert motion.contacts.any(axis=1).all(), "nobody flies"
    away_m = np.linalg.norm(motion.pelvis_m[:, :2] - route.position_m[:, :2], axis=1)
    assert away_m.max() < 0.15


@kinds
def test_rotations_are_rotations_and_move_smoothly(source: str, kind: str) -> None:
    fps = 60.0
    motion = _make(source, sample_route(kind, fps), fps)
    rotation = motion.world_from_joint
    assert np.allclose(rotation @ np.swapaxes(rotation, 2, 3), np.eye(3), atol=1e-9)
    assert np.allclose(np.linalg.det(rotation), 1.0)
    turn = np.swapaxes(rotation[:-1], 2, 3) @ rotation[1:]
    angle_rad = np.arccos(np.clip(0.5 * (np.trace(turn, axis1=2, axis2=3) - 1.0), -1.0, 1.0))
    assert angle_rad.max() * fps < 16.0
    assert np.abs(np.diff(motion.pelvis_m[:, 2])).max() * fps < 0.9


@kinds
def test_knees_bend_forward_and_arms_hang(source: str, kind: str) -> None:
    fps = 24.0
    motion = _make(source, sample_route(kind, fps), fps)
    joint_m = joint_positions(motion, SKELETON)
    ahead = motion.world_from_joint[:, 0, :, 0]
    for side in ("left", "right"):
        hip_m, knee_m, ankle_m, wrist_m, shoulder_m = (
            joint_m[:, joint_index(f"{side}_{name}")] for name in ("hip", "knee", "ankle", "wrist", "shoulder")
        )
        forward_m = np.sum((knee_m - 0.5 * (hip_m + ankle_m)) * ahead, axis=1)
        assert forward_m.min() > 0.0
        assert np.all(wrist_m[:, 2] < shoulder_m[:, 2] - 0.3)
        outward = (joint_m[:, joint_index(f"{side}_hip")] - motion.pelvis_m)[:, :2]
        assert np.all(np.sum((wrist_m - motion.pelvis_m)[:, :2] * outward, axis=1) > 0.0), "arms do not cross"


def test_arms_swing_against_the_legs(source: str) -> None:
    motion = _make(source, sample_route("brisk", 24.0), 24.0)
    joint_m = joint_positions(motion, SKELETON)
    for side in ("left", "right"):
        wrist_m, ankle_m = (joint_m[:, joint_index(f"{side}_{name}")] - motion.pelvis_m for name in ("wrist", "ankle"))
        assert np.corrcoef(wrist_m[:, 0], ankle_m[:, 0])[0, 1] < -0.8


def test_frames_of_one_route_agree_at_different_rates(source: str) -> None:
    coarse = _make(source, sample_route("curve", 12.0), 12.0)
    fine = _make(source, sample_route("curve", 24.0), 24.0)
    inner = slice(4, -8)
    assert np.abs(coarse.pelvis_m - fine.pelvis_m[::2][: len(coarse.pelvis_m)])[inner].max() < 0.01


def test_the_same_arguments_give_the_same_bits_and_other_seeds_another_motion(source: str) -> None:
    route = sample_route("random", 24.0)
    first, again = _make(source, route, 24.0), _make(source, route, 24.0)
    assert first.world_from_joint.tobytes() == again.world_from_joint.tobytes()
    assert first.pelvis_m.tobytes() == again.pelvis_m.tobytes()
    other = MOTION_SOURCES[source]().make(route, SKELETON, ROOM, 24.0, CONFIGS[source], StageSeed(12, 2, "motion"))
    assert (first.contacts != other.contacts).any()


@pytest.mark.parametrize("frames", [1, 2, 3, 4])
@pytest.mark.parametrize("fps", [6.0, 24.0])
def test_short_sequences_work(source: str, frames: int, fps: float) -> None:
    whole = sample_route("curve", fps, 2.0)
    route = Route(0, whole.position_m[:frames], whole.heading_rad[:frames])
    motion = _make(source, route, fps)
    assert motion.world_from_joint.shape == (frames, 22, 3, 3) and motion.contacts.any(axis=1).all()


def test_feet_stand_on_the_height_of_the_route(source: str) -> None:
    flat = sample_route("curve", 24.0)
    raised = Route(0, flat.position_m + np.array([0.0, 0.0, 0.37]), flat.heading_rad)
    motion = _make(source, raised, 24.0)
    contact_m = contact_positions(motion, SKELETON)
    assert np.abs(contact_m[..., 2][motion.contacts] - 0.37).max() < 2e-3


def test_words_move_the_arms_and_not_the_feet(source: str) -> None:
    route = sample_route("curve", 24.0)
    plain, phone = _make(source, route, 24.0), _make(source, route, 24.0, "walks while talking on the phone")
    wrist, head = joint_index("right_wrist"), joint_index("head")
    gap_m = np.linalg.norm(np.diff(joint_positions(phone, SKELETON)[:, [wrist, head]], axis=1), axis=2)
    assert gap_m.max() < 0.3
    assert np.array_equal(plain.contacts, phone.contacts)
