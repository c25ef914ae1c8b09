"""Which points are visible: cases with a known answer, and an exact ray cast over a whole scene."""

import dataclasses

import numpy as np
import pytest
import trimesh

from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.pinhole import Intrinsics, inside_image, project
from perpetua.geometry.planes import Planes
from perpetua.testing.synthetic_scene import make_scene, tri
from perpetua.testing.synthetic_sequence import make_scene_tracks
from perpetua.tracks.config import TracksConfig
from perpetua.tracks.pixel_neighbourhood import ViewFrame
from perpetua.tracks.points_at_frame import PointsAtFrame
from perpetua.tracks.ray_caster import HairFaces, SceneRayCaster, SceneRayHits
from perpetua.tracks.surface import SceneMeshes, plane_barycentric
from perpetua.tracks.visibility import visible_in_frame
from perpetua.tracks.watertight import WatertightFaces, watertight_faces

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
    seen = ViewFrame(0, np.eye(4), CAMERA, depth_m.astype(np.float32), np.full((48, 64), 7, np.uint16))
    return points, corners, seen


def open_sides(count: int) -> WatertightFaces:
    return WatertightFaces(np.zeros(count, bool), np.zeros((count, 2, 3)))


class ClearRayCaster(SceneRayCaster):
    """Nothing stands in any way."""

    def __init__(self) -> None:
        super().__init__(SceneMeshes.of_rigid({}))

    def first_hit(self, frame: int, eye_m: np.ndarray, directions: np.ndarray) -> SceneRayHits:
        nothing = np.zeros(len(directions), np.int32)
        return SceneRayHits(nothing, nothing, np.full(len(directions), np.inf))


def placed(points: np.ndarray, corners: np.ndarray, watertight: WatertightFaces | None = None) -> PointsAtFrame:
    count = len(points)
    index, face = np.full(count, 7, np.int32), np.arange(count, dtype=np.int32)
    return PointsAtFrame(
        points, Planes.of(corners), index, face, open_sides(count) if watertight is None else watertight
    )


def visible(
    points: np.ndarray,
    corners: np.ndarray,
    seen: ViewFrame,
    config: TracksConfig = CONFIG,
    watertight: WatertightFaces | None = None,
) -> np.ndarray:
    return visible_in_frame(placed(points, corners, watertight), [seen], ClearRayCaster(), HairFaces({}), config)[0][0]


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
        wrong = ViewFrame(0, np.eye(4), CAMERA, wrong_m, seen.object_index)
        assert visible(points, corners, wrong, sharp).mean() < 0.1


def test_covered_and_uncovered_surfaces() -> None:
    points, corners, seen = slanted_wall(0.0)
    in_front = ViewFrame(0, np.eye(4), CAMERA, seen.depth_m - np.float32(0.02), seen.object_index)
    assert not visible(points, corners, in_front).any(), "something 2 cm in front covers it"
    behind = ViewFrame(0, np.eye(4), CAMERA, seen.depth_m + np.float32(0.02), seen.object_index)
    assert visible(points, corners, behind).all(), "a surface that bends back by 2 cm at 3 m covers nothing"
    other = ViewFrame(0, np.eye(4), CAMERA, seen.depth_m, np.full((48, 64), 8, np.uint16))
    assert not visible(points, corners, other).any(), "another object is there"
    nothing = ViewFrame(0, np.eye(4), CAMERA, np.zeros((48, 64), np.float32), seen.object_index)
    assert not visible(points, corners, nothing).any()


def test_points_behind_the_camera_and_off_the_image_are_not_visible() -> None:
    points, corners, seen = slanted_wall(0.0)
    aside = np.array([9.0, 0.0, 0.0])
    assert not visible(-points, -corners, seen).any()
    assert not visible(points + aside, corners + aside, seen).any()


def test_backs_of_closed_surfaces_are_hidden_even_when_thin() -> None:
    points, corners, seen = slanted_wall(0.0)
    box = np.repeat(np.array([[[-5.0, -5.0, 2.9], [5.0, 5.0, 3.1]]]), len(points), axis=0)
    closed = WatertightFaces(np.ones(len(points), bool), box)
    assert not visible(points, corners, seen, watertight=closed).any()
    assert visible(points, corners[:, ::-1], seen, watertight=closed).all()
    around = WatertightFaces(closed.closed, np.tile([[-9.0] * 3, [9.0] * 3], (len(points), 1, 1)))
    assert visible(points, corners, seen, watertight=around).all(), "a room is seen from inside"


