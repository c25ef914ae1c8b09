"""The scene behind a finished sequence, as far as its work area is kept."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt16

from perpetua.audit.deep_scene import DeepScene
from perpetua.errors import InputError
from perpetua.formats.reader import require_sequence
from perpetua.formats.source import KeptMeshes
from perpetua.pipeline import codec
from perpetua.pipeline.layout import WORK_FOLDER, RunRecord, read_run
from perpetua.pipeline.stages import STAGES
from perpetua.pipeline.store import StageFolder
from perpetua.pipeline.work_area import SCENE_STAGES
from perpetua.scene.actor import Route
from perpetua.scene.filmed import FilmedScene


@dataclass(frozen=True)
class KeptScene:
    """What a sequence was made from."""

    run: RunRecord
    room_number: int
    routes: tuple[Route, ...]
    scene: FilmedScene


def load_kept_scene(sequence_folder: Path) -> KeptScene:
    """Reads the stages from the work area of the run that made a sequence.

    Raises:
        SequenceFormatError: it is no sequence.
        InputError: the sequence does not lie in its run's output folder, or its work area was freed.
    """
    require_sequence(sequence_folder)
    work = _work_folder(sequence_folder)
    if not work.is_dir():
        raise InputError(
            f"the work area of '{sequence_folder}' is not kept (no {WORK_FOLDER}/{work.name} in its output folder): "
            "run the same perpetua generate again with a new --out, work.keep=all, and no perpetua clean after it"
        )
    loaded = {name: _load(work, name) for name in SCENE_STAGES}
    scene = FilmedScene(*(loaded[name] for name in ("room", "motion", "actors", "cameras", "render")))
    return KeptScene(read_run(work.parent.parent), _room_number(work), loaded["routes"], scene)


def kept_object_index(sequence_folder: Path) -> tuple[UInt16[np.ndarray, "T H W"], ...] | None:
    """The rendered object index of each view, or None where the work area does not hold it."""
    work = _work_folder(sequence_folder)
    return tuple(view.object_index for view in _load(work, "render")) if _holds(work, "render") else None


def kept_meshes(sequence_folder: Path) -> KeptMeshes | None:
    """The meshes of room and people, or None where the work area does not hold them."""
    work = _work_folder(sequence_folder)
    if not (_holds(work, "room") and _holds(work, "actors")):
        return None
    return KeptMeshes(_load(work, "room"), _load(work, "actors"))


def _work_folder(sequence_folder: Path) -> Path:
    folder = sequence_folder.resolve()
    return folder.parent.parent / WORK_FOLDER / folder.name


def _holds(work: Path, name: str) -> bool:
    stage = next(stage for stage in STAGES if stage.name == name)
    return StageFolder(work, stage.number, stage.name).manifest() is not None


def _load(work: Path, name: str) -> Any:
    stage = next(stage for stage in STAGES if stage.name == name)
    folder = StageFolder(work, stage.number, stage.name)
    remedy = "run the same perpetua generate again with a new --out"
    if folder.manifest() is None:
        raise InputError(f"stage '{name}' is missing in '{work}': {remedy}")
    damaged = folder.damage(stage.leftovers)
    if damaged is not None:
        raise InputError(f"'{folder.final / damaged}' is not what was written there: {remedy}")
    return codec.load(folder.final)


def _room_number(work: Path) -> int:
    manifest = StageFolder(work, STAGES[0].number, STAGES[0].name).manifest()
    assert manifest is not None
    return manifest.room


def load_deep_scene(sequence_folder: Path) -> DeepScene:
    """The meshes of a sequence, and what was rendered of them, for ``verify --deep``.

    Raises:
        InputError: the work area is not kept.
    """
    scene = load_kept_scene(sequence_folder).scene
    return DeepScene(scene.room, scene.actors, tuple(view.object_index for view in scene.views))
