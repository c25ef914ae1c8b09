"""Settings of how the stages are run."""

from pydantic import Field

from perpetua.config_base import Section


class RedrawConfig(Section):
    """What happens when a stage finds no output that keeps its hard limits."""

    routes_per_room: int = Field(3, ge=0, le=100, description="further sets of routes drawn in the same room")
    rooms: int = Field(2, ge=0, le=100, description="further rooms drawn when those are spent")
