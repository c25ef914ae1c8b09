"""What every body model must keep: one suite for all.

A model that needs files has a sample, which makes them and returns the config that uses them.
"""

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from perpetua.actors.bodies.source import BODY_MODELS, Body
from perpetua.actors.config import ActorsConfig
from perpetua.scene.actor import BODY_JOINTS, BODY_PARENTS, BodyMotion
from perpetua.seeding import StageSeed
from perpetua.testing.chosen import names_of, samples_of

SEED = StageSeed(seed=3, room=1, stage="actors")
CONFIGS: dict[str, ActorsConfig] = {}


@pytest.fixture(scope="module", autouse=True)
def _configs(package: str, no_assets: Path) -> None:
    samples = samples_of(package, "BODY_SAMPLES")
    for model in names_of(BODY_MODELS, package):
        folder = no_assets / model
        folder.mkdir()
        CONFIGS[model] = samples[model](folder) if model in samples else ActorsConfig(body=model)
        assert CONFIGS[model].body == model


@lru_cache(maxsize=8)
def body(model: str, actor: int) -> Body:
    return BODY_MODELS[model]().draw(actor, CONFIGS[model], SEED)


def still(person: Body, world_from_joint: np.ndarray, pelvis_m: np.ndarray) -> BodyMotion:
    frames = len(pelvis_m)
    return BodyMotion(0, 24.0, world_from_joint, pelvis_m, np.zeros((frames, 4), dtype=bool))


def t_pose(person: Body) -> BodyMotion:
    return still(person, np.tile(np.eye(3), (1, 22, 1, 1)), person.skeleton.joint_m[:1].copy())


def about_z(angle_rad: float) -> np.ndarray:
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def joint(name: str) -> int:
    return BODY_JOINTS.index(name)


def test_the_same_arguments_give_the_same_bits(model: str) -> None:
    first, again = body(model, 0), BODY_MODELS[model]().draw(0, CONFIGS[model], SEED)
    assert again.description == first.description
    assert again.pose(t_pose(again)).tobytes() == first.pose(t_pose(first)).tobytes()
    for one, two in zip(first.parts, again.parts, strict=True):
        assert one.faces.tobytes() == two.faces.tobytes() and one.uv.tobytes() == two.uv.tobytes()
        assert one.material.image is not None and two.material.image is not None
        assert np.array_equal(one.material.image, two.material.image)


def test_actors_of_a_room_differ(model: str) -> None:
    first, second = body(model, 0), body(model, 1)
    assert first.description != second.description
    assert abs(np.ptp(first.pose(t_pose(first))[0, :, 2]) - np.ptp(second.pose(t_pose(second))[0, :, 2])) > 0.01


def test_a_t_pose_faces_x_with_level_arms_and_soles_on_the_floor(model: str) -> None:
    person = body(model, 0)
    joints = person.skeleton.joint_m
    posed = person.pose(t_pose(person))[0]
    assert abs(float(posed[:, 2].min())) < 0.002
    assert np.allclose(person.skeleton.contact_m[:, 2], 0.0, atol=0.002)
    assert 1.4 < posed[:, 2].max() < 2.2
    assert joints[joint("left_wrist"), 1] > joints[joint("left_shoulder"), 1] > 0.1
    assert joints[joint("right_wrist"), 1] < joints[joint("right_shoulder"), 1] < -0.1
    for name in ("left_foot", "right_foot"):
        assert joints[joint(name), 0] - joints[joint(name.replace("foot", "ankle")), 0] > 0.08
    for side in ("left", "right"):
        arm = joints[joint(f"{side}_wrist")] - joints[joint(f"{side}_shoulder")]
        assert abs(arm[1]) / np.linalg.norm(arm) > 0.98


def test_heels_and_toes_are_points_of_the_soles(model: str) -> None:
    person = body(model, 0)
    posed = person.pose(t_pose(person))[0].astype(np.float64)
    for contact_m in person.skeleton.contact_m:
        assert np.linalg.norm(posed - contact_m, axis=1).min() < 0.06
    heel, toe = person.skeleton.contact_m[0], person.skeleton.contact_m[1]
    assert 0.10 < toe[0] - heel[0] < 0.32 and heel[1] > 0


