"""The render stage: writes the job, keeps Blender running until every frame is there, reads the frames."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from perpetua.errors import RenderError
from perpetua.io.files import read_json, write_json
from perpetua.machine.blender import BlenderError, Event, run_script
from perpetua.machine.devices import DEVICES
from perpetua.rendering.bake import bake_room
from perpetua.rendering.config import RenderConfig
from perpetua.rendering.frames import DamagedFrameError, assemble_view, drop_damaged
from perpetua.rendering.job import FRAME_FOLDER, NO_SEED, PENDING_FILE, RENDER_SCRIPT, write_job
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room
from perpetua.scene.scene import RenderedView
from perpetua.seeding import StageSeed

logger = logging.getLogger(__name__)

MAX_OBJECT_INDEX = 65535
BAKED_FOLDER = "baked"
WHOLE_VIEWS: Mapping[int, float] = MappingProxyType({})


def render_views(
    room: Room,
    actors: tuple[ActorMesh, ...],
    cameras: tuple[CameraPath, ...],
    config: RenderConfig,
    device: str,
    work_dir: Path,
    on_frame: Callable[[int, int, float], None],
    script: Path = RENDER_SCRIPT,
    result_dir: Path | None = None,
    near_m: Mapping[int, float] = WHOLE_VIEWS,
    seed: StageSeed = NO_SEED,
    cache_dir: Path | None = None,
) -> tuple[RenderedView, ...]:
    """Renders synchronized RGB, depth and object index of all views.

    Frames that are complete in ``work_dir`` from an earlier, interrupted call with the same arguments are kept;
    damaged ones are rendered again; another job's are removed.

    Args:
        room: the room; opened from its .blend if it has one, else built from its objects and lights.
        actors: posed at every frame of the cameras.
        cameras: at least one; all with the same number of frames.
        config: the render section of the config.
        device: one of ``DEVICES``.
        work_dir: folder that outlives this call, for the job and what is needed to go on with it.
        on_frame: called with (frames done, frames in all, seconds of this frame).
        script: the worker that Blender runs.
        result_dir: folder for the files that the returned arrays are mapped from; None: ``work_dir``.
        near_m: by number of camera, the depth at which its view begins: what is nearer is left out of the picture,
            and still blocks and reflects light. Exposure is not metered on such a cutaway.
        seed: decides how cameras deviate from ideal ones (``config.sensor``).
        cache_dir: folder for what is baked of the room, of use to other jobs in the same room; None: ``work_dir``.

    Returns:
        One view per camera, in the order of the cameras.

    Raises:
        RenderError: Blender failed more than ``config.max_restarts`` times in a row without a new frame, or the job
            cannot be rendered.
        EnvironmentSetupError: a system library that Blender needs is not installed.
    """
    frame_count = _check_job(room, actors, cameras, device)
    work_dir.mkdir(parents=True, exist_ok=True)
    if room.blend_path is not None:
        baked = bake_room(room, cameras, config, frame_count * len(cameras), cache_dir or work_dir / BAKED_FOLDER)
        room = replace(room, blend_path=baked)
    job_path = write_job(work_dir, room, actors, cameras, config, device, near_m, seed)
    frames = work_dir / FRAME_FOLDER
    repeats = 0
    while True:
        _render_pending(job_path, cameras, frame_count, config, on_frame, script)
        try:
            return tuple(assemble_view(frames, camera, frame_count, result_dir or work_dir) for camera in cameras)
        except DamagedFrameError as error:
            if repeats == config.max_restarts:
                raise
            repeats += 1
            logger.warning("%s; it was removed and is rendered again", error)


def _check_job(room: Room, actors: tuple[ActorMesh, ...], cameras: tuple[CameraPath, ...], device: str) -> int:
    if device not in DEVICES:
        raise RenderError(f"the device must be one of {', '.join(DEVICES)}, not '{device}'")
    if not cameras:
        raise RenderError("at least one camera is needed to render, not 0: raise cameras.count")
    frame_count = len(cameras[0].world_from_camera)
    lengths = {f"camera {camera.camera}": len(camera.world_from_camera) for camera in cameras}
    lengths |= {f"actor {actor.actor}": len(actor.vertices_m) for actor in actors}
    for name, length in lengths.items():
        if length != frame_count:
            raise RenderError(f"all cameras and actors must have {frame_count} frames; {name} has {length}")
    taken = [obj.object_index for obj in room.objects] + [actor.object_index for actor in actors]
    if len(set(taken)) != len(taken) or min(taken) < 1 or max(taken) > MAX_OBJECT_INDEX:
        raise RenderError(f"object indices must be unique and from 1 to {MAX_OBJECT_INDEX}; these are not: {taken}")
    return frame_count


def _render_pending(
    job_path: Path,
    cameras: tuple[CameraPath, ...],
    frame_count: int,
    config: RenderConfig,
    on_frame: Callable[[int, int, float], None],
    script: Path,
) -> None:
    """Starts Blender until no frame is missing; each new frame renews the number of restarts that it has."""
    frames = job_path.parent / FRAME_FOLDER
    restarts = 0
    pending = drop_damaged(frames, cameras, frame_count)
    while pending:
        write_json(job_path.parent / PENDING_FILE, {"frames": pending})
        listener = _Listener(frame_count, len(pending), on_frame)
        try:
            run_script(
                script,
                job_path,
                blender=config.blender,
                scratch=job_path.parent,
                silence_timeout_s=config.frame_timeout_s,
                on_event=listener,
            )
            failure = BlenderError("Blender ended without an error, but frames are missing or damaged", "")
        except BlenderError as error:
            failure = error
        if not (left := drop_damaged(frames, cameras, frame_count)):
            return
        restarts = 0 if len(left) < len(pending) else restarts
        if restarts == config.max_restarts:
            raise _give_up(failure, left[0], frame_count - len(left), frame_count, restarts)
        restarts += 1
        logger.warning("%s; restart %d of %d at frame %d", failure.reason, restarts, config.max_restarts, left[0])
        if failure.gpu_memory:
            _go_on_without_gpu(job_path)
        pending = left


def _go_on_without_gpu(job_path: Path) -> None:
    logger.warning("the GPU's memory does not hold this room: going on with the CPU")
    write_json(job_path, read_json(job_path) | {"device": "cpu"})


def _give_up(failure: BlenderError, frame: int, done: int, frame_count: int, restarts: int) -> RenderError:
    return RenderError(
        f"rendering stopped at frame {frame} ({done} of {frame_count} frames are done and kept) after {restarts} "
        f"restarts: {failure.reason}; {_remedy(failure)}"
        + (f"\nBlender's last lines:\n{failure.tail}" if failure.tail else "")
    )


def _remedy(failure: BlenderError) -> str:
    if failure.memory:
        return "lower --workers, render.width_px, render.height_px or render.max_texels"
    if failure.silent:
        return "raise render.frame_timeout_s if a frame takes that long; on a GPU, try --device cpu"
    return "run the same command again, on a GPU with --device cpu"


class _Listener:
    """Turns the worker's events into progress and log lines."""

    def __init__(self, frame_count: int, pending: int, on_frame: Callable[[int, int, float], None]) -> None:
        self._frame_count = frame_count
        self._done = frame_count - pending
        self._on_frame = on_frame

    def __call__(self, event: Event) -> None:
        match event["event"]:
            case "device":
                logger.info("rendering with %s: %s", event["backend"], event["device"])
                if event["warning"] is not None:
                    logger.warning("%s", event["warning"])
            case "ready":
                red, green, blue = event["gains"]
                logger.info(
                    "exposure %+.2f stops, white balance %.2f %.2f %.2f", event["exposure_ev"], red, green, blue
                )
            case "frame":
                self._done += 1
                self._on_frame(self._done, self._frame_count, float(event["seconds"]))
