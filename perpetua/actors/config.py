"""Settings of the route, motion and actor stages."""

from pydantic import Field

from perpetua.config_base import Section


class RoutesConfig(Section):
    """How actors move through the room, and the hard limits they keep."""

    walk_speed_mps: float = Field(1.1, gt=0.0, le=4.0, description="typical speed while walking, m/s")
    max_speed_mps: float = Field(2.0, gt=0.0, le=6.0, description="hard limit of speed, m/s")
    max_acceleration_mps2: float = Field(4.0, gt=0.0, le=20.0, description="hard limit of acceleration, m/s^2")
    separation_m: float = Field(0.6, ge=0.2, le=3.0, description="least distance between two body axes, metres")
    steps: int = Field(400, ge=10, le=10000, description="Adam steps")
    max_redraws: int = Field(20, ge=0, le=500, description="new walks tried when a route breaks a limit")


class MotionConfig(Section):
    """Where full-body motion comes from."""

    source: str = Field("procedural", description="motion source: procedural")
    actions: str = Field("everyday", description="list of action descriptions to draw from: a name in configs/actions")
    descriptions: tuple[str, ...] = Field(
        (), description="action descriptions in plain words to draw from instead of the list, one per actor"
    )


class ActorsConfig(Section):
    """Who is in the room."""

    count: int = Field(4, ge=1, le=16, description="actors in a room")
    body: str = Field("anny", description="body model: anny")
    routes: RoutesConfig = Field(default_factory=RoutesConfig)
    motion: MotionConfig = Field(default_factory=MotionConfig)
