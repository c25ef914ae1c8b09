"""What the procedural source does beyond walking: jogging, sitting, looking, pointing, feet on rugs, arms drawn in."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.raycast import Caster
from perpetua.motion.action_timeline import draw_timeline
from perpetua.motion.actions import read_description
from perpetua.motion.arm_avoidance import clear_arms
from perpetua.motion.config import MotionConfig
from perpetua.motion.kinematics import contact_positions, joint_index, joint_positions
from perpetua.motion.procedural import ProceduralMotion
from perpetua.navigation.seat_measure import measure_seat
from perpetua.scene.actor import BodyMotion, Dwell, Route
from perpetua.scene.room import Room, SceneObject
from perpetua.seeding import StageSeed
from perpetua.testing.motion_samples import empty_room, sample_route, sample_skeleton
from perpetua.testing.synthetic_scene import GREY, box, tri

FPS = 24.0
SKELETON = sample_skeleton()
SEAT_M = 0.44


def _with(*objects: tuple[str, TriMesh, bool]) -> Room:
    room = empty_room()
    more = tuple(
        SceneObject(index, category, category, mesh, GREY, walkable, True)
        for index, (category, mesh, walkable) in enumerate(objects, start=2)
    )
    return replace(room, objects=(*room.objects, *more))


def _standing(seconds: float, words: str, *dwells: Dwell, x_m: float = 0.0) -> Route:
    frames = round(seconds * FPS)
    return Route(0, np.tile([x_m, 0.0, 0.0], (frames, 1)), np.zeros(frames), words, dwells)


def _make(route: Route, room: Room, seed: int = 1) -> BodyMotion:
    return ProceduralMotion().make(route, SKELETON, room, FPS, MotionConfig(), StageSeed(seed, 0, "motion"))


def _joint(motion: BodyMotion, name: str) -> np.ndarray:
    return joint_positions(motion, SKELETON)[:, joint_index(name)]


@cache
def _jog() -> BodyMotion:
    time_s = np.arange(round(4.0 * FPS)) / FPS
    position_m = np.stack([2.7 * time_s, 0.0 * time_s, 0.0 * time_s], axis=1)
    return _make(Route(0, position_m, np.zeros(len(time_s)), "jogs"), empty_room())


def test_joggers_fly_between_steps_and_do_not_slide() -> None:
    motion = _jog()
    flying = ~motion.contacts.any(axis=1)
    assert 0.1 < flying.mean() < 0.5
    contact_m = contact_positions(motion, SKELETON)
    both = motion.contacts[1:] & motion.contacts[:-1]
    assert np.linalg.norm(np.diff(contact_m, axis=0), axis=2)[both].max() < 1e-3
    height_m = motion.pelvis_m[:, 2]
    assert height_m[flying].mean() > height_m[~flying].mean() + 0.02, "hips are highest in flight"
    assert 0.03 < np.ptp(height_m) < 0.16


def test_joggers_bend_their_elbows_and_lean_forward() -> None:
    motion = _jog()
    for side in ("left", "right"):
        upper = _joint(motion, f"{side}_elbow") - _joint(motion, f"{side}_shoulder")
        lower = _joint(motion, f"{side}_wrist") - _joint(motion, f"{side}_elbow")
        cosine = np.sum(upper * lower, axis=1) / (np.linalg.norm(upper, axis=1) * np.linalg.norm(lower, axis=1))
        assert np.all(np.degrees(np.arccos(cosine)) > 60.0)
    trunk_m = _joint(motion, "neck") - motion.pelvis_m
    assert np.all(trunk_m[:, 0] > 0.03)


def _sit(room: Room, seat_m: float, last: int) -> Dwell:
    """Sitting on the middle of the world, at a height, from frame 6 on."""
    caster = Caster(join([obj.mesh for obj in room.objects]))
    seat = measure_seat(2, (0.0, 0.0, seat_m), 0.0, 0.0, caster)
    return Dwell(6, last, "sit", 2, seat.middle_m, seat)


@cache
def _sitter() -> BodyMotion:
    seat = tri(box((0.5, 0.5, SEAT_M), (0.0, 0.0, 0.5 * SEAT_M)))
    room = _with(("chair", seat, False))
    return _make(_standing(8.0, "sits down", _sit(room, SEAT_M, 185), x_m=0.52), room)


def test_a_sitter_rests_its_hips_on_the_seat_with_planted_feet_and_stands_up_again() -> None:
    motion = _sitter()
    hips_m = 0.5 * (_joint(motion, "left_hip") + _joint(motion, "right_hip"))
    assert 0.05 < hips_m[96, 2] - SEAT_M < 0.13
    assert abs(hips_m[96, 1]) < 0.03 and abs(hips_m[96, 0]) < 0.2
    resting = slice(85, 110)
    assert motion.contacts[resting, 1].all() and motion.contacts[resting, 3].all()
    toes_m = contact_positions(motion, SKELETON)[resting][:, [1, 3]]
    assert np.ptp(toes_m, axis=0).max() < 1e-3 and toes_m[..., 0].min() > 0.25
    for frame in (0, -1):
        assert np.linalg.norm(motion.pelvis_m[frame, :2] - [0.52, 0.0]) < 0.1 and motion.pelvis_m[frame, 2] > 0.85
    for side in ("left", "right"):
        thigh_m = 0.4 * _joint(motion, f"{side}_hip") + 0.6 * _joint(motion, f"{side}_knee")
        assert np.linalg.norm(_joint(motion, f"{side}_wrist") - thigh_m, axis=1)[96] < 0.2, "hands rest on the thighs"


@pytest.mark.parametrize(("seat_m", "last", "table"), [(0.44, 50, False), (0.75, 185, False), (0.44, 185, True)])
def test_without_time_or_room_an_actor_stays_on_its_feet(seat_m: float, last: int, table: bool) -> None:
    objects = [("chair", tri(box((0.5, 0.5, seat_m), (0.0, 0.0, 0.5 * seat_m))), False)]
    if table:
        objects.append(("table", tri(box((0.3, 1.0, 0.5), (0.68, 0.0, 0.25))), False))
    room = _with(*objects)
    motion = _make(_standing(8.0, "sits down", _sit(room, seat_m, last), x_m=0.5), room)
    assert motion.pelvis_m[:, 2].min() > 0.85


def test_a_sitter_faces_as_its_seat_was_measured_whichever_way_the_route_leaves_it() -> None:
    room = _with(("chair", tri(box((0.5, 0.5, SEAT_M), (0.0, 0.0, 0.5 * SEAT_M))), False))
    sit = _sit(room, SEAT_M, 185)
    assert sit.seat is not None
    turned_rad = 0.1
    motion = _make(
        _standing(8.0, "sits down", replace(sit, seat=replace(sit.seat, facing_rad=turned_rad)), x_m=0.52), room
    )
    left = motion.world_from_joint[96, 0, :, 1]
    assert abs(np.arctan2(-left[0], left[1]) - turned_rad) < 0.02
    unmeasured = _make(_standing(8.0, "sits down", replace(sit, seat=None), x_m=0.52), room)
    assert unmeasured.pelvis_m[:, 2].min() > 0.85, "nobody sits on what was not measured"


def test_soles_stand_on_the_rug_or_the_floor_that_is_under_them() -> None:
    rug_m = 0.018
    rug = tri(box((30.0, 1.0, rug_m), (0.0, 0.5, 0.5 * rug_m)))
    route = replace(sample_route("straight", FPS), description="walks")
    motion = _make(route, _with(("rug", rug, True)))
    contact_m = contact_positions(motion, SKELETON)
    floor_m = np.where(contact_m[..., 1] > 0.0, rug_m, 0.0)
    height_m = (contact_m[..., 2] - floor_m)[motion.contacts]
    assert height_m.min() > -1e-3 and height_m.max() < 7e-3
    assert (contact_m[..., 2][motion.contacts] > 0.5 * rug_m).mean() > 0.3, "one foot walks on the rug"


def test_who_pauses_to_look_faces_what_the_pause_is_about() -> None:
    target_m = (1.5, 1.5, 1.2)
    motion = _make(_standing(4.0, "walks", Dwell(10, 85, "look", None, target_m)), empty_room())
    head = joint_index("head")
    wanted = np.array(target_m) - _joint(motion, "head")[50]
    cosine = motion.world_from_joint[50, head, :, 0] @ wanted / np.linalg.norm(wanted)
    assert np.degrees(np.arccos(cosine)) < 15.0
    assert motion.world_from_joint[2, head, 1, 0] < 0.4, "not before the pause"


def test_a_pointing_arm_points_at_the_thing_that_words_name() -> None:
    shelf = tri(box((0.4, 0.4, 1.0), (3.0, -1.5, 1.0)))
    lamp = tri(box((0.4, 0.4, 1.0), (3.0, 1.5, 1.0)))
    motion = _make(
        _standing(8.0, "points at the shelf"), _with(("lamp", lamp, False), ("bookshelf shelf", shelf, False))
    )
    arm_m = _joint(motion, "right_wrist") - _joint(motion, "right_shoulder")
    wanted_m = np.array([3.0, -1.5, 1.0]) - _joint(motion, "right_shoulder")
    cosine = np.sum(arm_m * wanted_m, axis=1) / (np.linalg.norm(arm_m, axis=1) * np.linalg.norm(wanted_m, axis=1))
    assert np.degrees(np.arccos(cosine.max())) < 8.0 and cosine.min() < 0.6, "it points at times, not always"


def test_arms_are_drawn_in_beside_a_wall_and_left_alone_in_the_open() -> None:
    route = replace(sample_route("straight", FPS), description="walks, waving")
    wall = tri(box((30.0, 0.2, 2.0), (0.0, -0.42, 1.0)))
    motion = _make(route, empty_room())
    (left_alone,) = clear_arms((motion,), (SKELETON,), empty_room())
    assert left_alone is motion
    (cleared,) = clear_arms((motion,), (SKELETON,), _with(("wall", wall, False)))
    hand = joint_index("right_wrist")
    assert joint_positions(motion, SKELETON)[:, hand, 1].min() < -0.32 < -0.28
    assert joint_positions(cleared, SKELETON)[:, hand, 1].min() > -0.28
    legs = [joint_index(name) for name in ("pelvis", "left_hip", "right_knee", "left_foot", "head", "left_wrist")]
    assert np.array_equal(cleared.world_from_joint[:, legs], motion.world_from_joint[:, legs])


def test_actions_come_and_go_and_those_for_standing_wait() -> None:
    time_s = np.arange(0.0, 20.0, 0.02)
    nobody, still = np.zeros(len(time_s)), np.clip(time_s - 10.0, 0.0, 1.0)
    wave = draw_timeline(read_description("waves"), nobody, nobody, time_s, np.random.default_rng(1)).actions[0].weight
    assert wave.max() > 0.9 and wave.min() == 0.0 and 0.2 < (wave > 0.5).mean() < 0.8
    other = draw_timeline(read_description("waves"), nobody, nobody, time_s, np.random.default_rng(2)).actions[0].weight
    assert not np.array_equal(wave, other)
    bow = draw_timeline(read_description("bows"), still, nobody, time_s, np.random.default_rng(1))
    assert np.all(bow.lean_rad[time_s < 10.0] == 0.0) and bow.lean_rad.max() > 0.6
