"""SMPL-X model files and bodies: posed as the smplx package poses them, opened without running anything of theirs."""

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation

from perpetua.actors.bodies.assembly import draw_bodies
from perpetua.actors.bodies.smplx_clothes import Cut, cut_parts
from perpetua.actors.bodies.smplx_model import (
    load_model,
    local_rotations,
    posed_m,
    rest_joints_m,
    shaped_m,
    usable_betas,
)
from perpetua.actors.config import ActorsConfig, ClothingConfig, SmplxConfig
from perpetua.errors import AssetError
from perpetua.scene.actor import BODY_PARENTS, BodyMotion
from perpetua.seeding import StageSeed
from perpetua.testing.smplx_files import joints_m, model_arrays, write_model

BARE_HANDS = np.tile(np.eye(3), (30, 1, 1))
SEED = StageSeed(4, 0, "bodies")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("smplx")
    write_model(place / "SMPLX_NEUTRAL.npz")
    return place


def random_pose(frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Rotation vectors of all 55 joints in SMPL-X's axes, jaw and eyes at rest, and places of the pelvis."""
    rng = np.random.default_rng(5)
    vectors = rng.normal(0.0, 0.35, (frames, 55, 3))
    vectors[:, 22:25] = 0.0
    return vectors, rng.normal(0.0, 1.0, (frames, 3))


def as_motion(vectors: np.ndarray, pelvis_m: np.ndarray) -> BodyMotion:
    """The same pose as global rotations in our axes, by forward kinematics written out here."""
    ours_from_smplx = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    local = ours_from_smplx @ Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix() @ ours_from_smplx.T
    local = local.reshape(len(vectors), 55, 3, 3)
    world = local[:, :22].copy()
    for joint in range(1, 22):
        world[:, joint] = world[:, BODY_PARENTS[joint]] @ local[:, joint]
    contacts = np.zeros((len(vectors), 4), dtype=bool)
    return BodyMotion(0, 24.0, world, pelvis_m, contacts, local[:, 25:])


def test_poses_are_those_of_the_package(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import torch
    from smplx.body_models import SMPLX

    path = folder / "SMPLX_NEUTRAL.npz"
    frames, betas = 2, np.linspace(-1.5, 1.5, 10)
    vectors, pelvis_m = random_pose(frames)
    package = SMPLX(
        str(path), gender="neutral", use_pca=False, flat_hand_mean=True, num_betas=10, batch_size=frames,
        use_face_contour=False,
    )  # fmt: skip
    capsys.readouterr()
    flat = torch.from_numpy(vectors.astype(np.float32).reshape(frames, -1))
    posed = package(
        betas=torch.from_numpy(betas.astype(np.float32)).repeat(frames, 1), global_orient=flat[:, :3],
        body_pose=flat[:, 3:66], jaw_pose=flat[:, 66:69], leye_pose=flat[:, 69:72], reye_pose=flat[:, 72:75],
        left_hand_pose=flat[:, 75:120], right_hand_pose=flat[:, 120:], expression=torch.zeros(frames, 10),
        transl=torch.zeros(frames, 3),
    )  # fmt: skip
    theirs = (posed.vertices - posed.joints[:, :1]).detach().numpy()[:, :, [2, 0, 1]] + pelvis_m[:, None]
    model = load_model(path, 10)
    motion = as_motion(vectors, pelvis_m)
    ours = posed_m(model, shaped_m(model, betas), local_rotations(motion, BARE_HANDS), pelvis_m)
    assert np.abs(ours - theirs).max() < 2e-5


def test_a_shape_stands_as_body_motion_stands(folder: Path) -> None:
    model = load_model(folder / "SMPLX_NEUTRAL.npz", 10)
    bare_m = shaped_m(model, np.zeros(10))
    assert np.allclose(rest_joints_m(model, bare_m), joints_m(), atol=1e-4)
    taller_m = shaped_m(model, np.eye(10)[0])
    assert np.allclose(taller_m, 1.03 * bare_m, atol=1e-5)


class _Trap:
    """Makes a folder when it is unpickled."""

    def __init__(self, place: Path) -> None:
        self.place = place

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.place),)


