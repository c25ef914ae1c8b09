"""The one schema: the sections of all stages joined. Each section lies in its stage's folder."""

from typing import Any

from pydantic import Field

from perpetua.actors.config import ActorsConfig
from perpetua.audit.config import AuditConfig
from perpetua.cameras.config import CamerasConfig
from perpetua.config.run import RedrawConfig, WorkConfig
from perpetua.formats.config import ExportConfig
from perpetua.io.section import Section
from perpetua.navigation.config import NavigationConfig
from perpetua.rendering.config import PROCESS_SETTINGS, RenderConfig
from perpetua.rooms.config import RoomsConfig
from perpetua.tracks.config import TracksConfig


class SequenceConfig(Section):
    """Length and rate of a sequence."""

    frames: int = Field(120, ge=2, le=100_000, description="frames of a sequence")
    fps: float = Field(24.0, gt=0.0, le=1000.0, description="frames per second")


class Config(Section):
    """All settings of a run."""

    sequence: SequenceConfig = Field(default_factory=SequenceConfig)
    rooms: RoomsConfig = Field(default_factory=RoomsConfig)
    navigation: NavigationConfig = Field(default_factory=NavigationConfig)
    actors: ActorsConfig = Field(default_factory=ActorsConfig)
    cameras: CamerasConfig = Field(default_factory=CamerasConfig)
    render: RenderConfig = Field(default_factory=RenderConfig)
    tracks: TracksConfig = Field(default_factory=TracksConfig)
    export: ExportConfig = Field(default_factory=ExportConfig)
    audit: AuditConfig = Field(default_factory=AuditConfig)
    redraw: RedrawConfig = Field(default_factory=RedrawConfig)
    work: WorkConfig = Field(default_factory=WorkConfig)

    def content(self) -> dict[str, Any]:
        """The settings that decide what comes out, as JSON values: not how the work is done, or what is kept of it."""
        return self.model_dump(mode="json", exclude={"work": True, "render": set(PROCESS_SETTINGS)})


def field_table(section: type[Section] = Config, prefix: str = "") -> dict[str, str]:
    """Every key of the schema with its description: ``{"sequence.frames": "frames of a sequence"}``."""
    table: dict[str, str] = {}
    for name, field in section.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, Section):
            table |= field_table(inner, f"{prefix}{name}.")
        else:
            table[prefix + name] = field.description or ""
    return table
