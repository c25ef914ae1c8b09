"""Samples of what comes with Perpetua and needs files, a program or time."""

from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import pytest

from perpetua.actors.config import ActorsConfig, SmplxConfig
from perpetua.motion.config import ClipsConfig, KimodoConfig, MotionConfig
from perpetua.motion.source import MOTION_SOURCES
from perpetua.rooms.config import RoomKind, RoomsConfig, SceneFileConfig
from perpetua.scene.actor import BodyMotion
from perpetua.seeding import StageSeed
from perpetua.testing.motion_files import install_fake_kimodo, write_amass
from perpetua.testing.motion_samples import empty_room, sample_route, sample_skeleton
from perpetua.testing.samples import ExporterSample, RoomSample
from perpetua.testing.scene_samples import procedural_room, write_scene
from perpetua.testing.smplx_files import write_model

_PHONE = "walks while talking on the phone"


def _two_scenes(source: str, kind: RoomKind, folder: Path) -> RoomsConfig:
    """A folder with two glTF scenes of one kind."""
    for number in (0, 1):
        write_scene(procedural_room(kind, number), folder / f"{kind}_{number}.glb")
    return RoomsConfig(source=source, kinds=(kind,), file=SceneFileConfig(path=str(folder), kind=kind))


def _smplx(folder: Path) -> ActorsConfig:
    """Synthetic model files of the true shapes and keys."""
    write_model(folder / "SMPLX_FEMALE.npz", size=0.96)
    write_model(folder / "SMPLX_MALE.npz", size=1.04)
    return ActorsConfig(body="smplx", smplx=SmplxConfig(folder=str(folder)))


def _procedural(kind: str, seconds: float, height_m: float, description: str, stage: str) -> BodyMotion:
    """A walk of the procedural source at 30 frames per second."""
    route = replace(sample_route(kind, 30.0, seconds), description=description)
    source, skeleton = MOTION_SOURCES["procedural"](), sample_skeleton(height_m)
    return source.make(route, skeleton, empty_room(), 30.0, MotionConfig(), StageSeed(5, 0, stage))


def _clips(folder: Path) -> MotionConfig:
    """Walks of the procedural source, written as AMASS writes them."""
    for name, description in {"walk.npz": "walks", "walk_talk_phone.npz": _PHONE}.items():
        write_amass(folder / name, _procedural("curve", 12.0, 1.7, description, "clips"))
    return MotionConfig(source="clips", clips=ClipsConfig(folder=str(folder)))


def _kimodo(folder: Path) -> MotionConfig:
    """A stand-in for the program, which plays strides of the procedural source."""
    motions = {
        word: _procedural("brisk", 8.0, 1.8, description, "kimodo")
        for word, description in {"walk": "walks", "phone": _PHONE}.items()
    }
    program = install_fake_kimodo(folder, motions, sample_skeleton(1.8))
    return MotionConfig(source="kimodo", kimodo=KimodoConfig(program=str(program)))


ROOM_SAMPLES = {
    "file": RoomSample(kinds=("livingroom", "kitchen"), config=_two_scenes, marks=(pytest.mark.blender,)),
    # One small room: each takes a minute in a Blender process of its own.
    "infinigen": RoomSample(
        kinds=("bathroom",), marks=(pytest.mark.slow, pytest.mark.blender, pytest.mark.infinigen), many_draws=False
    ),
}
BODY_SAMPLES = {"smplx": _smplx}
MOTION_SAMPLES = {"clips": _clips, "kimodo": _kimodo}
# A recording holds the time of its making.
EXPORTER_SAMPLES = {
    "rerun": ExporterSample(
        repeatable=False,
        marks=(pytest.mark.skipif(find_spec("rerun") is None, reason="needs the extra perpetua[rerun]"),),
    )
}
