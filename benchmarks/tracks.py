"""Time and memory of the track stage at scale: propagation, visibility by image, confirmation by ray, selection.

    perpetua generate --preset benchmark --seed 5 --rooms 1 --until cameras --out planned
    python benchmarks/tracks.py planned/.work/seed5-room0000 --count 1024 20000 --images images --hold 4

Room, actors and cameras are those of a real run. Depth and object index are not rendered: they are cast at the
same meshes by the track stage's own rays, once, into the folder ``--images``; ``--hold 4`` shows every fourth pose for
four frames, which saves three quarters of that, and nothing in what is measured. So this measures how long tracks take,
and says nothing of how well image and rays agree (benchmarks/visibility_rules.py does). Each count runs in a process of
its own; memory includes the pages of images and meshes that are mapped from disk.
"""

import argparse
import hashlib
import multiprocessing
import resource
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from perpetua.pipeline.codec import load
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room
from perpetua.scene.scene import RenderedView, Scene
from perpetua.seeding import StageSeed
from perpetua.tracks.config import TracksConfig
from perpetua.tracks.follow import TrackScene
from perpetua.tracks.make import make_tracks
from perpetua.tracks.ray_caster import SceneRayCaster
from perpetua.tracks.surface import SceneMeshes, SurfacePoints
from perpetua.tracks.types import SequenceTracks

IMAGES = {"depth": np.float32, "index": np.uint16}


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


@dataclass(frozen=True)
class Given:
    """Where the scene comes from: work area, folder of cast images, frames, and frames for which each pose is held."""

    work: Path
    images: Path
    frames: int
    hold: int

    def scene(self) -> tuple[Room, tuple[ActorMesh, ...], tuple[CameraPath, ...]]:
        """Room, and actors and cameras at the poses that are shown."""
        room, actors, cameras = (load(self.work / folder) for folder in ("10_room", "50_actors", "60_cameras"))
        frames = min(self.frames, len(cameras[0].world_from_camera))
        shown = np.arange(frames) // self.hold * self.hold
        actors = tuple(replace(actor, vertices_m=np.asarray(actor.vertices_m)[shown]) for actor in actors)
        return room, actors, tuple(replace(path, world_from_camera=path.world_from_camera[shown]) for path in cameras)


def _images(
    given: Given, room: Room, actors: tuple[ActorMesh, ...], cameras: tuple[CameraPath, ...]
) -> tuple[RenderedView, ...]:
    """Depth and object index at pixel centres, cast unless the folder has them."""
    frames = len(cameras[0].world_from_camera)
    if not (given.images / "done").exists():
        given.images.mkdir(parents=True, exist_ok=True)
        _cast_images(given, SceneRayCaster(SceneMeshes.of(Scene(room, actors))), cameras)
        (given.images / "done").touch()
    views = []
    for camera in cameras:
        depth_m, index = (np.load(given.images / f"{name}_{camera.camera}.npy", mmap_mode="r") for name in IMAGES)
        views.append(RenderedView(camera.camera, (b"",) * frames, depth_m, index))
    return tuple(views)


def _cast_images(given: Given, ray_caster: SceneRayCaster, cameras: tuple[CameraPath, ...]) -> None:
    size = cameras[0].intrinsics
    shape = (len(cameras[0].world_from_camera), size.height_px, size.width_px)
    row, column = np.mgrid[: size.height_px, : size.width_px].reshape(2, -1)
    for camera in cameras:
        depth_m, index = (
            np.lib.format.open_memmap(given.images / f"{name}_{camera.camera}.npy", "w+", kind, shape)
            for name, kind in IMAGES.items()
        )
        inner = camera.intrinsics
        x, y = (column - inner.cx_px) / inner.fx_px, (row - inner.cy_px) / inner.fy_px
        ray = np.stack([x, y, np.ones(row.size)], axis=1)
        for frame in range(0, shape[0], given.hold):
            pose, held = camera.world_from_camera[frame], slice(frame, frame + given.hold)
            hits = ray_caster.first_hit(frame, pose[:3, 3].copy(), ray @ pose[:3, :3].T)
            along_m = np.where(hits.object_index > 0, hits.distance_m / np.linalg.norm(ray, axis=1), 0.0)
            depth_m[held], index[held] = along_m.reshape(shape[1:]), hits.object_index.reshape(shape[1:])


def _measure(given: Given, count: int, seed: int) -> None:
    room, actors, cameras = given.scene()
    views = _images(given, room, actors, cameras)
    whole = Watch()
    scene = TimedScene(Scene(room, actors, cameras, views=views), TracksConfig(count=count))
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
    parser.add_argument("--hold", type=int, default=1, help="frames for which each pose is held")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--images", type=Path, required=True, help="folder of the cast images, kept")
    arguments = parser.parse_args()
    given = Given(arguments.work, arguments.images, arguments.frames, arguments.hold)
    watch = Watch()
    _images(given, *given.scene())
    print(f"images cast, or found             {watch}", flush=True)
    processes = multiprocessing.get_context("spawn")
    for count in arguments.count:
        process = processes.Process(target=_measure, args=(given, count, arguments.seed))
        process.start()
        process.join()


if __name__ == "__main__":
    main()
