"""What is measured of a finished room: how far its colliders are off, and the number it is known by."""

from dataclasses import replace

import numpy as np
import pytest

from perpetua.geometry.mesh import TriMesh
from perpetua.rooms.collider_gap import LIMIT_M, collider_gap
from perpetua.rooms.fingerprint import room_sha256
from perpetua.scene.room import Room, SceneObject


def _plate(x_m: tuple[float, float], y_m: tuple[float, float], z_m: float) -> TriMesh:
    corners_m = np.array([(x_m[i], y_m[j], z_m) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))], np.float64)
    return TriMesh(corners_m, np.array([[0, 1, 2], [0, 2, 3]], np.int32))


def _room(*meshes: TriMesh) -> Room:
    objs = tuple(
        SceneObject(k, f"thing_{k}", "floor", mesh, None, walkable=True, opaque=True)
        for k, mesh in enumerate(meshes, start=1)
    )
    square_m = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    return Room("test", "bedroom", square_m, 2.5, objs, (), None)


FLOOR = _plate((-2.0, 2.0), (-2.0, 2.0), 0.0)


def test_equal_meshes_have_no_gap() -> None:
    gap = collider_gap(_room(FLOOR), FLOOR)
    assert gap.max_m == pytest.approx(0.0, abs=1e-5)
    assert gap.share_beyond_2_cm == 0.0


def test_the_gap_is_weighted_by_area() -> None:
    # A tenth of the surface lies 5 cm from its collider, the rest 1 cm.
    shelf = _plate((-1.0, 1.0), (-4.0 / 9.0, 4.0 / 9.0), 1.0)
    colliders = TriMesh(
        np.concatenate([FLOOR.vertices_m - [0.0, 0.0, 0.01], shelf.vertices_m + np.array([0.0, 0.0, 0.05])]),
        np.concatenate([FLOOR.faces, shelf.faces + np.int32(4)]),
    )
    gap = collider_gap(_room(FLOOR, shelf), colliders)
    assert gap.median_m == pytest.approx(0.01, abs=1e-4)
    assert gap.p95_m == gap.max_m == pytest.approx(0.05, abs=1e-4)
    assert gap.share_beyond_2_cm == pytest.approx(0.1, abs=0.002)


def test_what_has_no_collider_counts_as_far_and_the_outside_not_at_all() -> None:
    shelf = _plate((-1.0, 1.0), (-1.0, 1.0), 1.0)
    outside = _plate((3.0, 5.0), (-2.0, 2.0), 1.0)
    gap = collider_gap(_room(FLOOR, shelf, outside), FLOOR)
    assert gap.max_m == LIMIT_M
    assert gap.share_beyond_2_cm == pytest.approx(4.0 / 20.0, abs=0.002)


def test_any_change_of_a_room_changes_its_number() -> None:
    room = _room(FLOOR)
    moved = FLOOR.vertices_m.copy()
    moved[2, 1] = np.nextafter(moved[2, 1], 9.0)
    obj = room.objects[0]
    changed = [
        replace(room, objects=(replace(obj, mesh=TriMesh(moved, FLOOR.faces)),)),
        replace(room, objects=(replace(obj, mesh=TriMesh(FLOOR.vertices_m, FLOOR.faces[::-1].copy())),)),
        replace(room, objects=(replace(obj, name="other"),)),
        replace(room, objects=(replace(obj, walkable=False),)),
        replace(room, floor_polygon_m=room.floor_polygon_m * 1.5),
    ]
    numbers = [room_sha256(each) for each in (room, *changed)]
    assert len(set(numbers)) == len(numbers)
    assert room_sha256(_room(_plate((-2.0, 2.0), (-2.0, 2.0), 0.0))) == numbers[0]