def test_nothing_of_a_file_is_run(tmp_path: Path) -> None:
    trap = np.array([_Trap(tmp_path / "sprung")], dtype=object)
    harmless = write_model(tmp_path / "extra.npz", joint2num=trap)
    assert load_model(harmless, 10).template_m.shape == (10475, 3)
    hidden = write_model(tmp_path / "hidden.npz", v_template=trap)
    with pytest.raises(AssetError, match="'v_template' as a plain array"):
        load_model(hidden, 10)
    assert not (tmp_path / "sprung").exists()


@pytest.mark.parametrize(("directions", "usable"), [(400, 300), (20, 10), (399, 10), (6, 6)])
def test_small_files_have_ten_betas(directions: int, usable: int) -> None:
    assert usable_betas(directions) == usable


def test_more_betas_than_a_file_has_are_refused_and_a_full_file_has_them(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"20 shape directions, of which 10 .* actors.smplx.betas is 16"):
        load_model(folder / "SMPLX_NEUTRAL.npz", 16)
    full = write_model(tmp_path / "full.npz", 400, posedirs=np.zeros((10475, 3, 486), dtype=np.float16))
    assert load_model(full, 300).shape_directions_m.shape == (10475, 3, 300)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"weights": np.zeros((6890, 24))}, "'weights' .* must be 10475 x 55"),
        ({"J_regressor": None}, "must hold the array 'J_regressor'"),
        ({"kintree_table": np.zeros((2, 55), dtype=int)}, "tree of joints"),
        ({"f": np.full((20908, 3), 10475)}, "from 0 to 10474"),
        ({"v_template": np.full((10475, 3), np.nan)}, "finite"),
    ],
)
def test_files_of_other_models_are_refused(tmp_path: Path, changed: dict[str, np.ndarray | None], message: str) -> None:
    path = write_model(tmp_path / "SMPLX_NEUTRAL.npz", 12, 1.0, **changed)
    with pytest.raises(AssetError, match=message) as caught:
        load_model(path, 10)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04broken"])
def test_what_is_no_archive_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "SMPLX_MALE.npz"
    path.write_bytes(content)
    with pytest.raises(AssetError, match="opens without pickle"):
        load_model(path, 10)


def test_a_folder_without_models_says_where_they_come_from(tmp_path: Path) -> None:
    config = ActorsConfig(body="smplx", smplx=SmplxConfig(folder=str(tmp_path)))
    with pytest.raises(AssetError, match=r"SMPLX_(FE)?MALE.npz or SMPLX_NEUTRAL.npz .*actors.smplx.folder"):
        draw_bodies(config, SEED)


def test_clothes_end_at_straight_lines(folder: Path) -> None:
    model = load_model(folder / "SMPLX_NEUTRAL.npz", 10)
    bare_m = shaped_m(model, np.zeros(10))
    joint_m = rest_joints_m(model, bare_m)
    surface, lifted_m = cut_parts(model, bare_m, joint_m, Cut(0.4, 0.5))
    ends_m, fraction = bare_m[surface.ends], surface.fraction[:, None].astype(np.float64)
    place_m = ends_m[:, 0] + fraction * (ends_m[:, 1] - ends_m[:, 0])
    sleeve_y_m = joint_m[16, 1] + 0.4 * (joint_m[20, 1] - joint_m[16, 1])
    top = place_m[np.unique(surface.faces[surface.labels == 5])]
    assert np.abs(top[:, 1]).max() == pytest.approx(sleeve_y_m, abs=2e-3)
    edge = np.abs(top[:, 1]) > sleeve_y_m - 0.004
    assert edge.sum() > 40
    hem_z_m = joint_m[1, 2] + 0.5 * (joint_m[7, 2] - joint_m[1, 2])
    legs = place_m[np.unique(surface.faces[surface.labels == 4])]
    assert legs[:, 2].min() == pytest.approx(hem_z_m, abs=2e-3)
    area = np.linalg.norm(_cross(place_m[surface.faces]), axis=1).sum()
    assert area == pytest.approx(np.linalg.norm(_cross(bare_m[model.faces]), axis=1).sum(), rel=1e-5)
    step_m = np.linalg.norm(lifted_m - bare_m, axis=1)
    assert 0.005 < np.median(step_m[np.unique(model.faces)]) + 0.004 < 0.02 and step_m.max() < 0.0125


