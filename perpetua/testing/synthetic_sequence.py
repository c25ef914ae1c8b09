"""The synthetic scene as a finished sequence on disk."""

from pathlib import Path

from perpetua.formats.tapvid_mv import write_sequence
from perpetua.scene.scene import Scene
from perpetua.seeding import StageSeed
from perpetua.testing.synthetic_scene import make_scene
from perpetua.tracks.config import TracksConfig
from perpetua.tracks.follow import TrackScene
from perpetua.tracks.make import make_tracks
from perpetua.tracks.types import SequenceTracks

CONFIG = TracksConfig(count=200)


def make_scene_tracks(scene: Scene, config: TracksConfig = CONFIG, seed: int = 5) -> SequenceTracks:
    """Tracks of the synthetic scene."""
    seen = TrackScene(scene, config)
    return make_tracks(seen, StageSeed(seed, 0, "tracks"))


def write_scene(folder: Path, outputs: tuple[str, ...] = ()) -> tuple[Scene, SequenceTracks]:
    """Writes the synthetic scene in the benchmark layout, with labels of every pixel on demand."""
    scene = make_scene()
    tracks = make_scene_tracks(scene)
    names = [{"object_index": obj.object_index, "category": obj.category} for obj in scene.room.objects]
    names += [
        {"object_index": actor.object_index, "category": "person", "actor": actor.actor} for actor in scene.actors
    ]
    write_sequence(folder, scene, tracks, {"seed": 5, "objects": names}, outputs)
    return scene, tracks
