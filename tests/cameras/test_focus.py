"""Whom views look at, and when."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from perpetua.cameras.bodies import actor_bounds, bounds_at, capsule_distance_m
from perpetua.cameras.config import CamerasConfig
from perpetua.cameras.focus import FocusSchedule, FocusSegment, draw_focus
from perpetua.cameras.spec import draw_wishes
from perpetua.seeding import StageSeed, stream
from tests.support.camera_scene import walkers

BOUNDS = actor_bounds(walkers(9))


def test_hand_over_is_smooth_and_complete() -> None:
    schedule = FocusSchedule((FocusSegment(0.0, (0,)), FocusSegment(4.0, (1, 2))))
    weight = schedule.weights(np.linspace(0.0, 8.0, 801), 4)
    np.testing.assert_allclose(weight.sum(axis=1), 1.0)
    np.testing.assert_allclose(weight[[0, 340]], [[1.0, 0, 0, 0]] * 2)
    np.testing.assert_allclose(weight[[460, 800]], [[0, 0.5, 0.5, 0]] * 2)
    assert np.abs(np.diff(weight, axis=0)).max() < 0.02
    assert schedule.members(np.array([0.0, 4.0, 8.0]), 4).tolist() == [
        [True, False, False, False],
        [True, True, True, False],
        [False, True, True, False],
    ]


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.05, 40.0), st.integers(0, 3), st.sampled_from(["close", "medium", "wide"]))
def test_schedules_cover_the_sequence(seed: int, duration_s: float, first: int, framing: str) -> None:
    schedule = draw_focus(stream(seed, 0, "test"), BOUNDS, duration_s, first, framing)  # type: ignore[arg-type]
    starts_s = [segment.start_s for segment in schedule.segments]
    assert starts_s[0] == 0.0 and all(later - before >= 2.0 for before, later in pairwise(starts_s))
    assert starts_s[-1] < duration_s and first in schedule.segments[0].members
    assert all(segment.members and len(set(segment.members)) == len(segment.members) for segment in schedule.segments)
    if framing == "close":
        assert all(len(segment.members) == 1 for segment in schedule.segments)
    assert max(later - before for before, later in pairwise([*starts_s, duration_s])) <= 8.0


def test_views_differ_in_direction_height_and_style() -> None:
    wishes = draw_wishes(StageSeed(3, 0, "cameras"), 0, 0, 2.6, CamerasConfig())
    turn = np.array([wish.azimuth_rad for wish in wishes])
    assert np.degrees(np.diff(turn)).min() > 60.0
    assert len({wish.height_m for wish in wishes}) == 4
    assert len({wish.style for wish in wishes}) == 4


def test_lenses_fit_the_framing_within_the_configured_range() -> None:
    lenses_deg: dict[str, list[float]] = {"close": [], "medium": [], "wide": []}
    for candidate in range(30):
        for wish in draw_wishes(StageSeed(3, 0, "cameras"), 0, candidate, 2.6, CamerasConfig()):
            lenses_deg[wish.grouping].append(float(np.degrees(wish.fov_rad)))
    assert min(lenses_deg["close"]) >= 35.0 and max(lenses_deg["wide"]) <= 90.0
    assert min(lenses_deg["close"]) < 37.0 and max(lenses_deg["wide"]) > 88.0
    assert max(lenses_deg["close"]) < 60.0 < 70.0 < min(lenses_deg["wide"])


def test_wishes_come_from_the_seed_alone() -> None:
    def drawn(seed: int, candidate: int) -> list[float]:
        wishes = draw_wishes(StageSeed(seed, 0, "cameras"), 0, candidate, 2.6, CamerasConfig())
        return [wish.azimuth_rad for wish in wishes] + [wish.speed_mps for wish in wishes]

    assert drawn(3, 1) == drawn(3, 1)
    assert drawn(3, 1) != drawn(3, 2) and drawn(3, 1) != drawn(4, 1)


def test_sway_stays_within_its_amplitude() -> None:
    config = CamerasConfig(styles=("handheld",), sway_m=0.02, sway_deg=1.0)
    (wish, *_) = draw_wishes(StageSeed(0, 0, "cameras"), 0, 0, 2.6, config)
    sway = np.abs(wish.sway.at(np.linspace(0.0, 60.0, 5000))).max(axis=0)
    assert (sway[:3] <= 0.02).all() and (sway[3:] <= np.radians(1.0)).all()
    assert (sway[:3] > 0.008).all()


def test_capsules_hold_every_vertex() -> None:
    actors = walkers(9)
    for actor, mesh in enumerate(actors):
        offset_m = mesh.vertices_m[..., :2] - BOUNDS.axis_m[actor][:, None]
        assert (np.linalg.norm(offset_m, axis=-1) <= BOUNDS.radius_m[actor][:, None] + 1e-6).all()
        assert BOUNDS.radius_m[actor] == pytest.approx(np.full(9, 0.2), abs=0.01)
    assert np.allclose(BOUNDS.bottom_m, 0.0, atol=1e-6) and np.allclose(BOUNDS.top_m, 1.7, atol=1e-6)


def test_bounds_between_frames_are_linear() -> None:
    between = bounds_at(BOUNDS, np.array([2.5]))
    np.testing.assert_allclose(between.axis_m[:, 0], BOUNDS.axis_m[:, 2:4].mean(axis=1), atol=1e-9)


def test_capsule_distance_in_numpy() -> None:
    places_m = np.array([[[-2.2, -0.6, 1.0]], [[-2.2, -1.6, 2.5]]])
    distance_m = capsule_distance_m(places_m, bounds_at(BOUNDS, np.zeros(1)))
    np.testing.assert_allclose(distance_m[0, :, 0], [0.8, 0.6], atol=0.01)
