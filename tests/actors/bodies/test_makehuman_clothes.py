"""MakeHuman's assets: read as the format says, fitted exactly, cut opaque, worn by suited people."""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from perpetua.actors.base.base_mesh import base_mesh
from perpetua.actors.base.rig import base_weights
from perpetua.actors.bodies.assembly import draw_bodies
from perpetua.actors.bodies.makehuman_fit import bound_weights, fitted
from perpetua.actors.bodies.source import Body
from perpetua.actors.bodies.user_files import body_listing
from perpetua.actors.clothing.mhclo import read_binding, read_mesh
from perpetua.actors.clothing.mhmat import load_look, read_material, without_transparent
from perpetua.actors.clothing.wardrobe import choose_clothes, load_wardrobe
from perpetua.actors.config import ActorsConfig, ClothingConfig
from perpetua.errors import AssetError
from perpetua.machine.assets import ASSET_FOLDER_VARIABLE, load_manifest
from perpetua.scene.actor import BODY_JOINTS, BodyMotion
from perpetua.seeding import StageSeed
from tests.support.makehuman_files import base_dm, quads_of, scale_lines, write_folder, write_garment, write_texture

SAMPLE = os.environ.get("PERPETUA_TEST_MAKEHUMAN", "")
SEED = StageSeed(3, 0, "bodies")
ROWS = "10 20 30 0.5 0.3 0.2 0.1 -0.2 0.3\n12 13 14 0.2 0.3 0.5\n17\n"


def write_binding(folder: Path, content: str) -> Path:
    place = folder / "clothes" / "thing"
    place.mkdir(parents=True, exist_ok=True)
    (place / "garment.mhclo").write_text(content)
    return place / "garment.mhclo"


def config_of(folder: Path, count: int) -> ActorsConfig:
    return ActorsConfig(count=count, clothing=ClothingConfig(source="makehuman", folder=str(folder), hat_share=0.0))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_folder(tmp_path_factory.mktemp("makehuman"))


def test_a_binding_is_read_as_written(tmp_path: Path) -> None:
    path = write_binding(
        tmp_path,
        "# comment\nbasemesh hm08\nname a thing\ntag Female\nobj_file garment.obj\nmaterial sub/garment.mhmat\n"
        f"{scale_lines()}z_depth 41\nmax_pole 8\nverts 0\n{ROWS}\ndelete_verts\n5 7 - 9 19157\n",
    )
    binding = read_binding(path, tmp_path)
    assert binding.base_vertices.tolist() == [[10, 20, 30], [12, 13, 14], [17, 17, 17]]
    assert np.allclose(binding.corner_weights, [[0.5, 0.3, 0.2], [0.2, 0.3, 0.5], [1.0, 0.0, 0.0]])
    assert np.allclose(binding.offset_dm, [[0.1, -0.2, 0.3], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert np.flatnonzero(binding.hides).tolist() == [5, 7, 8, 9, 19157]
    assert (binding.name, binding.tags, binding.depth) == ("a thing", ("female",), 41)
    assert binding.mesh_path == path.parent / "garment.obj"
    assert binding.scales[1] is not None and binding.scales[1].first == 791


@pytest.mark.parametrize("size", [1.0, 1.13])
def test_offsets_grow_with_the_body(tmp_path: Path, size: float) -> None:
    path = write_binding(tmp_path, f"obj_file t.obj\n{scale_lines()}verts 0\n{ROWS}")
    place_dm = base_dm()
    at_rest = 0.5 * place_dm[10] + 0.3 * place_dm[20] + 0.2 * place_dm[30] + np.array([0.1, -0.2, 0.3])
    made_m = fitted(read_binding(path, tmp_path), size * base_mesh().vertices_m)
    assert np.allclose(made_m[0], size * 0.1 * at_rest[[2, 0, 1]], atol=1e-7)
    assert np.allclose(made_m[2], size * base_mesh().vertices_m[17])


def test_garments_move_with_what_they_are_bound_to(tmp_path: Path) -> None:
    weights = bound_weights(read_binding(write_binding(tmp_path, f"obj_file t.obj\nverts 0\n{ROWS}"), tmp_path))
    assert np.allclose(weights.sum(axis=1), 1.0)
    assert np.allclose(weights[2], base_weights()[17])
    assert np.allclose(weights[1], np.array([0.2, 0.3, 0.5]) @ base_weights()[12:15])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("obj_file t.obj\nverts 0\n1 2 19158 1 0 0", r"line 3: a vertex .* 0 to 19157, not '19158'"),
        ("obj_file t.obj\nverts 0\n1 2 3 1 0", r"line 3: .* 1, 6 or 9 numbers"),
        ("obj_file t.obj\nverts 0\n1 2 3 1 0 nan", r"line 3: there must be a finite number, not 'nan'"),
        ("basemesh alpha7\nobj_file t.obj\nverts 0\n1", r"line 1: .* base mesh hm08, not 'alpha7'"),
        ("obj_file t.obj\nx_scale 1 2 0\nverts 0\n1", r"line 2: a scale must be"),
        ("obj_file ../../../t.obj\nverts 0\n1", r"line 1: a named file must lie in the asset folder"),
        ("obj_file /etc/passwd\nverts 0\n1", r"line 1: a named file must lie in the asset folder"),
        ("obj_file t.obj\nmaterial ../../../m.mhmat\nverts 0\n1", r"line 2: a named file must lie"),
        ("obj_file t.obj\n", r"must have a line obj_file and bound vertices"),
    ],
)
def test_broken_bindings_name_file_line_and_rule(tmp_path: Path, content: str, message: str) -> None:
    path = write_binding(tmp_path, content)
    with pytest.raises(AssetError, match=message) as caught:
        read_binding(path, tmp_path)
    assert caught.value.exit_code == 2 and "garment.mhclo" in str(caught.value)


