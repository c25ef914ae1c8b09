"""The gallery's cameras: all of the room from above, and free places near corners."""

from pathlib import Path

import numpy as np
import pytest

from perpetua.config import load_config
from perpetua.geometry.mesh import join
from perpetua.geometry.pinhole import inside_image, project
from perpetua.geometry.raycast import Caster
from perpetua.navigation.config import NavigationConfig
from perpetua.navigation.grid import build_nav_grid
from perpetua.report.pictures.room_views import CLEARANCE_M, CUT_FRACTION, TOP, RoomViews, place_views
from perpetua.runs.preview_rooms import GalleryRequest, RoomCard, _write_page, describe_room
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room
from perpetua.testing.scene_samples import procedural_room


@pytest.fixture(scope="module", params=["livingroom", "bathroom"])
def shown(request: pytest.FixtureRequest) -> tuple[Room, RoomViews]:
    room = procedural_room(request.param)
    return room, place_views(room)


def _in_camera(camera: CameraPath, points_m: np.ndarray) -> np.ndarray:
    pose = camera.world_from_camera[0]
    return np.asarray((points_m - pose[:3, 3]) @ pose[:3, :3])


def test_poses_are_rotations_of_one_frame(shown: tuple[Room, RoomViews]) -> None:
    for camera in shown[1].cameras:
        assert camera.world_from_camera.shape == (1, 4, 4)
        rotation = camera.world_from_camera[0, :3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_the_whole_room_is_in_the_picture_from_above_and_its_ceiling_is_cut(shown: tuple[Room, RoomViews]) -> None:
    room, views = shown
    camera = views.cameras[TOP]
    corners_m = room.floor_polygon_m
    for z_m in (0.0, CUT_FRACTION * room.height_m):
        seen = _in_camera(camera, np.column_stack([corners_m, np.full(len(corners_m), z_m)]))
        assert inside_image(camera.intrinsics, project(camera.intrinsics, seen)).all()
        assert (seen[:, 2] >= views.top_near_m - 1e-9).all()
    ceiling = _in_camera(camera, np.array([[0.0, 0.0, room.height_m - 0.01]]))
    assert ceiling[0, 2] < views.top_near_m
    # The longer side of the room lies along the longer side of the picture.
    seen = project(camera.intrinsics, _in_camera(camera, np.column_stack([corners_m, np.zeros(len(corners_m))])))
    width_px, height_px = np.ptp(seen, axis=0)
    assert width_px >= height_px


def test_corner_views_are_free_apart_and_look_across(shown: tuple[Room, RoomViews]) -> None:
    room, views = shown
    caster = Caster(join([obj.mesh for obj in room.objects]))
    eyes_m = np.array([camera.world_from_camera[0, :3, 3] for camera in views.cameras[1:]])
    assert (caster.closest_distance(eyes_m) >= CLEARANCE_M - 1e-6).all()
    assert (np.abs(eyes_m[:, :2]) < np.abs(room.floor_polygon_m).max(0)).all()
    assert (eyes_m[0, :2] * eyes_m[1, :2] < 0).all()
    assert ((eyes_m[:, 2] > 1.4) & (eyes_m[:, 2] < 2.1)).all()
    for camera, other_m in zip(views.cameras[1:], eyes_m[::-1], strict=True):
        ahead = _in_camera(camera, other_m[None])[0]
        assert ahead[2] > 0.9 * np.linalg.norm(ahead)


def test_page_needs_no_other_file_and_tells_failures(tmp_path: Path) -> None:
    room = procedural_room("kitchen")
    card = describe_room("room 0: kitchen", room, build_nav_grid(room, NavigationConfig()), "day, lamps on")
    assert f"{len(room.objects)} objects" in card.facts
    assert "free floor" in card.facts and card.facts.endswith("day, lamps on")
    for name in ("above", "corner_1", "corner_2"):
        (tmp_path / f"seed7-room0000_{name}.jpg").write_bytes(b"jpeg of " + name.encode())
    request = GalleryRequest(load_config("tiny"), 7, range(2), tmp_path, "cpu")
    _write_page(request, [(0, card), (1, RoomCard("room 1", "", failure="no <floor>"))], tmp_path)
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert page.count("data:image/jpeg;base64,") == 3
    assert "no &lt;floor&gt;" in page
    assert "http" not in page and 'src="seed' not in page
    assert "2 of 2 rooms of seed 7" in page