def test_contacts_move_rigidly_with_ankle_and_foot(model: str) -> None:
    person = body(model, 0)
    joints, contacts = person.skeleton.joint_m, person.skeleton.contact_m
    rotation = np.tile(np.eye(3), (1, 22, 1, 1))
    tilt = np.array([[np.cos(0.4), 0.0, np.sin(0.4)], [0.0, 1.0, 0.0], [-np.sin(0.4), 0.0, np.cos(0.4)]])
    rotation[0, joint("left_ankle")] = tilt
    rotation[0, joint("left_foot")] = tilt
    rest = person.pose(t_pose(person))[0].astype(np.float64)
    posed = person.pose(still(person, rotation, joints[:1].copy()))[0].astype(np.float64)
    for contact_m in contacts[:2]:
        near = np.argsort(np.linalg.norm(rest - contact_m, axis=1))[:6]
        wanted = joints[joint("left_ankle")] + (rest[near] - joints[joint("left_ankle")]) @ tilt.T
        assert np.abs(posed[near] - wanted).max() < 0.003


def test_turning_and_moving_the_whole_body_turns_and_moves_every_vertex(model: str) -> None:
    person = body(model, 0)
    rest = person.pose(t_pose(person))[0].astype(np.float64)
    turn, shift = about_z(1.1), np.array([0.7, -0.4, 0.0])
    pelvis_m = (person.skeleton.joint_m[:1] @ turn.T) + shift
    posed = person.pose(still(person, np.tile(turn, (1, 22, 1, 1)), pelvis_m))[0]
    assert np.abs(posed - (rest @ turn.T + shift)).max() < 1e-5


def test_a_frame_does_not_depend_on_the_others(model: str) -> None:
    person = body(model, 0)
    rng = np.random.default_rng(0)
    turns = np.stack([np.stack([about_z(angle) for angle in rng.normal(0.0, 0.2, 22)]) for _ in range(3)])
    pelvis_m = rng.normal(0.0, 1.0, (3, 3))
    together = person.pose(still(person, turns, pelvis_m))
    alone = person.pose(still(person, turns[1:2], pelvis_m[1:2]))
    assert together[1].tobytes() == alone[0].tobytes()


@pytest.mark.parametrize("actor", [0, 1])
def test_people_are_dressed(model: str, actor: int) -> None:
    person = body(model, actor)
    posed = person.pose(t_pose(person))[0]
    skin = np.concatenate([part.faces for part in person.parts if part.name == "body"])
    centre = posed[skin].mean(axis=1)
    joints = person.skeleton.joint_m
    trunk = (centre[:, 2] > joints[joint("left_hip"), 2] - 0.1) & (centre[:, 2] < joints[joint("spine3"), 2])
    assert not np.any(trunk & (np.abs(centre[:, 1]) < 0.15)), "skin shows on the trunk"
    assert not np.any(centre[:, 2] < 0.03), "a foot shows"
    assert len(person.parts) >= 5


def test_parts_use_every_vertex_and_have_real_textures(model: str) -> None:
    person = body(model, 0)
    count = person.pose(t_pose(person)).shape[1]
    faces = np.concatenate([part.faces for part in person.parts])
    assert np.array_equal(np.unique(faces), np.arange(count))
    assert 10_000 < count < 50_000
    for part in person.parts:
        assert part.uv.shape == (len(part.faces), 3, 2) and np.isfinite(part.uv).all()
        assert np.all(part.faces[:, 0] != part.faces[:, 1])
        assert part.material.image is not None and part.material.image.astype(float).std() > 1.0, part.name


def test_the_skeleton_is_a_tree_of_human_size(model: str) -> None:
    joints = body(model, 0).skeleton.joint_m
    lengths = [
        np.linalg.norm(joints[index] - joints[parent]) for index, parent in enumerate(BODY_PARENTS) if parent >= 0
    ]
    assert min(lengths) > 0.02 and max(lengths) < 0.6
