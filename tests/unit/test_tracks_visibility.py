"""Which points are visible: cases with a known answer, and an exact ray cast over a whole scene."""

import numpy as np
import pytest
import trimesh
from synthetic_scene import make_scene, tri
from synthetic_sequence import make_scene_tracks

from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.pinhole import Intrinsics, inside_image, project
from perpetua.geometry.raycast import Caster
from perpetua.tracks.config import TracksConfig
from perpetua.tracks.sides import ClosedSides, closed_sides
from perpetua.tracks.surface import plane_barycentric
from perpetua.tracks.visibility import ViewFrame, visible_in_frame

CONFIG = TracksConfig()
CAMERA = Intrinsics.centred(64, 48, 1.2)


def slanted_wall(slope: float) -> tuple[np.ndarray, np.ndarray, ViewFrame]:
    """A plane z = 3 + slope * x that fills the view of a camera at the origin, and 500 points on it."""
    columns = np.broadcast_to(np.arange(64.0), (48, 64))
    ray_x = (columns - CAMERA.cx_px) / CAMERA.fx_px
    depth_m = 3.0 / (1.0 - slope * ray_x)
    rng = np.random.default_rng(0)
    pixel = rng.random((500, 2)) * [64, 48] - 0.5
    rays = (pixel - [CAMERA.cx_px, CAMERA.cy_px]) / [CAMERA.fx_px, CAMERA.fy_px]
    depth_at = 3.0 / (1.0 - slope * rays[:, 0])
    points = np.stack([rays[:, 0] * depth_at, rays[:, 1] * depth_at, depth_at], axis=1)
    corners = points[:, None] + np.array([[0, 0, 0], [0.01, 0, 0.01 * slope], [0, 0.01, 0]])
    seen = ViewFrame(np.eye(4), CAMERA, depth_m.astype(np.float32), np.full((48, 64), 7, np.uint16))
    return points, corners, seen


def open_sides(count: int) -> ClosedSides:
    return ClosedSides(np.zeros(count, bool), np.zeros((count, 2, 3)))


def visible(points: np.ndarray, corners: np.ndarray, seen: ViewFrame, config: TracksConfig = CONFIG) -> np.ndarray:
    index = np.full(len(points), 7, np.int32)
    return visible_in_frame(points, corners, index, open_sides(len(points)), seen, config)


@pytest.mark.parametrize("slope", [0.0, 0.9, -1.3])
def test_slanted_surfaces_are_visible_within_a_tenth_of_a_millimetre(slope: float) -> None:
    sharp = TracksConfig(tolerance_m=1e-4, tolerance_share=0.0, behind_m=1e-4, behind_share=0.0)
    points, corners, seen = slanted_wall(slope)
    assert visible(points, corners, seen, sharp).all()


def test_a_surface_half_a_pixel_or_a_ray_length_off_is_not() -> None:
    sharp = TracksConfig(tolerance_m=1e-3, tolerance_share=0.0, behind_m=1e-3, behind_share=0.0)
    points, corners, seen = slanted_wall(-1.3)
    rows, columns = np.mgrid[:48, :64]
    length = np.sqrt(((columns - 31.5) / CAMERA.fx_px) ** 2 + ((rows - 23.5) / CAMERA.fy_px) ** 2 + 1)
    for wrong_m in (np.roll(seen.depth_m, 1, axis=1), (seen.depth_m * length).astype(np.float32)):
        wrong = ViewFrame(np.eye(4), CAMERA, wrong_m, seen.object_index)
        assert visible(points, corners, wrong, sharp).mean() < 0.1


def test_covered_and_uncovered_surfaces() -> None:
    points, corners, seen = slanted_wall(0.0)
    in_front = ViewFrame(np.eye(4), CAMERA, seen.depth_m - np.float32(0.02), seen.object_index)
    assert not visible(points, corners, in_front).any(), "something 2 cm in front covers it"
    behind = ViewFrame(np.eye(4), CAMERA, seen.depth_m + np.float32(0.02), seen.object_index)
    assert visible(points, corners, behind).all(), "a surface that bends back by 2 cm at 3 m covers nothing"
    other = ViewFrame(np.eye(4), CAMERA, seen.depth_m, np.full((48, 64), 8, np.uint16))
    assert not visible(points, corners, other).any(), "another object is there"
    nothing = ViewFrame(np.eye(4), CAMERA, np.zeros((48, 64), np.float32), seen.object_index)
    assert not visible(points, corners, nothing).any()


