"""``perpetua tracks``: other tracks of a finished sequence, without rendering anything."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from perpetua.errors import InputError
from perpetua.formats.config import OUTPUTS
from perpetua.formats.tapvid_mv import write_sequence
from perpetua.pipeline.record import sequence_record
from perpetua.pipeline.store import replace_folder
from perpetua.pipeline.work_area import StoredScene, load_scene
from perpetua.seeding import StageSeed
from perpetua.tracks.follow import TrackScene
from perpetua.tracks.make import make_tracks
from perpetua.tracks.motion import MOVING_M, travel_m
from perpetua.tracks.pixels import make_pixel_tracks
from perpetua.tracks.types import SequenceTracks


@dataclass(frozen=True)
class PixelChoice:
    """Every ``step``-th pixel of one image."""

    view: int
    frame: int
    step: int

    @classmethod
    def parse(cls, text: str) -> "PixelChoice":
        """Reads "VIEW:FRAME:STEP".

        Raises:
            InputError: it is not three whole numbers.
        """
        parts = text.split(":")
        if len(parts) != 3 or not all(part.isdecimal() for part in parts):
            raise InputError(f"pixels are chosen as VIEW:FRAME:STEP, for example 0:12:4, not '{text}'")
        return cls(*(int(part) for part in parts))


def write_other_tracks(
    sequence_folder: Path,
    target: Path,
    count: int,
    seed: int,
    pixels: PixelChoice | None,
    outputs: tuple[str, ...] = (),
) -> SequenceTracks:
    """Writes the sequence once more with other tracks, a whole folder in the benchmark layout.

    Args:
        sequence_folder: a finished sequence whose work area is stored.
        target: folder to write; must not exist.
        count: tracks to draw, with the run's other settings.
        seed: of the draw; the run's own seed and count give the sequence's own tracks.
        pixels: follow these pixels instead of drawing.
        outputs: labels of every pixel to write, besides those of the run.

    Raises:
        InputError: the work area is not stored, or ``target`` exists.
        TrackError: too few points are seen.
    """
    if target.exists():
        raise InputError(f"'{target}' exists: choose another --out, or remove it")
    stored = load_scene(sequence_folder)
    tracks = _make(stored, count, seed, pixels)
    # The record says what the tracks are, which for pixels nobody chose.
    moving = float((travel_m(tracks.points.position_m) > MOVING_M).mean())
    made = {"count": len(tracks.queries_xytv)} | ({} if pixels is None else {"dynamic_share": moving, "min_visible": 1})
    config = stored.run.config
    labels = tuple(name for name in OUTPUTS if name in (*outputs, *config.export.outputs))
    export = config.export.model_copy(update={"outputs": labels})
    config = config.model_copy(update={"tracks": config.tracks.model_copy(update=made), "export": export})
    scene = stored.scene
    record = sequence_record(config, StageSeed(seed, stored.room_number, "tracks"), scene, stored.routes)
    partial = target.with_name(f".{target.name}.partial")
    shutil.rmtree(partial, ignore_errors=True)
    write_sequence(partial, scene, tracks, record, labels)
    replace_folder(partial, target)
    return tracks


def _make(stored: StoredScene, count: int, seed: int, pixels: PixelChoice | None) -> SequenceTracks:
    config = stored.run.config.tracks.model_copy(update={"count": count})
    scene = TrackScene(stored.scene, config)
    if pixels is not None:
        return make_pixel_tracks(scene, pixels.view, pixels.frame, pixels.step)
    return make_tracks(scene, StageSeed(seed, stored.room_number, "tracks"))
