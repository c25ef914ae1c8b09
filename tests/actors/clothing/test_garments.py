"""Garments, shoes, hair and fabrics on a body."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from perpetua.actors.base import base_mesh as makehuman
from perpetua.actors.base.base_mesh import Traits, base_mesh
from perpetua.actors.base.piece import Piece
from perpetua.actors.base.rig import base_weights
from perpetua.actors.base.surface import triangles, vertex_normals
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.bodies.hair import make_hair
from perpetua.actors.bodies.hair_styles import STYLES
from perpetua.actors.clothing.fabrics import FABRICS, weave
from perpetua.actors.clothing.outfit import DYES, Dressed, draw_outfit, dress
from perpetua.actors.clothing.patterns import TopPattern, covered_by, top_field_m
from perpetua.actors.clothing.tailor import sew_top
from perpetua.scene.actor import ActorPart
from perpetua.seeding import StageSeed

BODY = slice(0, 13380)


@pytest.fixture(scope="module")
def wearer() -> Wearer:
    return Wearer(makehuman.shape(Traits(False, 0.8, 0.5, 0.8, 0.35, 0.3, 0.1, 0.2, 0.7), {}))


@pytest.fixture(scope="module")
def dressed(wearer: Wearer) -> Dressed:
    seed = StageSeed(5, 0, "actors")
    return dress(wearer, draw_outfit(0, False, seed), seed)


def outward_m(wearer: Wearer, points_m: np.ndarray) -> np.ndarray:
    """How far points are outside the skin, along its normals."""
    body = wearer.vertices_m[BODY]
    normal = vertex_normals(wearer.vertices_m, triangles(base_mesh().groups["body"].faces))[BODY]
    _, near = cKDTree(body).query(points_m)
    return np.asarray(np.sum((points_m - body[near]) * normal[near], axis=1))


def part(piece: Piece, name: str) -> ActorPart:
    return next(one for one in piece.parts if one.name == name)


def test_clothes_lie_outside_the_skin(wearer: Wearer, dressed: Dressed) -> None:
    for piece in dressed.pieces[:2]:
        used = np.unique(piece.parts[0].faces)
        distance = outward_m(wearer, piece.vertices_m[used])
        assert np.mean(distance > 0.0) > 0.99, piece.parts[0].name
        assert np.median(distance) < 0.05, "cloth stays near the body"


def test_weights_of_every_piece_sum_to_one(dressed: Dressed) -> None:
    for piece in dressed.pieces:
        assert np.allclose(piece.weights.sum(axis=1), 1.0) and piece.weights.min() >= -1e-12


@pytest.mark.parametrize("sleeve_m", [0.15, 0.45])
def test_sleeves_end_where_the_pattern_says(wearer: Wearer, sleeve_m: float) -> None:
    pattern = TopPattern(sleeve_m, 0.01, 0.055, False, "none", 0.013, 0.003)
    rng = np.random.default_rng(0)
    top = sew_top(wearer, pattern, weave("plain", DYES["red"], DYES["white"], rng), rng)
    reach = np.abs(top.vertices_m[:, 1]).max()
    wrist = np.abs(wearer.vertices_m[base_mesh().groups["joint-l-hand"].faces, 1]).max()
    elbow = np.abs(wearer.vertices_m[base_mesh().groups["joint-l-elbow"].faces, 1]).min()
    assert (reach < elbow) if sleeve_m < 0.2 else (elbow < reach < wrist + 0.03)


def test_only_covered_skin_is_hidden(wearer: Wearer) -> None:
    pattern = TopPattern(0.15, 0.01, 0.055, False, "none", 0.013, 0.003)
    field_m = top_field_m(pattern, base_mesh().vertices_m, base_weights())
    hidden = covered_by((field_m,))[BODY]
    rng = np.random.default_rng(0)
    top = sew_top(wearer, pattern, weave("plain", DYES["red"], DYES["white"], rng), rng)
    distance, _ = cKDTree(top.vertices_m).query(wearer.vertices_m[BODY][hidden])
    assert hidden.sum() > 1500 and distance.max() < 0.08
    head_z_m = wearer.vertices_m[base_mesh().groups["joint-head"].faces, 2].mean()
    assert wearer.vertices_m[BODY][hidden, 2].max() < head_z_m - 0.1


def test_shoes_stand_flat_and_enclose_the_feet(wearer: Wearer, dressed: Dressed) -> None:
    shoes = dressed.pieces[-1]
    floor = shoes.vertices_m[:, 2].min()
    assert floor == pytest.approx(dressed.footing.floor_z_m, abs=1e-9)
    assert np.allclose(dressed.footing.heel_m[:, 2], floor) and np.allclose(dressed.footing.toe_m[:, 2], floor)
    flat = np.abs(shoes.vertices_m[:, 2] - floor) < 1e-6
    assert flat.sum() > 80, "soles are flat"
    foot = wearer.vertices_m[BODY][wearer.vertices_m[BODY, 2] < wearer.vertices_m[BODY, 2].min() + 0.03]
    for axis in (0, 1):
        assert shoes.vertices_m[:, axis].max() > foot[:, axis].max()
        assert shoes.vertices_m[:, axis].min() < foot[:, axis].min()
    toes, heels = dressed.footing.toe_m, dressed.footing.heel_m
    assert np.all(toes[:, 0] > heels[:, 0] + 0.1)


def test_shoes_are_stiff_but_for_the_ball(dressed: Dressed) -> None:
    rigid = dressed.pieces[-1].weights.max(axis=1) > 0.999
    assert rigid.mean() > 0.75


@pytest.mark.parametrize("name", FABRICS)
def test_fabrics_tile_without_a_seam(name: str) -> None:
    image = weave(name, DYES["teal"], DYES["cream"], np.random.default_rng(2)).image.astype(float)
    assert image.std() > 2.0
    for axis in (0, 1):
        steps = np.abs(np.diff(image, axis=axis)).mean(axis=(1 - axis, 2))
        wrap = np.abs(np.take(image, 0, axis) - np.take(image, -1, axis)).mean()
        assert wrap <= steps.max() + 6.0, f"the {'rows' if axis == 0 else 'columns'} do not meet"


@pytest.mark.parametrize("style", sorted(STYLES))
def test_hair_sits_on_the_head_and_off_the_face(wearer: Wearer, style: str) -> None:
    hair = make_hair(wearer, STYLES[style], (0.05, 0.03, 0.02), np.random.default_rng(1))
    if style == "cropped":
        assert hair.parts == ()
        return
    eyes = wearer.vertices_m[np.unique(base_mesh().groups["helper-l-eye"].faces)].mean(axis=0)
    assert hair.vertices_m[:, 2].max() > wearer.vertices_m[BODY, 2].max()
    before_eyes = (hair.vertices_m[:, 0] > eyes[0]) & (np.abs(hair.vertices_m[:, 1]) < 0.03)
    in_sight = before_eyes & (np.abs(hair.vertices_m[:, 2] - eyes[2]) < 0.012)
    assert in_sight.mean() < 0.01
    assert np.mean(outward_m(wearer, hair.vertices_m) > -0.008) > 0.97
    assert np.allclose(hair.weights.sum(axis=1), 1.0)


def test_a_rooms_people_wear_different_tops() -> None:
    seed = StageSeed(11, 2, "actors")
    outfits = [draw_outfit(actor, actor % 2 == 0, seed) for actor in range(4)]
    assert len({outfit.top_cloth.base for outfit in outfits}) == 4
    assert len({outfit.top for outfit in outfits}) == 4
    assert outfits == [draw_outfit(actor, actor % 2 == 0, seed) for actor in range(4)]