def test_links_that_lead_outside_are_refused(tmp_path: Path) -> None:
    (tmp_path / "secret.obj").write_text("v 0 0 0\n")
    root = tmp_path / "assets"
    path = write_binding(root, "obj_file link.obj\nverts 0\n1")
    (path.parent / "link.obj").symlink_to(tmp_path / "secret.obj")
    with pytest.raises(AssetError, match=r"line 1: a named file must lie"):
        read_binding(path, root)


def test_faces_of_any_size_become_triangles(tmp_path: Path) -> None:
    path = tmp_path / "t.obj"
    corners = "".join(f"v {i} 0 {i * i}\nvt 0.{i} 0.5\n" for i in range(1, 6))
    path.write_text(f"{corners}f 1/1 2/2 3/3 4/4 5/5\nf 1 2 3\nf 1/1 1/1 2/2\n")
    mesh = read_mesh(path)
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 2]]
    assert np.allclose(mesh.uv[2], [[0.1, 0.5], [0.4, 0.5], [0.5, 0.5]]) and np.allclose(mesh.uv[3], 0.5)
    path.write_text("v 0 0 0\nv 1 0 0\nf 1 2 3\n")
    with pytest.raises(AssetError, match="line 3: a corner must name one of 2 vertices"):
        read_mesh(path)


def test_textures_may_have_another_ending_or_be_missing(tmp_path: Path) -> None:
    path = tmp_path / "m.mhmat"
    path.write_text("name m\ndiffuseColor 0.5 0.25 1\ndiffuseTexture m_diffuse.png\naomapTexture none.png\n")
    assert read_material(path, tmp_path).diffuse_path is None
    assert load_look(read_material(path, tmp_path)).colour == (0.5, 0.25, 1.0)
    write_texture(tmp_path / "m_diffuse.jpg", (10, 20, 30))
    assert load_look(read_material(path, tmp_path)).image is not None
    for line, message in (
        ("diffuseTexture ../m.png", "line 2: a named file must lie"),
        ("normalmapTexture /m.png", "line 2: a named file must lie"),
        ("diffuseColor 1 1", "line 2: there must be 3 numbers"),
        ("opacity 7", "line 2: there must be 1 numbers from 0 to 1"),
    ):
        path.write_text(f"name m\n{line}\n")
        with pytest.raises(AssetError, match=message):
            read_material(path, tmp_path)
    (tmp_path / "m_diffuse.jpg").write_bytes(b"no image")
    path.write_text("diffuseTexture m_diffuse.jpg\n")
    with pytest.raises(AssetError, match="must be an image"):
        load_look(read_material(path, tmp_path))