def test_the_inside_of_a_sleeve_is_seen_through_its_opening() -> None:
    """A wall that turns its back to the camera counts as closed, and the ray meets it first."""
    _, _, seen = slanted_wall(0.0)
    corner_m = np.array([[-9.0, -9, 3], [9, -9, 3], [0, 18, 3]])
    weight = np.random.default_rng(4).dirichlet(np.full(3, 20.0), 50)
    points = weight @ corner_m
    closed = WatertightFaces(np.ones(50, bool), np.zeros((50, 2, 3)))
    for order in ([0, 1, 2], [0, 2, 1]):
        ray_caster = SceneRayCaster(SceneMeshes.of_rigid({7: TriMesh(corner_m, np.array([order], np.int32))}))
        lying = placed(points, np.repeat(corner_m[None, order], 50, axis=0), closed)
        first = dataclasses.replace(lying, face=np.zeros(50, np.int32))
        shown, _ = visible_in_frame(first, [seen], ray_caster, HairFaces({}), CONFIG)
        inside = inside_image(CAMERA, project(CAMERA, points))
        assert inside.sum() > 20
        np.testing.assert_array_equal(shown[0], inside)


def test_closed_open_and_inverted_surfaces_are_told_apart() -> None:
    ball, bowl, shell = (trimesh.creation.icosphere(subdivisions=2) for _ in range(3))
    bowl.update_faces(bowl.triangles_center[:, 2] < 0.2)
    shell.invert()
    split = trimesh.Trimesh(ball.triangles.reshape(-1, 3), np.arange(960).reshape(-1, 3), process=False)
    for mesh, closed in ((ball, True), (split, True), (bowl, False), (shell, False)):
        given = tri(mesh)
        assert (watertight_faces(given.vertices_m, given.faces).closed == closed).all()
    bowl.apply_translation([5.0, 0.0, 0.0])
    both = join([tri(ball), tri(bowl)])
    watertight = watertight_faces(both.vertices_m, both.faces)
    assert watertight.closed.sum() == len(ball.faces) and watertight.closed[: len(ball.faces)].all()
    np.testing.assert_allclose(watertight.box_m[0], ball.bounds, atol=1e-12)


def test_barycentric_weights_give_the_point_back() -> None:
    rng = np.random.default_rng(1)
    corners = rng.normal(size=(50, 3, 3))
    weight = rng.dirichlet(np.ones(3), 50)
    points = np.einsum("nk,nkc->nc", weight, corners)
    np.testing.assert_allclose(plane_barycentric(points, corners), weight, atol=1e-9)


def test_a_pixel_beside_the_projection_is_enough_and_none_is_not() -> None:
    points, corners, seen = slanted_wall(0.0)
    # The wall shows on every other column alone: one of the four pixels around each point is on it.
    striped = seen.object_index.copy()
    striped[:, ::2] = 8
    pixel_px = project(CAMERA, points)
    between = (pixel_px[:, 0] > 0) & (pixel_px[:, 0] < 62)
    assert visible(points, corners, ViewFrame(0, np.eye(4), CAMERA, seen.depth_m, striped))[between].all()
    striped[:, 1::4] = 8
    shown = visible(points, corners, ViewFrame(0, np.eye(4), CAMERA, seen.depth_m, striped))
    beside = (np.floor(pixel_px[:, 0]) % 4 >= 2) & between
    assert shown[beside].all() and not shown[between & ~beside].any()


def _blocked_fraction(start_m: np.ndarray, end_m: np.ndarray, triangles_m: np.ndarray) -> np.ndarray:
    """Where along each segment (0 to 1) the first triangle is met, in double precision, all against all
    (Moeller and Trumbore 1997); infinite for none."""
    first, second = triangles_m[:, 1] - triangles_m[:, 0], triangles_m[:, 2] - triangles_m[:, 0]
    nearest = np.full(len(end_m), np.inf)
    for ray, (start, end) in enumerate(zip(start_m, end_m, strict=True)):
        across = np.cross(end - start, second)
        determinant = np.einsum("fc,fc->f", first, across)
        with np.errstate(divide="ignore", invalid="ignore"):
            offset = (start - triangles_m[:, 0]) / determinant[:, None]
            u = np.einsum("fc,fc->f", offset, across)
            turned = np.cross(offset, first)
            v, fraction = turned @ (end - start), np.einsum("fc,fc->f", turned, second)
        met = (u >= 0) & (v >= 0) & (u + v <= 1) & (fraction > 0)
        nearest[ray] = fraction[met].min(initial=np.inf)
    return nearest


def test_visibility_is_what_an_exact_search_over_all_triangles_says() -> None:
    """Edges, thin legs and a shirt 8 mm over skin included: at most one entry in a thousand differs."""
    scene = make_scene()
    tracks = make_scene_tracks(scene)
    differs = entries = hidden = 0
    for frame in range(0, 6, 2):
        people = [TriMesh(actor.vertices_m[frame].astype(np.float64), actor.faces) for actor in scene.actors]
        joined = join([obj.mesh for obj in scene.room.objects] + people)
        triangles_m = joined.vertices_m[joined.faces]
        point_m = tracks.points.position_m[frame]
        for index, camera in enumerate(scene.cameras):
            inside = inside_image(camera.intrinsics, tracks.views.pixel_px[index, frame])
            start_m = np.repeat(camera.world_from_camera[frame][None, :3, 3], int(inside.sum()), axis=0)
            truth = np.zeros(len(point_m), bool)
            truth[inside] = _blocked_fraction(start_m, point_m[inside], triangles_m) > 1.0 - 1e-4
            differs += int((truth != tracks.views.visible[index, frame]).sum())
            entries += len(point_m)
            hidden += int((inside & ~truth).sum())
    assert entries == 1800 and hidden > 200
    assert differs <= 0.001 * entries, (differs, entries, tracks.report)


