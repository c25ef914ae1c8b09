"""What a body model is."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32

from perpetua.actors.config import ActorsConfig
from perpetua.registry import Registry
from perpetua.scene.actor import ActorPart, BodyMotion, Skeleton
from perpetua.seeding import StageSeed


@runtime_checkable
class Body(Protocol):
    """One dressed person: a shape, garments, hair and shoes, ready to be posed."""

    @property
    def description(self) -> str:
        """The person in plain words: age, build, clothes."""
        ...

    @property
    def skeleton(self) -> Skeleton:
        """The bones that motion is made for."""
        ...

    @property
    def parts(self) -> tuple[ActorPart, ...]:
        """Body, garments, hair and shoes; their faces index the vertices that ``pose`` returns."""
        ...

    def pose(self, motion: BodyMotion) -> Float32[np.ndarray, "T P 3"]:
        """World positions in metres of all vertices at each frame of the motion."""
        ...


@runtime_checkable
class BodyModel(Protocol):
    """Draws bodies; the same arguments give the same body, bit for bit."""

    def check(self, config: ActorsConfig) -> None:
        """Passes a config that bodies can be drawn with; nothing is made.

        Raises:
            AssetError: files that it needs are missing.
        """
        ...

    def draw(self, actor: int, config: ActorsConfig, seed: StageSeed) -> Body:
        """The body of one actor of a room; actors of one room differ in looks."""
        ...


BODY_MODELS: Registry[type[BodyModel]] = Registry(
    "actors.body",
    "perpetua.bodies",
    {
        "anny": "perpetua.actors.bodies.anny:AnnyModel",
        "smplx": "perpetua.actors.bodies.smplx_body:SmplxBodies",
    },
)
