"""A stand-in for Kimodo for the conformance suite, playing strides of the procedural source."""

from dataclasses import replace
from pathlib import Path

from perpetua.motion.config import KimodoConfig, MotionConfig
from perpetua.motion.source import MOTION_SOURCES
from perpetua.seeding import StageSeed
from tests.support.motion_files import install_fake_kimodo
from tests.support.motion_samples import empty_room, sample_route, sample_skeleton

_DESCRIPTIONS = {"walk": "walks", "phone": "walks while talking on the phone"}


def motion_config(folder: Path) -> MotionConfig:
    """The source's config, with the program it runs in ``folder``."""
    skeleton, motions = sample_skeleton(1.8), {}
    for word, description in _DESCRIPTIONS.items():
        route = replace(sample_route("brisk", 30.0, 8.0), description=description)
        motions[word] = MOTION_SOURCES["procedural"]().make(
            route, skeleton, empty_room(), 30.0, MotionConfig(), StageSeed(5, 0, "kimodo")
        )
    program = install_fake_kimodo(folder, motions, skeleton)
    return MotionConfig(source="kimodo", kimodo=KimodoConfig(program=str(program)))