def test_transparent_parts_are_cut_away_and_the_rest_is_opaque(tmp_path: Path) -> None:
    count = 9
    column, row = np.meshgrid(np.arange(count), np.arange(count))
    uv = np.stack([column.ravel(), row.ravel()], axis=1) / (count - 1) * 0.998 + 0.001
    corner = (row[:-1, :-1] * count + column[:-1, :-1]).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + count], 1),
            np.stack([corner + 1, corner + count + 1, corner + count], 1),
        ]
    ).astype(np.int32)
    there = np.zeros((64, 64), dtype=bool)
    there[:, 36:] = True
    cut = without_transparent(faces, uv[faces].astype(np.float32), count * count, there)
    place = uv[cut.from_old].mean(axis=1)
    assert np.allclose(place[cut.faces], cut.uv, atol=1e-6), "vertices and texture stay together"
    first, second = place[cut.faces[:, 1]] - place[cut.faces[:, 0]], place[cut.faces[:, 2]] - place[cut.faces[:, 0]]
    area = 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    assert area.sum() == pytest.approx(1.0 - 36 / 64, abs=0.04)
    assert cut.uv[..., 0].min() > 36 / 64 - 0.07 and area.min() > 0.0
    write_texture(tmp_path / "t.png", (90, 60, 30), clear_left=True)
    (tmp_path / "m.mhmat").write_text("diffuseTexture t.png\n")
    look = load_look(read_material(tmp_path / "m.mhmat", tmp_path))
    assert look.image is not None and look.there is not None and look.there.mean() == 0.5
    assert look.image[..., 2].max() < 80, "no colour from behind transparent texels"


def test_people_wear_what_suits_them(folder: Path) -> None:
    bodies = draw_bodies(config_of(folder, 2), SEED)
    again = draw_bodies(config_of(folder, 2), SEED)
    for body, same in zip(bodies, again, strict=True):
        sex, channel = ("female", 0) if body.description.startswith("a woman") else ("male", 2)
        assert f"{sex}_suit01" in body.description and "shoes01" in body.description
        parts = {part.name: part for part in body.parts}
        suit, shoes, hair, skin = (parts[name] for name in ("suit", "shoes", "hair", "body"))
        assert suit.material.image is not None and suit.material.image[..., channel].mean() > 150
        assert shoes.material.image is not None and shoes.material.image.std() > 1.0, "woven where no texture is"
        assert skin.material.image is not None
        # The folder has women's skins only, all green.
        assert (skin.material.image[100, 500, 1] > 150) == (sex == "female")
        assert hair.uv[..., 0].min() > 0.4, "the transparent half is gone"
        sole_m = body.skeleton.contact_m
        assert np.allclose(sole_m[:, 2], 0.0, atol=1e-9) and 0.10 < sole_m[1, 0] - sole_m[0, 0] < 0.32
        assert max(_sole_gaps_m(body)) < 0.008, "soles are level"
        still = _t_pose(body.skeleton.joint_m)
        assert body.pose(still).tobytes() == same.pose(still).tobytes()
        assert abs(float(body.pose(still)[0, :, 2].min())) < 0.002


def _sole_gaps_m(body: Body) -> list[float]:
    """How high the shoes are over the floor at heels and balls, standing."""
    posed = body.pose(_t_pose(body.skeleton.joint_m))[0]
    shoes = posed[np.unique(next(part.faces for part in body.parts if part.name == "shoes"))]
    gaps = []
    for contact_m in body.skeleton.contact_m:
        near = np.linalg.norm(shoes[:, :2] - contact_m[:2], axis=1) < 0.03
        gaps.append(float(shoes[near, 2].min()))
    return gaps


def _t_pose(joint_m: np.ndarray) -> BodyMotion:
    return BodyMotion(0, 24.0, np.tile(np.eye(3), (1, 22, 1, 1)), joint_m[:1].copy(), np.zeros((1, 4), dtype=bool))


def test_garments_are_told_apart_by_where_they_lie(tmp_path: Path) -> None:
    tights = "helper-tights"
    for name, quads in (
        ("blouse", quads_of(tights, 0.05, 0.50)),
        ("jeans", quads_of(tights, -0.70, 0.10)),
        ("overall", quads_of(tights, -0.70, 0.50)),
        ("boots", quads_of(tights, -0.90, -0.55)),
        ("sunhat", quads_of("helper-hair", 0.7, 1.0)),
        ("scarf", quads_of(tights, 0.45, 0.60)),
    ):
        write_garment(tmp_path / "clothes", name, quads, ("Hats",) if name == "sunhat" else ())
    wardrobe = load_wardrobe(tmp_path)
    kinds = {garment.binding.path.stem: garment.kind for garment in wardrobe.garments}
    assert kinds == {"blouse": "top", "jeans": "bottom", "overall": "suit", "boots": "shoes", "sunhat": "hat"}
    outfits = {
        tuple(garment.kind for garment in choose_clothes(wardrobe, True, actor, np.random.default_rng(0)))
        for actor in (0, 2)
    }
    assert outfits == {("suit",), ("top", "bottom")}