def _cross(corner_m: np.ndarray) -> np.ndarray:
    return np.cross(corner_m[:, 1] - corner_m[:, 0], corner_m[:, 2] - corner_m[:, 0])


def _image(path: Path, colour: tuple[int, int, int]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    texels = np.random.default_rng(0).integers(-20, 20, (32, 32, 1)) + np.array(colour)
    Image.fromarray(texels.clip(0, 255).astype(np.uint8)).save(path)


def test_bedlam_textures_are_worn(folder: Path, tmp_path: Path) -> None:
    for sex in ("f", "m"):
        _image(tmp_path / "bald" / f"skin_{sex}_asian_01_ALB.png", (200, 150, 10 if sex == "f" else 90))
    _image(tmp_path / "gr_one" / "texture_01" / "one_diffuse.png", (20, 30, 200))
    _image(tmp_path / "gr_one" / "texture_01" / "one_normal.png", (128, 128, 255))
    config = ActorsConfig(body="smplx", count=2, smplx=SmplxConfig(folder=str(folder), textures=str(tmp_path)))
    for body in draw_bodies(config, SEED):
        image = {part.name: part.material.image for part in body.parts}
        blue = 10 if body.description.startswith("a woman") else 90
        assert image["body"] is not None and image["body"][..., 2].mean() == pytest.approx(blue, abs=15)
        for cloth in ("top", "trousers"):
            texels = image[cloth]
            assert texels is not None and texels[..., 2].mean() > 180


def test_skins_need_texture_coordinates(tmp_path: Path) -> None:
    write_model(tmp_path / "SMPLX_NEUTRAL.npz", vt=None, ft=None)
    config = ActorsConfig(body="smplx", count=1, smplx=SmplxConfig(folder=str(tmp_path)))
    assert draw_bodies(config, SEED)[0].parts[0].name == "body"
    for sex in ("f", "m"):
        _image(tmp_path / "bald" / f"skin_{sex}_ALB.png", (200, 150, 10))
    textured = config.model_copy(update={"smplx": config.smplx.model_copy(update={"textures": str(tmp_path)})})
    with pytest.raises(AssetError, match="vt and ft"):
        draw_bodies(textured, SEED)


def test_alembic_clothes_are_named_as_what_cannot_be_worn(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "it_1" / "garment.abc").parent.mkdir()
    (tmp_path / "it_1" / "garment.abc").write_bytes(b"Ogawa")
    config = ActorsConfig(body="smplx", smplx=SmplxConfig(folder=str(folder), textures=str(tmp_path)))
    with pytest.raises(AssetError, match=r"'garment\.abc' is an Alembic garment, which goes with one recorded motion"):
        draw_bodies(config, SEED)


def test_makehuman_clothes_need_the_body_they_are_bound_to() -> None:
    with pytest.raises(ValueError, match="bound to the body anny"):
        ActorsConfig(body="smplx", clothing=ClothingConfig(source="makehuman"))


def test_the_synthetic_file_has_the_true_shapes() -> None:
    arrays = model_arrays(20)
    assert arrays["v_template"].shape == (10475, 3) and arrays["f"].shape == (20908, 3)
    assert arrays["kintree_table"].shape == (2, 55) and np.allclose(arrays["weights"].sum(axis=1), 1.0)
