"""The signed distance field against exact distances, and its sign where it is easily wrong."""

import numpy as np
import pytest

from perpetua.cameras.field import SignedDistanceField, distance_at_m, polygon_distance_m, signed_distance_field
from perpetua.errors import CameraError
from perpetua.geometry.mesh import join
from perpetua.geometry.raycast import Caster
from perpetua.scene.room import Room
from tests.support.camera_scene import CUPBOARD_HIGH_M, CUPBOARD_LOW_M, HEIGHT_M, camera_room

VOXEL_M = 0.06


@pytest.fixture(scope="module")
def room() -> Room:
    return camera_room()


@pytest.fixture(scope="module")
def caster(room: Room) -> Caster:
    return Caster(join([obj.mesh for obj in room.objects]))


@pytest.fixture(scope="module")
def field(room: Room, caster: Caster) -> SignedDistanceField:
    return signed_distance_field(room, caster, VOXEL_M)


def test_error_is_at_most_half_a_voxel_in_free_space(field: SignedDistanceField, caster: Caster) -> None:
    points_m = np.random.default_rng(0).uniform((-2.9, -2.4, 0.1), (1.9, 2.4, HEIGHT_M - 0.1), (4000, 3))
    # Near the window the field measures to the room's boundary, which is no triangle.
    points_m = points_m[points_m[:, 1] < 1.2]
    error_m = np.abs(distance_at_m(field, points_m) - caster.closest_distance(points_m))
    assert error_m.max() <= 0.5 * VOXEL_M
    assert error_m.mean() < 0.003


def test_a_sheet_of_triangles_has_free_space_on_both_sides(field: SignedDistanceField) -> None:
    above_and_below = np.array([[0.0, 0.0, 1.2], [0.0, 0.0, 0.4], [0.0, 0.0, 0.70], [0.0, 0.0, 0.80]])
    np.testing.assert_allclose(distance_at_m(field, above_and_below), [0.45, 0.35, 0.05, 0.05], atol=0.03)


def test_inside_of_a_shut_cupboard_is_negative(field: SignedDistanceField) -> None:
    inside_m = np.random.default_rng(1).uniform(CUPBOARD_LOW_M + 0.1, CUPBOARD_HIGH_M - 0.1, (500, 3))
    assert (distance_at_m(field, inside_m) < -0.02).all()


def test_a_hole_in_the_wall_lets_nothing_out(field: SignedDistanceField) -> None:
    line = np.stack([np.zeros(9), np.linspace(2.2, 2.6, 9), np.full(9, 1.5)], axis=1)
    np.testing.assert_allclose(distance_at_m(field, line), 2.5 - line[:, 1], atol=0.03)


def test_above_the_ceiling_and_below_the_floor_is_negative(field: SignedDistanceField) -> None:
    assert (distance_at_m(field, np.array([[0.0, 1.0, HEIGHT_M + 0.06], [0.0, 1.0, -0.06]])) < 0.0).all()


def test_polygon_distance_of_an_l_shape() -> None:
    polygon_m = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 2.0], [2.0, 5.0], [0.0, 5.0]])
    points_m = np.array([[1.0, 4.0], [3.0, 1.5], [3.0, 3.0], [-1.0, 2.0], [2.5, 2.5], [1.0, 1.0]])
    expected = [1.0, 0.5, -1.0, -1.0, -0.5, 1.0]
    np.testing.assert_allclose(polygon_distance_m(polygon_m, points_m), expected, atol=1e-12)


def test_a_room_without_free_space_is_an_error(room: Room, caster: Caster) -> None:
    flat = Room("flat", "livingroom", room.floor_polygon_m, 0.05, room.objects, (), None)
    with pytest.raises(CameraError, match="needs free space"):
        signed_distance_field(flat, caster, 0.1)
