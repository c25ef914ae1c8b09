"""Tracks of the synthetic scene: numbers, classes, spread, queries, errors, determinism."""

import dataclasses

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from perpetua.errors import TrackError
from perpetua.testing.synthetic_scene import make_scene
from perpetua.testing.synthetic_sequence import make_scene_tracks
from perpetua.tracks.candidates import ActorSurfaces
from perpetua.tracks.config import TracksConfig
from perpetua.tracks.motion import is_fast, travel_m
from perpetua.tracks.queries import draw_queries
from perpetua.tracks.selection import spread
from perpetua.tracks.types import SequenceTracks, ViewTracks


@pytest.fixture(scope="module")
def tracks() -> SequenceTracks:
    return make_scene_tracks(make_scene())


def test_numbers_and_classes_are_exact(tracks: SequenceTracks) -> None:
    position_m = tracks.points.position_m
    reach_m = np.linalg.norm(position_m[:, None] - position_m[None], axis=3).max(axis=(0, 1))
    moving = tracks.points.object_index > 4
    assert len(reach_m) == 200 and moving.sum() == 60
    assert (reach_m[moving] > 0.05).all()
    assert (reach_m[~moving] == 0.0).all()
    assert (tracks.views.visible.sum(axis=(0, 1)) >= 2).all()


def test_points_lie_on_their_triangles(tracks: SequenceTracks) -> None:
    scene = make_scene()
    meshes = {obj.object_index: (obj.mesh.vertices_m[None], obj.mesh.faces) for obj in scene.room.objects}
    meshes |= {actor.object_index: (actor.vertices_m.astype(np.float64), actor.faces) for actor in scene.actors}
    points = tracks.points
    assert (points.barycentric >= 0).all()
    np.testing.assert_allclose(points.barycentric.sum(axis=1), 1.0, atol=1e-12)
    for track in range(0, 200, 7):
        vertices_m, faces = meshes[int(points.object_index[track])]
        corners = vertices_m[:, faces[points.face[track]]]
        expected = np.einsum("k,tkc->tc", points.barycentric[track], corners)
        np.testing.assert_allclose(points.position_m[:, track], np.broadcast_to(expected, (6, 3)), rtol=0, atol=1e-12)


def test_static_points_come_from_many_pixels_objects_and_views(tracks: SequenceTracks) -> None:
    objects = np.bincount(tracks.points.object_index, minlength=7)[1:]
    assert (objects >= 3).all(), objects
    assert abs(int(objects[4]) - int(objects[5])) <= 10, "both actors alike"
    assert (tracks.views.visible.any(axis=1).sum(axis=1) > 60).all(), "every view sees a good part"


def test_same_seed_same_bits_other_seed_other_points(tracks: SequenceTracks) -> None:
    again, other = make_scene_tracks(make_scene()), make_scene_tracks(make_scene(), seed=6)
    assert again.points.position_m.tobytes() == tracks.points.position_m.tobytes()
    assert again.views.visible.tobytes() == tracks.views.visible.tobytes()
    assert again.queries_xytv.tobytes() == tracks.queries_xytv.tobytes()
    mine, others = ({row.tobytes() for row in made.points.position_m[0]} for made in (tracks, other))
    assert not mine & others


