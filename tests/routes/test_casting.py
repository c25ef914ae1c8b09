"""Who does what: descriptions drawn from lists, and the paces that go with them."""

import logging
from collections import Counter

import pytest

from perpetua.errors import ConfigError
from perpetua.motion.actions import read_description, stated_paces, wants_seat
from perpetua.motion.config import MotionConfig
from perpetua.routes.casting import action_descriptions, cast_actors
from perpetua.routes.config import PaceShares
from perpetua.scene.actor import PACES
from perpetua.seeding import StageSeed

SEED = StageSeed(5, 0, "routes")
SHARES = PaceShares()


def test_roles_are_drawn_without_repeats_and_the_same_for_the_same_seed() -> None:
    roles = cast_actors(8, MotionConfig(), SHARES, 8, SEED)
    assert len({role.description for role in roles}) == 8
    assert roles == cast_actors(8, MotionConfig(), SHARES, 8, SEED)
    assert roles[:4] == cast_actors(4, MotionConfig(), SHARES, 8, SEED)
    assert any(roles != cast_actors(8, MotionConfig(), SHARES, 8, StageSeed(5, room, "routes")) for room in (1, 2))


def test_every_description_of_the_list_is_understood(caplog: pytest.LogCaptureFixture) -> None:
    for description in action_descriptions(MotionConfig()):
        read_description(description)
    assert not caplog.records


def test_a_list_that_does_not_exist_is_named() -> None:
    with pytest.raises(ConfigError, match=r"actors.motion.actions must be one of \[.*everyday.*\], not 'dance'"):
        cast_actors(1, MotionConfig(actions="dance"), SHARES, 0, SEED)


def test_words_that_state_a_pace_are_kept_and_given_descriptions_are_all_used() -> None:
    given = ("jogs", "strolls, relaxed", "waves the right hand")
    for room in range(6):
        roles = cast_actors(3, MotionConfig(descriptions=given), SHARES, 0, StageSeed(5, room, "routes"))
        paces = {role.description: role.paces for role in roles}
        assert set(paces) == set(given)
        assert paces["jogs"] == ("jog",) and paces["strolls, relaxed"] == ("stroll",)
        assert len(paces["waves the right hand"]) == 1 and paces["waves the right hand"][0] in PACES


def test_paces_come_in_their_shares() -> None:
    weights = PaceShares(stand=0.1, stroll=0.2, walk=0.3, brisk=0.2, jog=0.2)
    roles = [role for room in range(60) for role in cast_actors(4, MotionConfig(), weights, 4, StageSeed(5, room, "r"))]
    assert all(stated_paces(role.description) in (frozenset(), frozenset(role.paces)) for role in roles)
    counts = Counter(role.paces[0] for role in roles if len(role.paces) == 1)
    assert sum(counts.values()) > 0.8 * len(roles)
    for pace, weight in weights.model_dump().items():
        assert counts[pace] / len(roles) == pytest.approx(weight, abs=0.1), pace


def test_a_pace_that_is_switched_off_is_drawn_for_nobody() -> None:
    weights = PaceShares(stand=0.0, stroll=0.0, walk=0.0, brisk=0.0, jog=1.0)
    silent = MotionConfig(descriptions=("waves the right hand", "looks around"))
    assert all(role.paces == ("jog",) for role in cast_actors(2, silent, weights, 0, SEED))


def test_nobody_sits_where_there_is_no_seat(caplog: pytest.LogCaptureFixture) -> None:
    config = MotionConfig(descriptions=("sits down", "walks to a chair and sits down"))
    assert [role.sits for role in cast_actors(2, config, SHARES, 2, SEED)] == [True, True]
    with caplog.at_level(logging.WARNING):
        roles = cast_actors(2, config, SHARES, 1, SEED)
    assert [role.sits for role in roles] == [True, False]
    assert "no seat is left for 'sits down'" in caplog.text or "no seat is left for 'walks to a chair" in caplog.text
    listed = [role for room in range(10) for role in cast_actors(4, MotionConfig(), SHARES, 0, StageSeed(1, room, "r"))]
    assert not any(wants_seat(role.description) for role in listed)
