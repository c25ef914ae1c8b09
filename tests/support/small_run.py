"""The synthetic scene as a finished run: output folder, sequence, work area; no Blender."""

from pathlib import Path

import numpy as np

from perpetua.config import load_config
from perpetua.formats.tapvid_mv import write_sequence
from perpetua.pipeline import codec
from perpetua.pipeline.layout import RunLayout, open_run
from perpetua.pipeline.record import sequence_record
from perpetua.pipeline.stages import STAGES
from perpetua.pipeline.store import Manifest, output_hashes
from perpetua.scene.actor import Route
from perpetua.seeding import StageSeed
from perpetua.testing.synthetic_scene import make_scene
from perpetua.testing.synthetic_sequence import make_scene_tracks

TRACKS = 60


def write_run(out: Path, seed: int, room: int = 0) -> Path:
    """Writes a run of one room into ``out``; returns the sequence's folder."""
    config = load_config("tiny", assignments=(f"tracks.count={TRACKS}",))
    open_run(out, seed, range(room, room + 1), config, False)
    layout = RunLayout(out, config.export, seed).room(room)
    layout.sequence_folder.mkdir(parents=True)
    scene = make_scene()
    routes = tuple(Route(actor.actor, np.zeros((6, 3)), np.zeros(6)) for actor in scene.actors)
    values = {
        "room": scene.room, "routes": routes, "motion": scene.motions, "actors": scene.actors,
        "cameras": scene.cameras, "render": scene.views,
    }  # fmt: skip
    for stage in STAGES:
        if stage.name in values:
            folder = layout.stage(stage)
            partial = folder.begin("key", False)
            codec.save(values[stage.name], partial)
            folder.finish(Manifest("key", stage.name, 1, seed, room, {}, output_hashes(partial), 0.0, 0.0))
    record = sequence_record(config, StageSeed(seed, room, "tracks"), scene, routes)
    tracks = make_scene_tracks(scene, config.tracks, seed)
    write_sequence(layout.sequence_folder, scene, tracks, record)
    return layout.sequence_folder
