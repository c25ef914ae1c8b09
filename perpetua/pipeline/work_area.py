"""What is kept of the work behind a finished sequence."""

import shutil
from pathlib import Path
from typing import Literal

from perpetua.pipeline.stages import STAGES, Stage
from perpetua.pipeline.store import StageFolder

# What tracks, rays and exports need of a scene.
SCENE_STAGES = ("room", "routes", "motion", "actors", "cameras", "render")


def free_work(work_folder: Path, keep: Literal["all", "tracks", "none"], stages: tuple[Stage, ...] = STAGES) -> None:
    """Removes the stages of a finished room that ``work.keep`` does not name; its log and its lease stay."""
    if keep == "all":
        return
    kept = SCENE_STAGES if keep == "tracks" else ()
    for stage in stages:
        folder = StageFolder(work_folder, stage.number, stage.name)
        for place in (folder.partial, *(() if stage.name in kept else (folder.final,))):
            shutil.rmtree(place, ignore_errors=True)
