"""The scenes of the benchmark of rendering: finished up to their cameras, and the room as Infinigen made it."""

import json
import resource
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import psutil
from jaxtyping import Float32, UInt8
from PIL import Image as Pillow

from perpetua.config import Config
from perpetua.io.files import read_json, write_json
from perpetua.machine.blender import Event, run_script
from perpetua.machine.memory import PeakMemory
from perpetua.pipeline import codec
from perpetua.pipeline.layout import read_run
from perpetua.pipeline.runner import rejected_draws
from perpetua.pipeline.stages import STAGES
from perpetua.rendering.bake import bake_room
from perpetua.rendering.config import RenderConfig
from perpetua.rendering.job import write_job
from perpetua.rooms.acceptance.build import REPORT_FILE
from perpetua.rooms.infinigen import SCRIPT, room_job
from perpetua.rooms.script_output import read_room
from perpetua.rooms.source import RoomWish
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

PLAIN_LOOP = Path(__file__).parent / "blender" / "plain_loop.py"
AS_MADE_FILE = "as_made.blend"
SILENCE_S = 3600.0


@dataclass(frozen=True)
class Scene:
    """A room with actors and cameras; ``as_made`` is the room's .blend as Infinigen left it."""

    name: str
    room: Room
    actors: tuple[ActorMesh, ...]
    cameras: tuple[CameraPath, ...]
    config: Config
    as_made: Path
    folder: Path

    def at(self, width_px: int, frames: int | None = None) -> "Scene":
        """The same scene for images of another width, at so many of its frames, evenly chosen (None: all)."""
        cameras = tuple(_scaled(camera, width_px) for camera in self.cameras)
        if frames is None:
            return replace(self, cameras=cameras)
        count = len(cameras[0].world_from_camera)
        chosen = np.unique(np.round(np.linspace(0, count - 1, frames)).astype(int))
        return replace(
            self,
            cameras=tuple(replace(one, world_from_camera=one.world_from_camera[chosen]) for one in cameras),
            actors=tuple(replace(actor, vertices_m=actor.vertices_m[chosen]) for actor in self.actors),
        )

    def first_frames(self, count: int) -> "Scene":
        """The same scene, cut short."""
        return replace(
            self,
            cameras=tuple(replace(one, world_from_camera=one.world_from_camera[:count]) for one in self.cameras),
            actors=tuple(replace(actor, vertices_m=actor.vertices_m[:count]) for actor in self.actors),
        )


def _scaled(camera: CameraPath, width_px: int) -> CameraPath:
    old = camera.intrinsics
    fraction = width_px / old.width_px
    new = replace(
        old,
        fx_px=fraction * old.fx_px,
        fy_px=fraction * old.fy_px,
        cx_px=fraction * (old.cx_px + 0.5) - 0.5,
        cy_px=fraction * (old.cy_px + 0.5) - 0.5,
        width_px=width_px,
        height_px=round(fraction * old.height_px),
    )
    return replace(camera, intrinsics=new)


def load_scene(out: Path, folder: Path) -> Scene:
    """Reads the first room of ``perpetua generate --until cameras --out OUT`` and makes its ``as_made.blend``."""
    record = read_run(out)
    number = record.rooms[0]
    layout = record.layout(out).room(number)
    values = {
        stage.name: codec.load(layout.stage(stage).final)
        for stage in STAGES
        if stage.name in {"room", "actors", "cameras"}
    }
    folder.mkdir(parents=True, exist_ok=True)
    as_made = folder / AS_MADE_FILE
    if not as_made.is_file():
        stage = STAGES[0]
        redraw = stage.redraw(rejected_draws(layout, record.config), record.config.redraw)
        seed = StageSeed(record.seed, number, stage.name, redraw)
        report = read_json(layout.stage(stage).final / REPORT_FILE)
        _make_again(values["room"], report, record.config, seed, as_made)
    return Scene(out.name, values["room"], values["actors"], values["cameras"], record.config, as_made, folder)


def _make_again(room: Room, report: dict[str, Any], config: Config, seed: StageSeed, as_made: Path) -> None:
    """Has Infinigen make the room once more, and keeps it as it is before it is prepared for rendering."""
    wish = RoomWish(**{**report["wish"], "size_m": tuple(report["wish"]["size_m"])})
    scratch = as_made.parent / "infinigen"
    scratch.mkdir(exist_ok=True)
    job = room_job(wish, config.rooms, seed, len(report["redraws"]), scratch)
    (scratch / "job.json").write_text(json.dumps(job | {"as_made": True}), encoding="utf-8")
    run_script(
        SCRIPT,
        scratch / "job.json",
        blender=None,
        scratch=scratch,
        silence_timeout_s=SILENCE_S,
        on_event=lambda _: None,
    )
    again = read_room(scratch, room.name, scratch / "room.blend")
    for before, after in zip(room.objects, again.objects, strict=True):
        np.testing.assert_array_equal(before.mesh.vertices_m, after.mesh.vertices_m, f"{before.name} is not the same")
    (scratch / AS_MADE_FILE).replace(as_made)
    shutil.rmtree(scratch)


