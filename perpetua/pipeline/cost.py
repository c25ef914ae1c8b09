"""What a run will cost, said before it starts."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from perpetua.config import Config
from perpetua.errors import InputError

# Bytes of a JPEG pixel at quality 95 of rendered rooms, and of a vertex of a dressed body at one frame; rounded up.
_JPEG_BYTES_PER_PIXEL = 0.6
_ACTOR_BYTES_PER_FRAME = 25_000 * 12
_ROOM_BYTES = 400_000_000
# The most that one room needed in a worker that had made others before, processes of Blender included, rounded up.
_INFINIGEN_ROOM_MB = 3500.0
_OTHER_ROOM_MB = 2200.0


@dataclass(frozen=True)
class Cost:
    """Counts, disk and memory of a run; sizes in bytes, memory in megabytes per room at work."""

    rooms: int
    frames: int
    images: int
    sequence_bytes: float
    work_bytes: float
    room_memory_mb: float

    @property
    def total_bytes(self) -> float:
        """Disk of all rooms, finished sequences and work area."""
        return self.rooms * (self.sequence_bytes + self.work_bytes)


def estimate_cost(config: Config, rooms: int) -> Cost:
    """Frames, images and disk of ``rooms`` sequences."""
    frames, views = config.sequence.frames, config.cameras.count
    images = frames * views
    pixels = images * config.render.width_px * config.render.height_px
    tracks = config.tracks.count * frames
    jpeg_bytes = _JPEG_BYTES_PER_PIXEL * pixels
    sequence_bytes = jpeg_bytes + pixels * (4 + 1) + tracks * (12 + 36 + views)
    actor_bytes = 2 * config.actors.count * frames * _ACTOR_BYTES_PER_FRAME
    work_bytes = jpeg_bytes + pixels * (4 + 2 + 8) + actor_bytes + _ROOM_BYTES
    room_memory_mb = _INFINIGEN_ROOM_MB if config.rooms.source == "infinigen" else _OTHER_ROOM_MB
    return Cost(rooms, frames, images, sequence_bytes, work_bytes, room_memory_mb)


def check_disk(cost: Cost, out: Path) -> float:
    """Free bytes where ``out`` will be.

    Raises:
        InputError: one room would not fit.
    """
    place = out.absolute()
    while not place.exists():
        place = place.parent
    free = shutil.disk_usage(place).free
    needed = cost.sequence_bytes + cost.work_bytes
    if free < needed:
        raise InputError(
            f"one room needs about {gigabytes(needed)} on the disk of '{out}', which has {gigabytes(free)} free: "
            "choose another --out, or lower sequence.frames or render.width_px"
        )
    return float(free)


def gigabytes(size: float) -> str:
    """A size for people."""
    return f"{size / 1e9:.1f} GB" if size >= 1e8 else f"{size / 1e6:.1f} MB"