def test_the_report_counts_every_entry_once() -> None:
    tracks = make_scene_tracks(make_scene())
    report, visible_entries = tracks.report, int(tracks.views.visible.sum())
    assert report.entries == tracks.views.visible.size and report.visible == visible_entries
    inside = sum(
        int(inside_image(camera.intrinsics, pixel_px).sum())
        for camera, pixel_px in zip(make_scene().cameras, tracks.views.pixel_px, strict=True)
    )
    assert report.inside == inside
    assert report.unseen_otherwise == 0, "the image was made from these meshes"


def test_hidden_entries_are_counted_by_reason() -> None:
    """A wall at 3 m shown whole, and a sheet before it that the image does not show."""
    points, corners, seen = slanted_wall(0.0)
    for gap_m, wanted in ((0.005, "blocked_coincident"), (0.5, "blocked_thin")):
        corner_m = np.array([[-9.0, -9, 3 - gap_m], [9, -9, 3 - gap_m], [0, 18, 3 - gap_m]])
        sheet = TriMesh(corner_m, np.array([[0, 1, 2]], np.int32))
        ray_caster = SceneRayCaster(SceneMeshes.of_rigid({8: sheet}))
        shown, report = visible_in_frame(placed(points, corners), [seen], ray_caster, HairFaces({}), CONFIG)
        assert not shown.any() and getattr(report, wanted) == len(points) and report.visible == 0
        _, strands = visible_in_frame(
            placed(points, corners), [seen], ray_caster, HairFaces({8: np.array([True])}), CONFIG
        )
        assert strands.blocked_hair == len(points)
    elsewhere = ViewFrame(0, np.eye(4), CAMERA, seen.depth_m, np.full((48, 64), 8, np.uint16))
    _, thin = visible_in_frame(placed(points, corners), [elsewhere], ClearRayCaster(), HairFaces({}), CONFIG)
    assert thin.unseen_thin == len(points)
    moved = ViewFrame(0, np.eye(4), CAMERA, seen.depth_m - np.float32(0.05), seen.object_index)
    _, other = visible_in_frame(placed(points, corners), [moved], ClearRayCaster(), HairFaces({}), CONFIG)
    assert other.unseen_otherwise == len(points)


def test_a_rim_between_pixels_is_counted_as_an_edge() -> None:
    """A wall at 3 m with a ridge of its own 40 cm before it, narrower than a pixel: all pixels show the wall."""
    _, _, seen = slanted_wall(0.0)
    size_m = 2.6 / CAMERA.fx_px
    ridge_m = np.array([[0.9, -9.0, 2.6], [1.1, -9.0, 2.6], [1.0, 9.0, 2.6]]) * [size_m, 1.0, 1.0]
    wall_m = np.array([[-9.0, -9, 3], [9, -9, 3], [0, 18, 3]])
    mesh = TriMesh(np.concatenate([wall_m, ridge_m]), np.array([[0, 1, 2], [3, 4, 5]], np.int32))
    ray_caster = SceneRayCaster(SceneMeshes.of_rigid({7: mesh}))
    weight = np.random.default_rng(2).dirichlet(np.ones(3), 50)
    weight[:, 2] = 0.5
    weight[:, :2] *= 0.5 / weight[:, :2].sum(axis=1, keepdims=True)
    on_ridge = placed(weight @ ridge_m, np.repeat(ridge_m[None], 50, axis=0))
    on_ridge = dataclasses.replace(on_ridge, face=np.ones(50, np.int32))
    shown, report = visible_in_frame(on_ridge, [seen], ray_caster, HairFaces({}), CONFIG)
    assert not shown.any() and report.unseen_edge == 50, report
    bent = ViewFrame(0, np.eye(4), CAMERA, seen.depth_m + np.float32(0.5), seen.object_index)
    assert visible_in_frame(on_ridge, [bent], ray_caster, HairFaces({}), CONFIG)[1].unseen_otherwise == 50


def test_projection_uses_the_exported_values() -> None:
    scene = make_scene()
    tracks = make_scene_tracks(scene)
    point_m = tracks.points.position_m.astype(np.float32).astype(np.float64)
    pose = np.linalg.inv(scene.cameras[1].world_from_camera[2]).astype(np.float32).astype(np.float64)
    camera_m = point_m[2] @ pose[:3, :3].T + pose[:3, 3]
    expected = project(scene.cameras[1].intrinsics, camera_m)
    np.testing.assert_allclose(tracks.views.pixel_px[1, 2], expected, atol=2e-4)
