"""Time and memory of the track stage at scale: propagation, visibility by image, confirmation by ray, selection.

    perpetua generate --preset benchmark --seed 5 --rooms 1 --until cameras --out planned
    python benchmarks/tracks.py planned/.work/seed5-room0000 --count 1024 20000 --images images

Room, actors and cameras are those of a real run. Depth and object index are not rendered: they are cast at the
same meshes by the track stage's own rays, once, into the folder ``--images``. So this measures how long tracks take,
and says nothing of how well image and rays agree (benchmarks/visibility_rules.py does). Each count runs in a process of
its own; memory includes the pages of images and meshes that are mapped from disk.
"""

import argparse
import hashlib
import multiprocessing
import resource
import time
from pathlib import Path

import numpy as np

from perpetua.actors.types import ActorMesh
from perpetua.cameras.types import CameraPath
from perpetua.geometry.transforms import transform_points
from perpetua.pipeline.codec import load
from perpetua.rendering.types import RenderedView
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed
from perpetua.tracks.config import TracksConfig
from perpetua.tracks.follow import TrackScene
from perpetua.tracks.make import make_tracks
from perpetua.tracks.sight import SceneSight
from perpetua.tracks.surface import SceneMeshes, SurfacePoints
from perpetua.tracks.types import SequenceTracks


class Watch:
    """Wall and CPU seconds since it was made."""

    def __init__(self) -> None:
        self._wall, self._cpu = time.monotonic(), time.process_time()

    def __str__(self) -> str:
        return f"{time.monotonic() - self._wall:6.1f} s wall {time.process_time() - self._cpu:6.1f} s CPU"


class TimedScene(TrackScene):
    """Says how long the last step takes: the chosen points followed through all frames and views."""

    def follow(self, points: SurfacePoints) -> SequenceTracks:
        """The tracks of points."""
        watch = Watch()
        tracks = super().follow(points)
        print(f"  following the chosen ones       {watch}")
        return tracks


def _load(work: Path, frames: int) -> tuple[Room, tuple[ActorMesh, ...], tuple[CameraPath, ...]]:
    """Room, actors and cameras of a kept work area, cut to the first frames."""
    room, actors, cameras = (load(work / folder) for folder in ("10_room", "50_actors", "60_cameras"))
    actors = tuple(
        ActorMesh(actor.actor, actor.object_index, actor.description, actor.parts, actor.vertices_m[:frames])
        for actor in actors
    )
    return room, actors, tuple(CameraPath(c.camera, c.world_from_camera[:frames], c.intrinsics) for c in cameras)


def _images(
    folder: Path, room: Room, actors: tuple[ActorMesh, ...], cameras: tuple[CameraPath, ...]
) -> tuple[RenderedView, ...]:
    """Depth and object index at pixel centres, cast unless the folder has them."""
    frames = len(cameras[0].world_from_camera)
    if not (folder / "done").exists():
        folder.mkdir(parents=True, exist_ok=True)
        _cast_images(folder, SceneSight(SceneMeshes.of(room, actors)), cameras, frames)
        (folder / "done").touch()
    views = []
    for camera in cameras:
        depth_m, index = (np.load(folder / f"{name}_{camera.camera}.npy", mmap_mode="r") for name in ("depth", "index"))
        views.append(RenderedView(camera.camera, (b"",) * frames, depth_m[:frames], index[:frames]))
    return tuple(views)


def _cast_images(folder: Path, sight: SceneSight, cameras: tuple[CameraPath, ...], frames: int) -> None:
    size = cameras[0].intrinsics
    shape = (frames, size.height_px, size.width_px)
    row, column = np.mgrid[: size.height_px, : size.width_px].reshape(2, -1)
    stored = [
        [
            np.lib.format.open_memmap(folder / f"{name}_{camera.camera}.npy", "w+", kind, shape)
            for name, kind in (("depth", np.float32), ("index", np.uint16))
        ]
        for camera in cameras
    ]
    for frame in range(frames):
        for camera, (depth_m, index) in zip(cameras, stored, strict=True):
            inner, pose = camera.intrinsics, camera.world_from_camera[frame]
            ray = np.stack(
                [(column - inner.cx_px) / inner.fx_px, (row - inner.cy_px) / inner.fy_px, np.ones(row.size)], 1
            )
            direction = transform_points(pose, ray) - pose[:3, 3]
            hits = sight.first_hit(frame, pose[:3, 3].copy(), direction)
            along_m = np.where(hits.object_index > 0, hits.distance_m / np.linalg.norm(ray, axis=1), 0.0)
            depth_m[frame], index[frame] = along_m.reshape(shape[1:]), hits.object_index.reshape(shape[1:])


def _measure(work: Path, images: Path, frames: int, count: int, seed: int) -> None:
    room, actors, cameras = _load(work, frames)
    views = _images(images, room, actors, cameras)
    whole = Watch()
    scene = TimedScene(room, actors, cameras, views, TracksConfig(count=count))
    print(f"{count} tracks, {scene.frames} frames, {len(views)} views\n  meshes made ready for rays      {whole}")
    tracks = make_tracks(scene, StageSeed(seed, 0, "tracks"))
    made = (tracks.points.position_m, tracks.views.visible, tracks.queries_xytv)
    digest = hashlib.sha256(b"".join(array.tobytes() for array in made)).hexdigest()[:16]
    peak_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"  all, drawing and choosing too   {whole}, peak {peak_gb:.2f} GB, sha256 {digest}\n  {tracks.report}")


def main() -> None:
    """Measures each count in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path, help="work area of a sequence, made at least to its cameras")
    parser.add_argument("--count", type=int, nargs="+", default=[1024, 20000])
    parser.add_argument("--frames", type=int, default=240, help="most frames of the sequence that are used")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--images", type=Path, required=True, help="folder of the cast images, kept")
    arguments = parser.parse_args()
    room, actors, cameras = _load(arguments.work, arguments.frames)
    watch = Watch()
    _images(arguments.images, room, actors, cameras)
    print(f"images cast, or found             {watch}", flush=True)
    processes = multiprocessing.get_context("spawn")
    for count in arguments.count:
        given = (arguments.work, arguments.images, arguments.frames, count, arguments.seed)
        process = processes.Process(target=_measure, args=given)
        process.start()
        process.join()


if __name__ == "__main__":
    main()
