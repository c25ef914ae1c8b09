"""Rays and distances against shapes with known answers and against a slow exact search."""

import subprocess
import sys

import numpy as np
import pytest
import trimesh
from jaxtyping import Float64

from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.planes import Planes
from perpetua.geometry.raycast import NO_FACE, Caster, MovingCaster


def _mesh(shape: trimesh.Trimesh) -> TriMesh:
    return TriMesh(np.asarray(shape.vertices, np.float64), np.asarray(shape.faces, np.int32))


@pytest.fixture(scope="module")
def scene() -> TriMesh:
    """A box with two balls and a thin plate inside."""
    room = trimesh.creation.box((4.0, 3.0, 2.5))
    balls = [trimesh.creation.icosphere(2, 0.4).apply_translation([x, 0.3, -0.5]) for x in (-1.0, 1.1)]
    plate = trimesh.creation.box((1.0, 0.8, 0.002)).apply_translation([0.0, -0.8, 0.2])
    return join([_mesh(shape) for shape in (room, *balls, plate)])


def _points(count: int) -> Float64[np.ndarray, "N 3"]:
    return np.random.default_rng(0).uniform((-1.9, -1.4, -1.2), (1.9, 1.4, 1.2), (count, 3))


def test_rays_hit_where_the_shape_is(scene: TriMesh) -> None:
    origins = _points(500)
    directions = np.random.default_rng(1).normal(size=(500, 3))
    hits = Caster(scene).first_hit(origins, directions)
    assert hits.hit.all()
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    along_ray = origins + hits.distance_m[:, None] * unit
    on_face = np.einsum("nk,nkd->nd", hits.barycentric, scene.vertices_m[scene.faces[hits.face]])
    np.testing.assert_allclose(along_ray, on_face, atol=2e-5)
    # Nothing stands in the way of a slightly shorter ray.
    assert Caster(scene).clear(origins, origins + (hits.distance_m[:, None] - 1e-4) * unit).all()
    assert not Caster(scene).clear(origins, origins + (hits.distance_m[:, None] + 1e-4) * unit).any()


def test_distance_along_a_ray_is_exact_in_double_precision() -> None:
    floor = TriMesh(
        np.array([[-9.0, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]]), np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    )
    origins = np.array([[0.1, 0.2, 1.7], [3.0, -2.0, 2.1]])
    directions = np.array([[0.3, 0.1, -0.5], [-1.0, 1.0, -2.0]])
    hits = Caster(floor).first_hit(origins, directions)
    expected = origins[:, 2] / -directions[:, 2] * np.linalg.norm(directions, axis=1)
    np.testing.assert_allclose(hits.distance_m, expected, rtol=1e-14)


def test_a_ray_into_the_open_hits_nothing() -> None:
    ball = _mesh(trimesh.creation.icosphere(2, 1.0))
    hits = Caster(ball).first_hit(np.array([[0.0, 0, 5]]), np.array([[0.0, 0, 2]]))
    assert hits.face.tolist() == [NO_FACE] and np.isinf(hits.distance_m).all() and not hits.hit.any()


def test_line_of_sight_stops_at_triangles_before_the_target_only() -> None:
    ball = _mesh(trimesh.creation.icosphere(3, 1.0))
    origins = np.array([[-3.0, 0, 0], [-3, 0, 0], [-3, 0, 2]])
    targets = np.array([[3.0, 0, 0], [-1.5, 0, 0], [3, 0, 2]])
    assert Caster(ball).clear(origins, targets).tolist() == [False, True, True]


def test_closest_distance_equals_an_exhaustive_search(scene: TriMesh) -> None:
    points = _points(60)
    corners = scene.vertices_m[scene.faces]
    exact = [
        np.linalg.norm(trimesh.triangles.closest_point(corners, np.repeat(p[None], len(corners), 0)) - p, axis=1).min()
        for p in points
    ]
    np.testing.assert_allclose(Caster(scene).closest_distance(points), exact, atol=2e-6)


def test_closest_point_lies_on_the_shape_at_the_distance() -> None:
    ball = _mesh(trimesh.creation.icosphere(4, 1.0))
    points = _points(50)
    caster = Caster(ball)
    closest = caster.closest_point(points)
    assert np.linalg.norm(closest, axis=1) == pytest.approx(np.ones(50), abs=0.003)
    np.testing.assert_allclose(np.linalg.norm(closest - points, axis=1), caster.closest_distance(points), atol=1e-9)
    assert np.isnan(caster.closest_point(np.zeros((1, 3)), 0.5)).all()


