"""What words mean, and who gets which."""

import logging

import pytest

from perpetua.motion.actions import known_actions, read_description, stated_paces, wants_seat
from perpetua.motion.config import MotionConfig
from perpetua.motion.plan import make_motions
from perpetua.motion.vocabulary import ACTIONS
from perpetua.seeding import StageSeed
from perpetua.testing.motion_samples import empty_room, sample_route, sample_skeleton

SEED = StageSeed(5, 0, "motion")


@pytest.mark.parametrize("name", known_actions())
def test_every_action_understands_its_own_name(name: str, caplog: pytest.LogCaptureFixture) -> None:
    assert read_description(name) != read_description("walks")
    assert not caplog.records


def test_verbs_things_and_sides_are_matched_clause_by_clause() -> None:
    assert read_description("walks while waving the right hand").right == read_description("waves").right
    left = read_description("waves the left hand, talking on the phone")
    assert left.left is not None and left.left.left == ACTIONS["wave a hand"].right and left.left.right is None
    assert left.right == read_description("talks on the phone").right
    both = read_description("is carrying a big box and looking around")
    assert both.left is both.right is both.actions[0] and both.actions[1] == ACTIONS["look around"]
    assert read_description("looks at the phone").right != read_description("talks on the phone").right
    assert read_description("walks briskly").arm_swing > 1.0 > read_description("walks slowly").arm_swing
    assert read_description("carries a grudge") == read_description("walks")


def test_the_first_said_has_the_arm() -> None:
    meant = read_description("talks on the phone and waves")
    assert meant.right == read_description("talks on the phone").right
    assert meant.actions[1].right is None and meant.actions[1].left is None


@pytest.mark.parametrize(
    ("words", "name"),
    [
        ("walks and scratches his head", "scratch the head"),
        ("stands thinking", "touch the chin"),
        ("with hands in the pockets", "hands in the pockets"),
        ("keeps both hands behind the back", "hands behind the back"),
        ("sips from a cup", "drink from a cup"),
        ("checks the time", "check the watch"),
        ("pushes up the glasses", "adjust the glasses"),
        ("squats to tie a shoe", "crouch and tie a shoe"),
        ("looks up at the ceiling", "look up"),
        ("points at the shelf", "point at something"),
        ("is yawning", "yawn"),
    ],
)
def test_free_words_find_their_action(words: str, name: str) -> None:
    assert [action.verbs for action in read_description(words).actions] == [ACTIONS[name].verbs]


@pytest.mark.parametrize(
    ("words", "paces"),
    [
        ("walks", {"walk"}),
        ("walks briskly", {"brisk"}),
        ("strolls, relaxed", {"stroll"}),
        ("walks tired and slowly", {"stroll"}),
        ("is jogging", {"jog"}),
        ("walks, then stands and waits", {"walk", "stand"}),
        ("waves", set()),
    ],
)
def test_words_state_paces(words: str, paces: set[str]) -> None:
    assert stated_paces(words) == paces


def test_sitting_is_asked_for_by_words() -> None:
    assert wants_seat("walks to the sofa and sits down") and wants_seat("takes a seat") and wants_seat("sitting")
    assert not wants_seat("walks past the chair") and not wants_seat("stands")


def test_words_without_meaning_warn_with_the_nearest_known_and_walk(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        assert read_description("hans on the hibs") == read_description("walks")
    assert "'hans on the hibs' is not understood" in caplog.text and "hands on the hips" in caplog.text


def test_make_motions_gives_each_actor_a_motion_of_its_own() -> None:
    routes = tuple(sample_route("straight", 12.0, 3.0, actor) for actor in range(2))
    first, second = make_motions(
        routes, (sample_skeleton(), sample_skeleton()), empty_room(), 12.0, MotionConfig(), SEED
    )
    assert (first.actor, second.actor) == (0, 1)
    assert (first.contacts != second.contacts).any(), "two actors walk in step"
