"""What an exporter is."""

from pathlib import Path
from typing import Any, Protocol

from perpetua.actors.types import ActorMesh
from perpetua.cameras.types import CameraPath
from perpetua.registry import Registry
from perpetua.rendering.types import RenderedView
from perpetua.rooms.types import Room
from perpetua.tracks.types import SequenceTracks


class Exporter(Protocol):
    """Writes one sequence in one file layout; the same arguments give the same bytes."""

    def write(
        self,
        folder: Path,
        room: Room,
        actors: tuple[ActorMesh, ...],
        cameras: tuple[CameraPath, ...],
        views: tuple[RenderedView, ...],
        tracks: SequenceTracks,
        record: dict[str, Any],
    ) -> None:
        """Writes into ``folder``, which is made if need be; ``record`` says where the sequence comes from."""
        ...


EXPORTERS: Registry[type[Exporter]] = Registry("exporter")