def test_points_behind_the_camera_and_off_the_image_are_not_visible() -> None:
    points, corners, seen = slanted_wall(0.0)
    aside = np.array([9.0, 0.0, 0.0])
    assert not visible(-points, -corners, seen).any()
    assert not visible(points + aside, corners + aside, seen).any()


def test_backs_of_closed_surfaces_are_hidden_even_when_thin() -> None:
    points, corners, seen = slanted_wall(0.0)
    box = np.repeat(np.array([[[-5.0, -5.0, 2.9], [5.0, 5.0, 3.1]]]), len(points), axis=0)
    closed = ClosedSides(np.ones(len(points), bool), box)
    index = np.full(len(points), 7, np.int32)
    assert not visible_in_frame(points, corners, index, closed, seen, CONFIG).any()
    turned = corners[:, ::-1]
    assert visible_in_frame(points, turned, index, closed, seen, CONFIG).all()
    around = ClosedSides(closed.closed, np.tile([[-9.0] * 3, [9.0] * 3], (len(points), 1, 1)))
    assert visible_in_frame(points, corners, index, around, seen, CONFIG).all(), "a room is seen from inside"


def test_closed_open_and_inverted_surfaces_are_told_apart() -> None:
    ball, bowl, shell = (trimesh.creation.icosphere(subdivisions=2) for _ in range(3))
    bowl.update_faces(bowl.triangles_center[:, 2] < 0.2)
    shell.invert()
    split = trimesh.Trimesh(ball.triangles.reshape(-1, 3), np.arange(960).reshape(-1, 3), process=False)
    for mesh, closed in ((ball, True), (split, True), (bowl, False), (shell, False)):
        given = tri(mesh)
        assert (closed_sides(given.vertices_m, given.faces).closed == closed).all()
    bowl.apply_translation([5.0, 0.0, 0.0])
    both = join([tri(ball), tri(bowl)])
    sides = closed_sides(both.vertices_m, both.faces)
    assert sides.closed.sum() == len(ball.faces) and sides.closed[: len(ball.faces)].all()
    np.testing.assert_allclose(sides.box_m[0], ball.bounds, atol=1e-12)


def test_barycentric_weights_give_the_point_back() -> None:
    rng = np.random.default_rng(1)
    corners = rng.normal(size=(50, 3, 3))
    weight = rng.dirichlet(np.ones(3), 50)
    points = np.einsum("nk,nkc->nc", weight, corners)
    np.testing.assert_allclose(plane_barycentric(points, corners), weight, atol=1e-9)


def test_visibility_agrees_with_an_exact_ray_cast_away_from_edges() -> None:
    """Off silhouettes (all pixels around show one object) visibility is what a ray cast to the point says."""
    scene = make_scene()
    tracks = make_scene_tracks(scene)
    wrong = tested = hidden = 0
    for frame in range(6):
        people = [TriMesh(actor.vertices_m[frame].astype(np.float64), actor.faces) for actor in scene.actors]
        caster = Caster(join([thing.mesh for thing in scene.room.objects] + people))
        point_m = tracks.points.position_m[frame]
        for index, camera in enumerate(scene.cameras):
            origin_m = np.repeat(camera.world_from_camera[frame][None, :3, 3], len(point_m), axis=0)
            reach_m = caster.first_hit(origin_m, point_m - origin_m).distance_m
            pixel_px = tracks.views.pixel_px[index, frame]
            inside = inside_image(camera.intrinsics, pixel_px)
            truth = inside & (reach_m > np.linalg.norm(point_m - origin_m, axis=1) - 1e-3)
            shown = np.pad(scene.views[index].object_index[frame], 1, mode="edge")
            column, row = np.floor(np.where(inside[:, None], pixel_px, 0) + 0.5).astype(int).T
            around = np.stack([shown[row + y, column + x] for y in range(3) for x in range(3)])
            clear = inside & (around == around[0]).all(axis=0)
            wrong += int((truth != tracks.views.visible[index, frame])[clear].sum())
            tested += int(clear.sum())
            hidden += int((~truth & clear).sum())
    assert tested > 1500 and hidden > 30
    assert wrong / tested < 0.01, (wrong, tested)


def test_projection_uses_the_exported_values() -> None:
    scene = make_scene()
    tracks = make_scene_tracks(scene)
    point_m = tracks.points.position_m.astype(np.float32).astype(np.float64)
    pose = np.linalg.inv(scene.cameras[1].world_from_camera[2]).astype(np.float32).astype(np.float64)
    camera_m = point_m[2] @ pose[:3, :3].T + pose[:3, 3]
    expected = project(scene.cameras[1].intrinsics, camera_m)
    np.testing.assert_allclose(tracks.views.pixel_px[1, 2], expected, atol=2e-4)
