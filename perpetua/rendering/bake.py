"""Bakes a room's procedural materials to image textures before it is rendered, once per room."""

import hashlib
import json
import logging
import shutil
from dataclasses import asdict
from pathlib import Path

import numpy as np

from perpetua.errors import RenderError
from perpetua.io.files import file_sha256, write_json
from perpetua.machine.blender import BlenderError, Event, run_script
from perpetua.machine.scripts import scripts_sha256
from perpetua.rendering.closeness import Closeness, measure_closeness
from perpetua.rendering.config import RenderConfig
from perpetua.resources import SCRIPT_FOLDER
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room

logger = logging.getLogger(__name__)

BAKE_SCRIPT = SCRIPT_FOLDER / "bake" / "bake_materials.py"
# Fewer samples than this in all cost less than baking does.
MIN_SAMPLES = 2_000_000
# Baking stays a small part of rendering: a texel costs about as much as one sample with the original shaders, and each
# of so many samples ahead becomes many times cheaper.
SAMPLES_PER_TEXEL = 40
# Textures with fewer texels than this look blurred at any resolution.
MIN_TEXELS = 600_000


def texel_budget(config: RenderConfig, images: int) -> int:
    """Texels worth baking for so many images; 0: baking does not pay or is switched off."""
    samples = images * config.width_px * config.height_px * config.samples
    if not config.bake or samples < MIN_SAMPLES:
        return 0
    return min(config.max_texels, max(MIN_TEXELS, samples // SAMPLES_PER_TEXEL))


def bake_room(
    room: Room, cameras: tuple[CameraPath, ...], config: RenderConfig, images_ahead: int, cache_dir: Path
) -> Path:
    """Bakes a room that has a .blend, or finds what was baked of it before.

    Below ``cache_dir`` each room has a folder named by its content and the code that bakes it; those of other rooms
    are removed. In it each image is named by the mesh it shows and its texels, so a second sequence in the room bakes
    only the meshes that its cameras see from a different distance, and one with the same cameras none.

    Args:
        room: a room with a ``blend_path``.
        cameras: what will look at it; surfaces that they come close to get finer textures.
        config: the render section of the config.
        images_ahead: how many images will be rendered of this room.
        cache_dir: folder for the baked files; one process at a time uses it.

    Returns:
        The .blend to render: the baked one, or the room's own where baking does not pay.

    Raises:
        RenderError: the room has no .blend, or Blender failed twice.
    """
    if room.blend_path is None:
        raise RenderError(f"room '{room.name}' has no .blend to bake; rooms of meshes have cheap materials already")
    budget = texel_budget(config, images_ahead)
    if budget == 0:
        return room.blend_path
    source = room.blend_path.resolve()
    content = _sha256([file_sha256(source), scripts_sha256((BAKE_SCRIPT,))])
    closeness = measure_closeness(room, cameras)
    folder = _only_folder(cache_dir.resolve(), content)
    baked = folder / f"{_sha256([content, budget, _closeness_sha256(closeness)])}.blend"
    if not baked.is_file():
        logger.info("baking the room's materials to at most %.1f million texels", budget / 1e6)
        np.savez(folder / "closeness.npz", **asdict(closeness))
        job = {
            "blend_path": str(source),
            "out_path": str(baked),
            "closeness": str(folder / "closeness.npz"),
            "content": content,
            "max_texels": budget,
        }
        write_json(folder / "bake.json", job)
        _bake(folder / "bake.json", config, folder)
    return baked


def _sha256(values: list[str | int]) -> str:
    return hashlib.sha256(json.dumps(values).encode()).hexdigest()[:24]


def _closeness_sha256(closeness: Closeness) -> str:
    digest = hashlib.sha256()
    for values in (closeness.object_index, closeness.triangle, closeness.pixels_per_m):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _only_folder(cache_dir: Path, content: str) -> Path:
    """The room's folder; what was baked of rooms that stood here before goes."""
    folder = cache_dir / content
    folder.mkdir(parents=True, exist_ok=True)
    for other in cache_dir.iterdir():
        if other != folder:
            shutil.rmtree(other)
    return folder


def _bake(job_path: Path, config: RenderConfig, scratch: Path) -> None:
    texels, images = 0, 0

    def listen(event: Event) -> None:
        nonlocal texels, images
        if event["event"] == "baked":
            texels += int(event["texels"])
            images += int(event["images"])

    for last_try in (False, True):
        try:
            run_script(
                BAKE_SCRIPT,
                job_path,
                blender=config.blender,
                scratch=scratch,
                silence_timeout_s=config.frame_timeout_s,
                on_event=listen,
            )
            break
        except BlenderError as error:
            if last_try:
                raise RenderError(
                    f"the room's materials could not be baked: {error.reason}; lower render.max_texels if memory ran "
                    f"out, or switch it off with render.bake=false\nBlender's last lines:\n{error.tail}"
                ) from None
            logger.warning("baking: %s; once more", error.reason)
            texels = images = 0
    logger.info("baked %d images; the room's textures have %.2f million texels", images, texels / 1e6)
