import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from perpetua.geometry.mesh import TriMesh, face_areas_m2, join
from perpetua.geometry.pinhole import Intrinsics, inside_image, project, unproject
from perpetua.geometry.transforms import invert_rigid, look_at, transform_points


def test_centred_camera_sees_the_axis_between_the_middle_pixels() -> None:
    camera = Intrinsics.centred(640, 480, np.deg2rad(90.0))
    np.testing.assert_allclose(project(camera, np.array([[0.0, 0.0, 3.0]])), [[319.5, 239.5]])
    # At 90 degrees the image's left edge, half a pixel beyond the first centre, is at X = -Z.
    np.testing.assert_allclose(project(camera, np.array([[-2.0, 0.0, 2.0]]))[0, 0], -0.5)


@given(st.floats(-0.5, 63.4), st.floats(-0.5, 47.4), st.floats(0.05, 50.0))
def test_unproject_inverts_project(x: float, y: float, depth_m: float) -> None:
    camera = Intrinsics(70.0, 71.0, 31.5, 23.5, 64, 48)
    point = unproject(camera, np.array([[x, y]]), np.array([depth_m]))
    assert point[0, 2] == depth_m
    np.testing.assert_allclose(project(camera, point), [[x, y]], atol=1e-9)


def test_points_behind_the_camera_have_no_pixel() -> None:
    camera = Intrinsics.centred(64, 48, 1.0)
    pixel = project(camera, np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0]]))
    assert np.isnan(pixel).all()
    assert not inside_image(camera, pixel).any()


def test_image_border_is_half_open() -> None:
    camera = Intrinsics.centred(64, 48, 1.0)
    pixel = np.array([[-0.5, 0.0], [63.5, 0.0], [63.499, 47.499], [0.0, 47.5]])
    np.testing.assert_array_equal(inside_image(camera, pixel), [True, False, True, False])


@given(st.integers(0, 1000))
def test_look_at_is_a_level_rigid_camera(seed: int) -> None:
    rng = np.random.default_rng(seed)
    position = rng.uniform(-3, 3, (5, 3))
    target = position + rng.normal(size=(5, 3)) + np.array([2.0, 0.0, 0.0])
    world_from_camera = look_at(position, target)
    rotation = world_from_camera[:, :3, :3]
    np.testing.assert_allclose(
        rotation @ np.swapaxes(rotation, 1, 2), np.broadcast_to(np.eye(3), (5, 3, 3)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0)
    np.testing.assert_allclose(rotation[:, 2, 0], 0.0, atol=1e-12)
    assert (rotation[:, 2, 1] < 0).all()
    seen = transform_points(invert_rigid(world_from_camera), target[:, None])[:, 0]
    np.testing.assert_allclose(seen[:, :2], 0.0, atol=1e-9)
    assert (seen[:, 2] > 0).all()


def test_join_keeps_triangles() -> None:
    first = TriMesh(np.eye(3), np.array([[0, 1, 2]], np.int32))
    second = TriMesh(2 * np.eye(3), np.array([[2, 1, 0]], np.int32))
    both = join([first, second])
    np.testing.assert_array_equal(both.vertices_m[both.faces[1]], second.vertices_m[second.faces[0]])
    np.testing.assert_allclose(face_areas_m2(both.vertices_m, both.faces), np.sqrt(3) / 2 * np.array([1, 4]))
    assert join([]).faces.shape == (0, 3)
