"""Bakes a room's procedural materials to image textures before it is rendered, once per room."""

import hashlib
import json
import logging
from pathlib import Path

from perpetua.blender import SCRIPT_FOLDER, BlenderError, Event, run_script
from perpetua.errors import RenderError
from perpetua.files import file_sha256, write_json
from perpetua.rendering.config import RenderConfig
from perpetua.rendering.scripts import scripts_sha256
from perpetua.rooms.types import Room

logger = logging.getLogger(__name__)

BAKE_SCRIPT = SCRIPT_FOLDER / "bake_materials.py"
# Fewer samples than this in all cost less than baking does.
MIN_SAMPLES = 2_000_000
# Baking stays a small part of rendering: so many samples for each texel, which takes three evaluations.
SAMPLES_PER_TEXEL = 20
# Textures with fewer texels than this look blurred at any resolution.
MIN_TEXELS = 600_000


def texel_budget(config: RenderConfig, images: int) -> int:
    """Texels worth baking for so many images; 0: baking does not pay or is switched off."""
    samples = images * config.width_px * config.height_px * config.samples
    if not config.bake or samples < MIN_SAMPLES:
        return 0
    return min(config.max_texels, max(MIN_TEXELS, samples // SAMPLES_PER_TEXEL))


def bake_room(room: Room, config: RenderConfig, images_ahead: int, work_dir: Path) -> Path:
    """Bakes a room that has a .blend; kept in ``work_dir`` under a name made of its content and the budget.

    Args:
        room: a room with a ``blend_path``.
        config: the render section of the config.
        images_ahead: how many images will be rendered of this room.
        work_dir: existing folder for the baked file.

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
    key = json.dumps([file_sha256(source), scripts_sha256((BAKE_SCRIPT.name,)), budget])
    baked = work_dir.resolve() / f"baked_{hashlib.sha256(key.encode()).hexdigest()[:24]}.blend"
    if not baked.is_file():
        logger.info("baking the room's materials to at most %.1f million texels", budget / 1e6)
        job_path = work_dir / "bake.json"
        write_json(job_path, {"blend_path": str(source), "out_path": str(baked), "max_texels": budget})
        _bake(job_path, config, work_dir)
    return baked


def _bake(job_path: Path, config: RenderConfig, work_dir: Path) -> None:
    texels: list[int] = []

    def listen(event: Event) -> None:
        if event["event"] == "baked":
            texels.append(int(event["texels"]))

    for last_try in (False, True):
        try:
            run_script(
                BAKE_SCRIPT,
                job_path,
                blender=config.blender,
                scratch=work_dir,
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
    logger.info("baked the materials of %d meshes to %.2f million texels", len(texels), sum(texels) / 1e6)
