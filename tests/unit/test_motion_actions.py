"""What words mean, and who gets which."""

import logging

import pytest
from motion_samples import empty_room, sample_route, sample_skeleton

from perpetua.actors.casting import draw_descriptions
from perpetua.actors.config import MotionConfig
from perpetua.actors.motion.actions import known_actions, perform
from perpetua.actors.motion.plan import make_motions
from perpetua.errors import ConfigError
from perpetua.seeding import StageSeed

SEED = StageSeed(5, 0, "motion")


@pytest.mark.parametrize("name", known_actions())
def test_every_action_understands_its_own_name(name: str, caplog: pytest.LogCaptureFixture) -> None:
    assert perform(name) != perform("walks")
    assert not caplog.records


def test_verbs_things_and_sides_are_matched_clause_by_clause() -> None:
    assert perform("walks while waving the right hand").right == perform("waves").right
    left = perform("waves the left hand, talking on the phone")
    assert left.left == perform("waves").right and left.right == perform("talks on the phone").right
    both = perform("is carrying a big box and looking around")
    assert both.left is not None and both.right is not None and both.gaze_wander_rad > 0.5
    assert perform("looks at the phone").right != perform("talks on the phone").right
    assert perform("walks briskly").arm_swing > 1.0 > perform("walks slowly").arm_swing
    assert perform("carries a grudge") == perform("walks")


def test_words_without_meaning_warn_with_the_nearest_known_and_walk(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        assert perform("hans on the hibs") == perform("walks")
    assert "'hans on the hibs' is not understood" in caplog.text and "hands on the hips" in caplog.text


def test_actions_are_drawn_without_repeats_and_all_are_understood(caplog: pytest.LogCaptureFixture) -> None:
    drawn = draw_descriptions(8, MotionConfig(), SEED)
    assert len(set(drawn)) == 8
    assert drawn[:4] == draw_descriptions(4, MotionConfig(), SEED)
    assert any(drawn != draw_descriptions(8, MotionConfig(), StageSeed(room, 1, "m")) for room in range(3))
    for description in draw_descriptions(200, MotionConfig(), SEED):
        perform(description)
    assert not caplog.records


def test_a_list_that_does_not_exist_is_named() -> None:
    with pytest.raises(ConfigError, match=r"actors.motion.actions must be one of \[.*everyday.*\], not 'dance'"):
        draw_descriptions(1, MotionConfig(actions="dance"), SEED)


def test_make_motions_gives_each_actor_a_motion_of_its_own() -> None:
    routes = tuple(sample_route("straight", 12.0, 3.0, actor) for actor in range(2))
    first, second = make_motions(
        routes, (sample_skeleton(), sample_skeleton()), empty_room(), 12.0, MotionConfig(), SEED
    )
    assert (first.actor, second.actor) == (0, 1)
    assert (first.contacts != second.contacts).any(), "two actors walk in step"