@dataclass(frozen=True)
class Image:
    """One image for the plain loop; ``border_px`` is left, top, right, bottom (the last two exclusive)."""

    stem: str
    frame: int
    camera: int
    samples: int
    border_px: tuple[int, int, int, int] | None = None
    seed: int = 0


@dataclass(frozen=True)
class Loop:
    """How the plain loop renders: which .blend, what Cycles keeps, whose sampling settings."""

    name: str
    blend_path: Path
    persistent: bool
    sampling: str
    denoise: bool
    exposure_ev: float | None = None


@dataclass(frozen=True)
class Rendered:
    """What a loop gave: its events by name, and its folder with ``stem``.png and ``stem``.exr of each image."""

    events: tuple[Event, ...]
    folder: Path

    def one(self, name: str) -> Event:
        """The only event of a name."""
        (event,) = [event for event in self.events if event["event"] == name]
        return event

    def picture(self, stem: str) -> UInt8[np.ndarray, "H W 3"]:
        """An image as displayed."""
        return np.asarray(Pillow.open(self.folder / f"{stem}.png").convert("RGB"))

    def linear(self, stem: str, noisy: bool = False) -> Float32[np.ndarray, "H W 3"]:
        """An image in linear light; ``noisy``: before denoising."""
        with OpenEXR.File(str(self.folder / f"{stem}.exr"), separate_channels=True) as file:
            channels = file.channels()
            name = "Noisy Image" if noisy else "Combined"
            return np.stack([np.asarray(channels[f"ViewLayer.{name}.{part}"].pixels) for part in "RGB"], axis=-1)

    def images(self) -> dict[str, Event]:
        """CPU and wall seconds of each image by its stem."""
        return {event["stem"]: event for event in self.events if event["event"] == "image"}


def run_loop(scene: Scene, loop: Loop, images: list[Image], render: RenderConfig) -> Rendered:
    """Renders images one by one with the plain loop; what an earlier run with the same job left is used again."""
    folder = scene.folder / loop.name
    folder.mkdir(parents=True, exist_ok=True)
    render_job = write_job(folder, scene.room, scene.actors, scene.cameras, render, "cpu", {})
    job: dict[str, Any] = {
        "render_job": str(render_job),
        "blend_path": str(loop.blend_path),
        "persistent": loop.persistent,
        "sampling": loop.sampling,
        "denoise": loop.denoise,
        "exposure_ev": loop.exposure_ev,
        "images": [vars(image) for image in images],
        "digest": read_json(render_job)["digest"],
    }
    path = folder / "plain_loop.json"
    done = read_json(folder / "done.json")
    if done and read_json(path) == json.loads(json.dumps(job)):
        return Rendered(tuple(done["events"]), folder)
    (folder / "done.json").unlink(missing_ok=True)
    write_json(path, job)
    events: list[Event] = []
    run_script(
        PLAIN_LOOP,
        path,
        blender=None,
        scratch=folder,
        silence_timeout_s=SILENCE_S,
        on_event=events.append,
    )
    write_json(folder / "done.json", {"events": events})
    return Rendered(tuple(events), folder)


FRAMES, VIEWS = 240, 4


def bake_scene(scene: Scene, width_px: int, max_texels: int) -> tuple[Path, float]:
    """The room baked for a whole sequence of images of a width; and the CPU seconds that this took, once."""
    config = RenderConfig(width_px=width_px, height_px=width_px, max_texels=max_texels)
    with spent_by_children() as spent:
        cameras = scene.at(width_px).cameras
        baked = bake_room(scene.room, cameras, config, FRAMES * VIEWS, scene.folder / "baked")
    path = baked.with_suffix(".cost.json")
    if not path.is_file():
        write_json(path, {"cpu_s": spent.cpu_s})
    return baked, float(read_json(path)["cpu_s"])


class Spent:
    """CPU seconds, and the peak of memory in megabytes, of the children that ended while it was measured."""

    cpu_s = 0.0
    peak_mb = 0.0


@contextmanager
def spent_by_children() -> Iterator[Spent]:
    """Measures what subprocesses use."""
    spent, before_s = Spent(), _children_cpu_s()
    with PeakMemory() as memory:
        yield spent
    spent.cpu_s = _children_cpu_s() - before_s
    spent.peak_mb = memory.peak_mb - psutil.Process().memory_info().rss / 1e6


def _children_cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