def test_a_folder_that_dresses_nobody_is_refused(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"there are none: point actors.clothing.folder"):
        load_wardrobe(tmp_path)
    write_garment(tmp_path / "clothes", "male_suit", quads_of("helper-tights", -0.7, 0.5))
    with pytest.raises(AssetError, match="for women, and there is none"):
        choose_clothes(load_wardrobe(tmp_path), True, 0, np.random.default_rng(0))


def test_changed_files_change_what_bodies_are_made_from(tmp_path: Path) -> None:
    write_garment(tmp_path / "clothes", "suit", quads_of("helper-tights", -0.7, 0.5))
    config = config_of(tmp_path, 1)
    before = body_listing(config)
    assert len(before) == 3 and body_listing(ActorsConfig()) == []
    write_texture(tmp_path / "clothes" / "suit" / "suit_diffuse.png", (1, 2, 3))
    assert body_listing(config) != before


def test_authors_names_may_be_in_any_encoding(tmp_path: Path) -> None:
    path = write_binding(tmp_path, "obj_file t.obj\nverts 0\n17\n")
    path.write_bytes(b"author Jos\xe9\n" + path.read_bytes())
    assert read_binding(path, tmp_path).base_vertices.tolist() == [[17, 17, 17]]
    path.write_bytes(b"\x00\xff\xfe")
    with pytest.raises(AssetError, match="must have a line obj_file"):
        read_binding(path, tmp_path)


def test_mesh_and_binding_must_agree(tmp_path: Path) -> None:
    for sex in ("male", "female"):
        path = write_garment(tmp_path / "clothes", f"{sex}_suit", quads_of("helper-tights", -0.7, 0.5))
        path.write_text(path.read_text(encoding="utf-8").replace("verts 0\n", "verts 0\n17\n"), encoding="utf-8")
    with pytest.raises(AssetError, match=r"must bind as many vertices as '(fe)?male_suit.obj' has") as caught:
        draw_bodies(config_of(tmp_path, 1), SEED)
    assert caught.value.exit_code == 2


def test_the_manifest_sees_users_assets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ASSET_FOLDER_VARIABLE, str(tmp_path))
    names = ("smplx-models", "makehuman-clothes", "bedlam2-textures")

    def present() -> list[bool]:
        entries = {asset.name: asset for asset in load_manifest()}
        return [entries[name].find() is not None for name in names]

    assert present() == [False, False, False]
    (tmp_path / "makehuman" / "clothes").mkdir(parents=True)
    (tmp_path / "bedlam2").mkdir()
    (tmp_path / "smplx").mkdir()
    (tmp_path / "smplx" / "SMPLX_NEUTRAL.npz").touch()
    assert present() == [False, True, True]
    for sex in ("MALE", "FEMALE"):
        (tmp_path / "smplx" / f"SMPLX_{sex}.npz").touch()
    assert present() == [True, True, True]


@pytest.mark.skipif(not SAMPLE, reason="PERPETUA_TEST_MAKEHUMAN names no folder of MakeHuman assets")
def test_a_real_folder_dresses_people() -> None:
    wardrobe = load_wardrobe(Path(SAMPLE))
    body_tree = cKDTree(base_mesh().vertices_m[np.unique(base_mesh().groups["body"].faces)])
    for garment in wardrobe.garments:
        assert read_mesh(garment.binding.mesh_path).vertex_count == len(garment.binding.corner_weights)
        away_m, _ = body_tree.query(fitted(garment.binding, base_mesh().vertices_m))
        assert np.median(away_m) < 0.06 and away_m.max() < 0.35, garment.binding.name
    for body in draw_bodies(config_of(Path(SAMPLE), 2), SEED):
        posed = body.pose(_t_pose(body.skeleton.joint_m))[0]
        joint_m = body.skeleton.joint_m
        skin = np.concatenate([part.faces for part in body.parts if part.name == "body"])
        centre = posed[skin].mean(axis=1)
        hips = (centre[:, 2] > joint_m[1, 2] - 0.1) & (centre[:, 2] < joint_m[BODY_JOINTS.index("spine1"), 2])
        assert not np.any(hips & (np.abs(centre[:, 1]) < 0.15)), "skin shows at the hips"
        assert not np.any(centre[:, 2] < 0.02), "a foot shows"
        assert max(_sole_gaps_m(body)) < 0.008, "soles are level"
        assert abs(float(posed[:, 2].min())) < 0.002 and 1.4 < posed[:, 2].max() < 2.2
