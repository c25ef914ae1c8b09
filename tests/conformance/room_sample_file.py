"""A folder with two glTF scenes of one kind."""

from pathlib import Path

import pytest

from perpetua.rooms.config import RoomKind, RoomsConfig, SceneFileConfig
from tests.support.room_sample import RoomSample
from tests.support.scene_samples import procedural_room, write_scene


def _two_scenes(source: str, kind: RoomKind, folder: Path) -> RoomsConfig:
    for number in (0, 1):
        write_scene(procedural_room(kind, number), folder / f"{kind}_{number}.glb")
    return RoomsConfig(source=source, kinds=(kind,), file=SceneFileConfig(path=str(folder), kind=kind))


SAMPLE = RoomSample(kinds=("livingroom", "kitchen"), config=_two_scenes, marks=(pytest.mark.blender,))
