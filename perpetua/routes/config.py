"""Settings of the route stage."""

from typing import Protocol, runtime_checkable

from pydantic import Field, model_validator

from perpetua.io.section import Section
from perpetua.motion.config import MotionConfig


class PaceShares(Section):
    """How often an actor goes at each pace, unless words state one; only the proportions count."""

    stand: float = Field(0.06, ge=0.0, description="staying at one place and looking around")
    stroll: float = Field(0.20, ge=0.0, description="strolling")
    walk: float = Field(0.36, ge=0.0, description="walking")
    brisk: float = Field(0.20, ge=0.0, description="walking briskly")
    jog: float = Field(0.18, ge=0.0, description="jogging")

    @model_validator(mode="after")
    def _check_some(self) -> "PaceShares":
        if not any(self.model_dump().values()):
            raise ValueError("at least one share must be more than 0")
        return self


class PaceSpeeds(Section):
    """Typical speeds on free floor, m/s."""

    stroll: float = Field(0.75, gt=0.0, le=6.0, description="strolling, m/s")
    walk: float = Field(1.15, gt=0.0, le=6.0, description="walking, m/s")
    brisk: float = Field(1.6, gt=0.0, le=6.0, description="walking briskly, m/s")
    jog: float = Field(2.75, gt=0.0, le=6.0, description="jogging, m/s")


class RouteWeights(Section):
    """How much each loss of the route optimisation counts; 0 switches it off."""

    clearance: float = Field(400.0, ge=0.0, description="keeping off obstacles")
    separation: float = Field(400.0, ge=0.0, description="actors keeping apart")
    speed: float = Field(50.0, ge=0.0, description="staying under the pace's highest speed")
    acceleration: float = Field(5.0, ge=0.0, description="staying under the limit of acceleration")
    jerk: float = Field(0.002, ge=0.0, description="changing acceleration slowly")
    heading: float = Field(20.0, ge=0.0, description="facing where one walks")
    turning: float = Field(20.0, ge=0.0, description="staying under the limit of the turn rate")
    turn_change: float = Field(0.02, ge=0.0, description="changing the turn rate slowly")
    variation: float = Field(0.4, ge=0.0, description="not coming back to where one has been")
    walk: float = Field(2.0, ge=0.0, description="staying near the random walk")
    pause: float = Field(50.0, ge=0.0, description="pausing where and facing what was planned")


class RoutesConfig(Section):
    """How actors move through the room, and the hard limits they keep."""

    paces: PaceShares = Field(default_factory=PaceShares)
    speeds: PaceSpeeds = Field(default_factory=PaceSpeeds)
    pause_share: float = Field(
        0.2, ge=0.0, le=0.9, description="share of time that walking actors pause, to look at objects or to use them"
    )
    max_speed_mps: float = Field(3.4, gt=0.0, le=8.0, description="hard limit of speed, m/s")
    max_acceleration_mps2: float = Field(5.0, gt=0.0, le=20.0, description="hard limit of acceleration, m/s^2")
    max_turn_rate_radps: float = Field(3.2, gt=0.2, le=10.0, description="hard limit of the turn rate, rad/s")
    separation_m: float = Field(0.75, ge=0.2, le=3.0, description="least distance between two body axes, metres")
    learning_rate: float = Field(0.05, gt=0.0, le=1.0, description="Adam's first step size, metres and radians")
    steps: int = Field(300, ge=10, le=10000, description="Adam steps")
    weights: RouteWeights = Field(default_factory=RouteWeights)
    max_redraws: int = Field(20, ge=0, le=500, description="new walks tried when a route breaks a limit")


@runtime_checkable
class RouteSettings(Protocol):
    """What routes need of the section ``actors``."""

    @property
    def count(self) -> int:
        """Actors in a room."""

    @property
    def routes(self) -> RoutesConfig:
        """How they move, and their limits."""

    @property
    def motion(self) -> MotionConfig:
        """Where descriptions of what they do come from."""
