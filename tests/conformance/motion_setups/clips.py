"""Clips for the conformance suite: walks of the procedural source, written as AMASS writes them."""

from dataclasses import replace
from pathlib import Path

from perpetua.motion.config import ClipsConfig, MotionConfig
from perpetua.motion.source import MOTION_SOURCES
from perpetua.seeding import StageSeed
from tests.support.motion_files import write_amass
from tests.support.motion_samples import empty_room, sample_route, sample_skeleton

_DESCRIPTIONS = {"walk.npz": "walks", "walk_talk_phone.npz": "walks while talking on the phone"}


def motion_config(folder: Path) -> MotionConfig:
    """The source's config, with the files it reads in ``folder``."""
    skeleton, fps = sample_skeleton(), 30.0
    for name, description in _DESCRIPTIONS.items():
        route = replace(sample_route("curve", fps, 12.0), description=description)
        seed = StageSeed(5, 0, "clips")
        motion = MOTION_SOURCES["procedural"]().make(route, skeleton, empty_room(), fps, MotionConfig(), seed)
        write_amass(folder / name, motion)
    return MotionConfig(source="clips", clips=ClipsConfig(folder=str(folder)))
