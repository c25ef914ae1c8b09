"""Bodies drawn for a room, and put in motion."""

from perpetua.actors.bodies import BODY_MODELS
from perpetua.actors.bodies.source import Body
from perpetua.actors.config import ActorsConfig
from perpetua.actors.types import ActorMesh, BodyMotion
from perpetua.errors import ActorError
from perpetua.seeding import StageSeed


def draw_bodies(config: ActorsConfig, seed: StageSeed) -> tuple[Body, ...]:
    """The dressed people of one room, in the order of actors.

    Raises:
        ConfigError: where the config names a body model that does not exist.
        AssetError: where the body model's data is not installed.
    """
    model = BODY_MODELS[config.body]()
    return tuple(model.draw(actor, config, seed) for actor in range(config.count))


def assemble_actors(
    bodies: tuple[Body, ...], motions: tuple[BodyMotion, ...], first_object_index: int
) -> tuple[ActorMesh, ...]:
    """Poses each body by its motion.

    Args:
        bodies: one per actor.
        motions: one per actor, in the same order.
        first_object_index: object index of the first actor; the others follow.

    Raises:
        ActorError: where there are not as many motions as bodies.
    """
    if len(bodies) != len(motions):
        raise ActorError(f"every body needs one motion: there are {len(bodies)} bodies and {len(motions)} motions")
    return tuple(
        ActorMesh(motion.actor, first_object_index + place, body.description, body.parts, body.pose(motion))
        for place, (body, motion) in enumerate(zip(bodies, motions, strict=True))
    )
