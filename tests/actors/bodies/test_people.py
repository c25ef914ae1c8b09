"""Who is drawn, and how actors are put together."""

import numpy as np
import pytest

from perpetua.actors.bodies.assembly import assemble_actors, draw_bodies
from perpetua.actors.bodies.people import draw_person
from perpetua.actors.config import ActorsConfig
from perpetua.errors import ActorError, ConfigError
from perpetua.scene.actor import BodyMotion
from perpetua.seeding import StageSeed

CONFIG = ActorsConfig()


@pytest.mark.parametrize("room", range(6))
def test_four_people_differ_in_everything_seen_from_afar(room: int) -> None:
    people = [draw_person(actor, CONFIG, StageSeed(9, room, "actors")) for actor in range(4)]
    assert {person.traits.female for person in people} == {True, False}
    tones = [np.array(person.complexion.skin) for person in people]
    assert max(np.linalg.norm(a - b) for a in tones for b in tones) > 0.15
    weights = sorted(person.traits.weight for person in people)
    assert weights[-1] - weights[0] > 0.25
    ages = sorted(person.complexion.age for person in people)
    assert ages[-1] - ages[0] > 15 and ages[0] >= CONFIG.youngest_years and ages[-1] <= CONFIG.oldest_years
    assert all(1.45 < person.stature_m < 2.0 for person in people)
    assert len({person.description for person in people}) == 4


def test_a_person_does_not_depend_on_who_else_is_drawn() -> None:
    seed = StageSeed(9, 3, "actors")
    alone = draw_person(2, CONFIG, seed)
    assert [draw_person(actor, CONFIG, seed) for actor in range(3)][2] == alone
    assert draw_person(2, CONFIG, StageSeed(9, 4, "actors")) != alone


def test_an_unknown_body_model_is_named_with_the_known_ones() -> None:
    with pytest.raises(ConfigError, match="anny"):
        draw_bodies(CONFIG.model_copy(update={"body": "annie"}), StageSeed(0, 0, "actors"))


def test_bodies_and_motions_must_pair_up() -> None:
    motion = BodyMotion(0, 24.0, np.tile(np.eye(3), (1, 22, 1, 1)), np.zeros((1, 3)), np.zeros((1, 4), dtype=bool))
    with pytest.raises(ActorError, match="0 bodies and 1 motions"):
        assemble_actors((), (motion,), 10)


def test_assembled_actors_have_the_wanted_stature_and_indices() -> None:
    config = CONFIG.model_copy(update={"count": 1})
    seed = StageSeed(2, 0, "actors")
    bodies = draw_bodies(config, seed)
    joints = bodies[0].skeleton.joint_m
    motion = BodyMotion(
        0, 24.0, np.tile(np.eye(3), (2, 22, 1, 1)), np.tile(joints[0], (2, 1)), np.zeros((2, 4), dtype=bool)
    )
    actors = assemble_actors(bodies, (motion,), 41)
    assert [actor.object_index for actor in actors] == [41]
    assert actors[0].vertices_m.dtype == np.float32 and len(actors[0].vertices_m) == 2
    skin = np.unique(next(part.faces for part in actors[0].parts if part.name == "body"))
    top_m = float(actors[0].vertices_m[0][skin, 2].max())
    sole_m = 0.03
    assert top_m == pytest.approx(draw_person(0, config, seed).stature_m + sole_m, abs=0.05)