def test_closest_distance_is_cut_at_the_limit(scene: TriMesh) -> None:
    points = _points(200)
    caster = Caster(scene)
    full, cut = caster.closest_distance(points), caster.closest_distance(points, max_distance_m=0.2)
    assert (full > 0.2).any() and (full < 0.2).any()
    np.testing.assert_array_equal(cut[full > 0.2001], 0.2)
    np.testing.assert_allclose(cut, np.minimum(full, 0.2), atol=1e-6)


def test_an_empty_mesh_blocks_nothing() -> None:
    caster = Caster(join([]))
    origins, targets = np.zeros((1, 3)), np.ones((1, 3))
    assert caster.clear(origins, targets).all()
    assert not caster.first_hit(origins, targets).hit.any()
    assert caster.closest_distance(origins, 3.0).tolist() == [3.0]


def test_a_moving_mesh_is_met_where_it_is_now_as_embree_meets_it(scene: TriMesh) -> None:
    moving = MovingCaster(scene.vertices_m.astype(np.float32), scene.faces)
    rng = np.random.default_rng(3)
    for shift_m in (0.0, 0.7, -1.3):
        moved_m = (scene.vertices_m * (1.0 + 0.1 * shift_m) + shift_m).astype(np.float32)
        moving.move_to(moved_m)
        moved = Caster(TriMesh(moved_m.astype(np.float64), scene.faces))
        # From inside and from outside, some of them past the mesh.
        for eye_m in 1.4 * _points(4) + shift_m:
            direction = rng.normal(size=(300, 3))
            direction /= np.linalg.norm(direction, axis=1, keepdims=True)
            single = direction.astype(np.float32)
            origins = np.repeat(eye_m[None].astype(np.float32), 300, axis=0)
            found, rough = moving.meet(origins, single), moved.meet(origins, single)
            wanted = moved.first_hit(np.repeat(eye_m[None], 300, axis=0), direction)
            assert wanted.hit.sum() > 0
            for one in (found, rough):
                np.testing.assert_array_equal(one.face, wanted.face)
                np.testing.assert_allclose(one.distance_m, wanted.distance_m, rtol=1e-5)
            near = moving.meet(origins, single, np.full(300, 1.0, np.float32))
            np.testing.assert_array_equal(near.face, np.where(found.distance_m < 1.0, found.face, NO_FACE))
            hit = wanted.hit
            planes = Planes.of(moving.corner_m(found.face[hit]))
            exact_m = planes.along_m(np.repeat(eye_m[None], hit.sum(), axis=0), direction[hit], found.distance_m[hit])
            np.testing.assert_allclose(exact_m, wanted.distance_m[hit], rtol=1e-12)


def test_rays_that_meet_nothing_and_meshes_without_faces() -> None:
    ball, origins = _mesh(trimesh.creation.icosphere(2, 1.0)), np.array([[0.0, 3, 5]] * 2, np.float32)
    unit = np.array([[0.0, 0, 1], [0.0, 0, -1]], np.float32)
    empty = np.zeros((0, 3), np.int32)
    for caster in (
        MovingCaster(ball.vertices_m.astype(np.float32), ball.faces),
        MovingCaster(np.zeros((0, 3), np.float32), empty),
        Caster(ball),
        Caster(join([])),
    ):
        away = caster.meet(origins, unit)
        assert (away.face == NO_FACE).all() and np.isinf(away.distance_m).all()
        assert len(caster.meet(origins[:0], unit[:0]).face) == 0


def test_planes_along_rays() -> None:
    corner_m = np.array([[[0.0, 0, 2], [1, 0, 2], [0, 1, 2]], [[0.0, 0, 0], [0, 1, 0], [0, 0, 1]], [[1.0, 1, 1]] * 3])
    planes = Planes.of(corner_m)
    np.testing.assert_array_equal(planes.normal, [[0, 0, 1], [1, 0, 0], [0, 0, 0]])
    eye_m = np.array([[0.3, 0.0, 5.0]] * 3)
    assert planes.height_m(eye_m).tolist() == [3.0, 0.3, 0.0]
    down = np.array([[0.0, 0, -1], [0.0, 0, -1], [0.0, 0, -1]])
    # The second ray runs along its plane, and the third triangle has none: what was found roughly counts.
    assert planes.along_m(eye_m, down, np.full(3, 9, np.float32)).tolist() == [3.0, 9.0, 9.0]


def test_the_library_starts_without_a_word() -> None:
    """It would greet, and warn where there is no GPU, in the middle of what a user reads."""
    code = "import sys; from perpetua.geometry.raycast import _warp; _warp(); print('still here', file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True)
    assert (done.stdout, done.stderr) == ("", "still here\n")