def test_depth_on_disk_gives_the_same(tracks: SequenceTracks, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("views")
    scene = make_scene()
    mapped = []
    for view in scene.views:
        np.save(folder / f"{view.camera}.npy", view.depth_m)
        mapped.append(dataclasses.replace(view, depth_m=np.load(folder / f"{view.camera}.npy", mmap_mode="r")))
    again = make_scene_tracks(dataclasses.replace(scene, views=tuple(mapped)))
    assert again.views.visible.tobytes() == tracks.views.visible.tobytes()


def test_queries_are_the_documented_draw(tracks: SequenceTracks) -> None:
    rng = np.random.default_rng(42)
    for track, (x, y, frame, view) in enumerate(tracks.queries_xytv):
        pairs = [(v, t) for v in range(3) for t in range(6) if tracks.views.visible[v, t, track]]
        assert (int(view), int(frame)) == pairs[int(rng.integers(len(pairs)))]
        np.testing.assert_allclose([x, y], tracks.views.pixel_px[int(view), int(frame), track], atol=1e-4)


def test_a_hand_made_draw() -> None:
    visible = np.zeros((2, 3, 1), bool)
    visible[1, 2, 0] = True
    pixel_px = np.zeros((2, 3, 1, 2))
    pixel_px[1, 2, 0] = (4.5, 6.25)
    queries = draw_queries(ViewTracks(pixel_px, np.ones((2, 3, 1)), visible))
    assert queries.tolist() == [[4.5, 6.25, 2.0, 1.0]]


def test_too_few_points_is_an_error_with_counts_and_remedy() -> None:
    scene = make_scene()
    impatient = TracksConfig(count=100, min_visible=19, max_draws=2)
    with pytest.raises(TrackError, match=r"70 static tracks are wanted.* 0 are seen in at least 19.*tracks.count"):
        make_scene_tracks(scene, impatient)
    still = dataclasses.replace(
        scene, actors=tuple(dataclasses.replace(a, vertices_m=a.vertices_m[[0] * 6]) for a in scene.actors)
    )
    with pytest.raises(TrackError, match=r"30 dynamic tracks.*move more than 0.05 m"):
        make_scene_tracks(still, TracksConfig(count=100, max_draws=2))


def test_without_actors_every_track_is_static() -> None:
    scene = make_scene(actors=0)
    tracks = make_scene_tracks(scene, TracksConfig(count=50))
    assert tracks.points.position_m.shape == (6, 50, 3)


def test_skin_under_a_shirt_is_never_drawn() -> None:
    actor = make_scene().actors[0]
    points = ActorSurfaces((actor,)).draw(2000, np.random.default_rng(3))
    body_faces = len(actor.parts[0].faces)
    centre = actor.vertices_m[0][actor.faces[points.face]].mean(axis=1)
    height_m = centre[:, 2]
    body = points.face < body_faces
    assert (~body).sum() > 200
    assert (body & (height_m > 0.55) & (height_m < 1.05)).sum() == 0
    assert (body & (height_m < 0.45)).sum() > 200


def test_travel_is_the_largest_distance_between_any_two_frames() -> None:
    # From the first frame it is never more than 4 cm away, but its ends are 7 cm apart.
    swing = np.zeros((3, 3, 3))
    swing[:, 0, 0] = (0.0, 0.04, -0.03)
    swing[:, 1, 1] = (0.0, 0.02, -0.02)
    assert travel_m(swing)[0] == pytest.approx(0.07)
    assert travel_m(swing)[1] <= 0.05
    assert travel_m(swing)[2] == 0.0


def test_spread_prefers_what_is_rare() -> None:
    objects = np.array([1] * 95 + [2] * 5, np.int32)
    cells = csr_matrix((np.ones(100), (np.arange(100), [0] * 50 + [1] * 45 + [2] * 5)), shape=(100, 3))
    chosen = spread(12, objects, cells, np.random.default_rng(0))
    assert len(set(chosen.tolist())) == 12
    in_cell = np.bincount(np.array([0] * 50 + [1] * 45 + [2] * 5)[chosen], minlength=3)
    assert (in_cell >= 3).all(), in_cell
    assert sorted(spread(100, objects, cells, np.random.default_rng(0)).tolist()) == list(range(100))


def test_some_of_the_chosen_may_be_reserved() -> None:
    objects, reserved = np.ones(100, np.int32), np.arange(100) >= 95
    cells = csr_matrix(np.ones((100, 1)))

    def chosen(wanted: int, least: int) -> list[int]:
        return spread(wanted, objects, cells, np.random.default_rng(1), reserved, least).tolist()

    assert set(chosen(20, 4)) & set(range(95, 100)) >= set(chosen(4, 4)) and len(set(chosen(20, 4))) == 20
    assert set(chosen(20, 50)) > set(range(95, 100)), "there are no more"
    assert set(chosen(3, 50)) < set(range(95, 100))
    assert sorted(chosen(100, 4)) == list(range(100))
    assert chosen(0, 4) == []


def test_fast_points_go_two_metres_within_a_second() -> None:
    time = np.arange(60.0)
    speed_m = np.array([0.09, 0.08, 0.0, 0.5])
    position_m = np.zeros((60, 4, 3))
    position_m[:, :3, 0] = time[:, None] * speed_m[:3]
    # Back and forth: far from the first frame only for a moment.
    position_m[30, 3, 1] = 2.1
    assert is_fast(position_m, travel_m(position_m)).tolist() == [True, False, False, True]
    assert not is_fast(position_m[:1], travel_m(position_m[:1])).any()


def test_fast_tracks_get_their_share_as_far_as_there_are_any() -> None:
    """The first actor moved off by 2.5 m at the end: its points are fast; the other's are not."""
    scene = make_scene()
    vertices_m = scene.actors[0].vertices_m.copy()
    vertices_m[5, :, 2] += 2.5
    scene = dataclasses.replace(
        scene, actors=(dataclasses.replace(scene.actors[0], vertices_m=vertices_m), scene.actors[1])
    )
    fast = {}
    for fraction in (0.0, 0.28, 0.9):
        points = make_scene_tracks(scene, TracksConfig(count=100, fast_share=fraction)).points
        fast[fraction] = int(is_fast(points.position_m, travel_m(points.position_m)).sum())
    assert fast[0.0] < 20 and 28 <= fast[0.28] < 30 and fast[0.9] == 30, fast
