"""The work area behind a finished sequence: what is left of it, and the scene that it holds."""

import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import UInt16

from perpetua.errors import InputError
from perpetua.formats.reader import require_sequence
from perpetua.pipeline import codec
from perpetua.pipeline.layout import WORK_FOLDER, RunRecord, read_run
from perpetua.pipeline.stages import STAGES, Stage
from perpetua.pipeline.store import StageFolder, stage_folder
from perpetua.scene.actor import Route
from perpetua.scene.scene import Scene

# What tracks, rays and exports need of a scene.
SCENE_STAGES = ("room", "routes", "motion", "actors", "cameras", "render")


def free_work(work_folder: Path, keep: Literal["all", "tracks", "none"], stages: tuple[Stage, ...] = STAGES) -> None:
    """Removes the stages of a finished room that ``work.keep`` does not name; its log and its lease stay."""
    if keep == "all":
        return
    spared = SCENE_STAGES if keep == "tracks" else ()
    for stage in stages:
        folder = stage_folder(work_folder, stage)
        for place in (folder.partial, *(() if stage.name in spared else (folder.final,))):
            shutil.rmtree(place, ignore_errors=True)


@dataclass(frozen=True)
class StoredScene:
    """What a sequence was made from, as its run's work area has it."""

    run: RunRecord
    room_number: int
    routes: tuple[Route, ...]
    scene: Scene


def load_scene(sequence_folder: Path) -> StoredScene:
    """Reads the stages from the work area of the run that made a sequence.

    Raises:
        SequenceFormatError: it is no sequence.
        InputError: the sequence does not lie in its run's output folder, or its work area was freed.
    """
    require_sequence(sequence_folder)
    work = _work_folder(sequence_folder)
    if not work.is_dir():
        raise InputError(
            f"the work area of '{sequence_folder}' is gone (no {WORK_FOLDER}/{work.name} in its output folder): "
            "run the same perpetua generate again with a new --out, work.keep=all, and no perpetua clean after it"
        )
    loaded = {name: _load(work, name) for name in SCENE_STAGES}
    scene = Scene(loaded["room"], loaded["actors"], loaded["cameras"], loaded["motion"], loaded["render"])
    return StoredScene(read_run(work.parent.parent), _room_number(work), loaded["routes"], scene)


def load_object_index(sequence_folder: Path) -> tuple[UInt16[np.ndarray, "T H W"], ...] | None:
    """The rendered object index of each view, or None where the work area does not hold it."""
    work = _work_folder(sequence_folder)
    return tuple(view.object_index for view in _load(work, "render")) if _holds(work, "render") else None


def load_meshes(sequence_folder: Path) -> Scene | None:
    """Room and people of a sequence, or None where the work area does not hold them."""
    work = _work_folder(sequence_folder)
    if not (_holds(work, "room") and _holds(work, "actors")):
        return None
    return Scene(_load(work, "room"), _load(work, "actors"))


def _work_folder(sequence_folder: Path) -> Path:
    folder = sequence_folder.resolve()
    return folder.parent.parent / WORK_FOLDER / folder.name


def _stage_folder(work: Path, name: str) -> tuple[Stage, StageFolder]:
    stage = next(stage for stage in STAGES if stage.name == name)
    return stage, stage_folder(work, stage)


def _holds(work: Path, name: str) -> bool:
    return _stage_folder(work, name)[1].manifest() is not None


def _load(work: Path, name: str) -> Any:
    stage, folder = _stage_folder(work, name)
    remedy = "run the same perpetua generate again with a new --out"
    if folder.manifest() is None:
        raise InputError(f"stage '{name}' is missing in '{work}': {remedy}")
    damaged = folder.damage(stage.leftovers)
    if damaged is not None:
        raise InputError(f"'{folder.final / damaged}' is not what was written there: {remedy}")
    return codec.load(folder.final)


def _room_number(work: Path) -> int:
    manifest = stage_folder(work, STAGES[0]).manifest()
    assert manifest is not None
    return manifest.room
