"""Bodies drawn for a room, and put in motion."""

from dataclasses import replace

import numpy as np

from perpetua.actors.bodies.source import BODY_MODELS, Body
from perpetua.actors.config import ActorsConfig
from perpetua.errors import ActorError
from perpetua.motion.source import MOTION_SOURCES
from perpetua.routes.casting import action_descriptions
from perpetua.scene.actor import BODY_JOINTS, ActorMesh, BodyMotion, Skeleton
from perpetua.seeding import StageSeed

# What is sat on: so far behind the hip joints, along this fraction of the thighs, and so far to either side.
_BUTTOCK_M, _THIGH_FRACTION, _HALF_WIDTH_M = 0.08, 0.7, 0.22


def check_people(config: ActorsConfig) -> None:
    """Passes a config whose body model, clothes, motion source and actions exist and have what they need.

    Raises:
        ConfigError: a name is none of those known.
        AssetError: files or a program that one of them needs are missing.
    """
    BODY_MODELS[config.body]().check(config)
    MOTION_SOURCES[config.motion.source]().check(config.motion)
    action_descriptions(config.motion)


def draw_bodies(config: ActorsConfig, seed: StageSeed) -> tuple[Body, ...]:
    """The dressed people of one room, in the order of actors.

    Raises:
        ConfigError: where the config names a body model that does not exist.
        AssetError: where the body model's data is not installed.
    """
    model = BODY_MODELS[config.body]()
    return tuple(model.draw(actor, config, seed) for actor in range(config.count))


def measured_skeletons(bodies: tuple[Body, ...]) -> tuple[Skeleton, ...]:
    """The bones of bodies, with what flesh and clothes are between the hip joints and a seat, measured on each."""
    return tuple(replace(body.skeleton, seat_m=_seat_m(body)) for body in bodies)


def _seat_m(body: Body) -> float:
    """How far below its hip joints a body ends with its thighs level."""
    joint_m = body.skeleton.joint_m
    hip, knee = BODY_JOINTS.index("left_hip"), BODY_JOINTS.index("left_knee")
    rotation = np.tile(np.eye(3), (1, len(BODY_JOINTS), 1, 1))
    # A thigh that hangs at rest points to +X when it is pitched up by a quarter turn.
    rotation[:, [hip, BODY_JOINTS.index("right_hip")]] = [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
    posed = body.pose(BodyMotion(0, 1.0, rotation, joint_m[:1], np.zeros((1, 4), bool)))[0].astype(np.float64)
    from_hip_m = posed - joint_m[hip]
    thigh_m = float(np.linalg.norm(joint_m[knee] - joint_m[hip]))
    under = (from_hip_m[:, 0] > -_BUTTOCK_M) & (from_hip_m[:, 0] < _THIGH_FRACTION * thigh_m)
    near = np.abs(posed[:, 1]) < _HALF_WIDTH_M
    # Shins and feet, which hang at the knees, are not sat on.
    return float(-np.percentile(from_hip_m[under & near, 2], 0.5))


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
