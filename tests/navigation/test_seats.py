"""Seats are found by their shape, face away from their backrest, and want free floor in front."""

import numpy as np
import pytest
import trimesh

from perpetua.navigation.seats import find_seats
from perpetua.scene.room import Room, SceneObject
from perpetua.testing.synthetic_scene import GREY, box, tri

CHAIR = (((0.45, 0.45, 0.45), (0.0, 0.0, 0.225)), ((0.018, 0.45, 0.5), (-0.21, 0.0, 0.7)))


def _chair(turn_rad: float = 0.0, x_m: float = 0.0) -> trimesh.Trimesh:
    seat, back = (box(size, middle) for size, middle in CHAIR)
    parts: trimesh.Trimesh = seat + back
    parts.apply_transform(trimesh.transformations.rotation_matrix(turn_rad, [0.0, 0.0, 1.0]))
    parts.apply_translation([x_m, 0.5, 0.0])
    return parts


def _room(*objs: tuple[str, trimesh.Trimesh]) -> Room:
    floor = box((8.0, 8.0, 0.1), (0.0, 0.0, -0.05))
    objects = tuple(
        SceneObject(index, f"{category}_{index}", category, tri(mesh), GREY, category == "floor", True)
        for index, (category, mesh) in enumerate([("floor", floor), *objs], start=1)
    )
    return Room(
        "room", "livingroom", np.array([[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]]), 2.8, objects, (), None
    )


@pytest.mark.parametrize("turn_rad", [0.0, 0.4, 1.9, -2.6])
def test_a_chair_is_sat_on_in_its_middle_facing_away_from_its_back(turn_rad: float) -> None:
    (seat,) = find_seats(_room(("chair", _chair(turn_rad))))
    assert seat.object_index == 2 and abs(seat.height_m - 0.45) < 1e-3 and abs(seat.middle_m[2] - 0.45) < 1e-3
    assert np.hypot(seat.middle_m[0], seat.middle_m[1] - 0.5) < 0.08
    assert abs(np.angle(np.exp(1j * (seat.facing_rad - turn_rad)))) < 0.05


@pytest.mark.parametrize("turn_rad", [0.0, 1.9])
def test_a_seat_says_where_its_edge_is_and_how_far_behind_its_back(turn_rad: float) -> None:
    (seat,) = find_seats(_room(("chair", _chair(turn_rad))))
    assert abs(seat.top_m - 0.45) < 1e-3
    ahead = np.array([np.cos(turn_rad), np.sin(turn_rad)])
    forward_m = float((np.array(seat.middle_m[:2]) - [0.0, 0.5]) @ ahead)
    assert abs(seat.edge_m - (0.225 - forward_m)) < 0.012, "to the next centimetre"
    for level_m, distance_m in seat.backs_m:
        assert abs(distance_m - (0.201 + forward_m)) < 0.01 or level_m > 0.5


@pytest.mark.parametrize(
    "blocker",
    [
        box((0.8, 0.8, 0.7), (0.75, 0.5, 0.35)),  # a table in front
        box((0.6, 0.6, 0.05), (0.0, 0.5, 0.75)),  # a table top over the seat
        box((0.2, 0.3, 0.2), (0.05, 0.5, 0.55)),  # something lies on it
        box((0.8, 0.8, 2.2), (0.75, 0.5, 1.1)),  # a wardrobe in front
    ],
)
def test_a_chair_that_cannot_be_sat_on_is_no_seat(blocker: trimesh.Trimesh) -> None:
    assert not find_seats(_room(("chair", _chair()), ("table", blocker)))


def test_what_is_no_furniture_to_sit_on_or_too_high_is_no_seat() -> None:
    assert not find_seats(_room(("coffee_table", box((1.0, 1.0, 0.45), (0.0, 0.0, 0.225)))))
    assert not find_seats(_room(("stool", box((0.5, 0.5, 0.7), (0.0, 0.0, 0.35)))))


def test_a_bench_holds_several_people_side_by_side() -> None:
    seats = find_seats(_room(("bench", box((0.5, 2.4, 0.45), (0.0, 0.0, 0.225)))))
    assert 2 <= len(seats) <= 3
    places_m = np.array([seat.middle_m for seat in seats])
    gaps_m = [np.linalg.norm(one - other) for index, one in enumerate(places_m) for other in places_m[:index]]
    assert min(gaps_m) >= 0.6
