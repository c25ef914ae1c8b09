"""Settings of how the stages are run."""

from typing import Literal

from pydantic import Field

from perpetua.io.section import Section


class RedrawConfig(Section):
    """What happens when a stage finds no output that keeps its hard limits."""

    routes_per_room: int = Field(3, ge=0, le=100, description="further sets of routes drawn in the same room")
    rooms: int = Field(2, ge=0, le=100, description="further rooms drawn when those are spent")


class WorkConfig(Section):
    """What is kept of the work behind finished sequences. It does not change what comes out."""

    keep: Literal["all", "tracks", "none"] = Field(
        "all",
        description="what is kept of the work behind a finished sequence: all; what `perpetua tracks` and "
        "`verify --deep` need; or none",
    )
