"""What a run will cost, said before it starts, and whether the disk has room for it."""

import os
import shutil
from dataclasses import dataclass
from pathlib import Path

from perpetua.config import Config
from perpetua.errors import InputError
from perpetua.pipeline.os_errors import DiskError

# Measured on finished rooms and rounded up: a pixel of a JPEG at quality 95, a vertex of a dressed body at one frame,
# a body's textures and faces, a room's meshes and .blend, and a texel of its three baked passes.
_JPEG_BYTES_PER_PIXEL = 0.6
_ACTOR_BYTES_PER_FRAME = 25_000 * 12
_ACTOR_BYTES = 15_000_000
_ROOM_BYTES = 60_000_000
_BYTES_PER_TEXEL = 20
# Files of a room beside those of its views and of frames that are being rendered.
_ROOM_FILES = 60
# The most that one room needed in a worker that had made others before, processes of Blender included, rounded up.
_INFINIGEN_ROOM_MB = 3500.0
_OTHER_ROOM_MB = 2200.0
# A disk that will be fuller than this share of what is free now is worth a word.
TIGHT_FRACTION = 0.8


@dataclass(frozen=True)
class Cost:
    """Counts, disk and memory of a run; sizes in bytes, memory in megabytes per room at work.

    ``work_bytes`` is what stays of a room's work, by ``work.keep``; ``busy_bytes`` is the most that a room's work takes
    while it is under way.
    """

    rooms: int
    frames: int
    images: int
    sequence_bytes: float
    work_bytes: float
    busy_bytes: float
    room_files: int
    workers: int
    room_memory_mb: float

    @property
    def room_bytes(self) -> float:
        """What must be free for one more room."""
        return self.sequence_bytes + self.busy_bytes

    @property
    def total_bytes(self) -> float:
        """Disk of all rooms: finished ones with what is kept of their work, and those under way beside them."""
        under_way = min(self.workers, self.rooms) * (self.busy_bytes - self.work_bytes)
        return self.rooms * (self.sequence_bytes + self.work_bytes) + under_way


def estimate_cost(config: Config, rooms: int, workers: int = 1) -> Cost:
    """Frames, images and disk of ``rooms`` sequences made by so many workers."""
    frames, views, actors = config.sequence.frames, config.cameras.count, config.actors.count
    images = frames * views
    pixels = images * config.render.width_px * config.render.height_px
    entries = config.tracks.count * frames
    jpeg_bytes = _JPEG_BYTES_PER_PIXEL * pixels
    bodies_bytes = actors * (_ACTOR_BYTES + frames * _ACTOR_BYTES_PER_FRAME)
    scene_bytes = _ROOM_BYTES + bodies_bytes + jpeg_bytes + pixels * (4 + 2)
    tracks_bytes = entries * (24 + 25 * views)
    # While frames are rendered, they lie there once more, beside a copy of the bodies and the baked room.
    rendering_bytes = jpeg_bytes + pixels * 8 + bodies_bytes + _ROOM_BYTES + _BYTES_PER_TEXEL * config.render.max_texels
    kept_bytes = {"all": scene_bytes + tracks_bytes, "tracks": scene_bytes, "none": 0.0}[config.work.keep]
    return Cost(
        rooms,
        frames,
        images,
        sequence_bytes=jpeg_bytes + pixels * (4 + 1) + entries * (12 + 36 + views),
        work_bytes=kept_bytes,
        busy_bytes=scene_bytes + tracks_bytes + rendering_bytes,
        room_files=_ROOM_FILES + 8 * views + frames * (2 * views + 2),
        workers=workers,
        room_memory_mb=_INFINIGEN_ROOM_MB if config.rooms.source == "infinigen" else _OTHER_ROOM_MB,
    )


def check_disk(cost: Cost, out: Path) -> float:
    """Free bytes where ``out`` will be.

    Raises:
        InputError: the rooms would not fit, in bytes or in number of files.
    """
    place = _existing(out)
    free = float(shutil.disk_usage(place).free)
    if free < cost.total_bytes:
        raise InputError(
            f"{cost.rooms} room(s) need about {gigabytes(cost.total_bytes)} on the disk of '{out}', which has "
            f"{gigabytes(free)} free: choose another --out, --set work.keep=none or tracks, or lower --rooms, "
            "--workers, sequence.frames or render.width_px"
        )
    status = os.statvfs(place)
    # File systems that do not count files say that there are none.
    if status.f_files and status.f_favail < cost.room_files:
        raise InputError(
            f"one room needs about {cost.room_files} files on the disk of '{out}', which has place for "
            f"{status.f_favail} more: choose another --out, or remove files there"
        )
    return free


def require_room_space(cost: Cost, out: Path) -> None:
    """Passes if one more room fits, so that none is begun that the disk cannot hold.

    Raises:
        DiskError: it does not.
    """
    free = float(shutil.disk_usage(_existing(out)).free)
    if free < cost.room_bytes:
        raise DiskError(
            f"a room needs about {gigabytes(cost.room_bytes)} and the disk of '{out}' has {gigabytes(free)} left: free "
            "space (perpetua clean frees the work of finished rooms), then run the same command again"
        )


def _existing(out: Path) -> Path:
    place = out.absolute()
    while not place.exists():
        place = place.parent
    return place


def gigabytes(size: float) -> str:
    """A size for people."""
    return f"{size / 1e9:.1f} GB" if size >= 1e8 else f"{size / 1e6:.1f} MB"
