"""Where a run keeps what: the one place that knows the names below the output folder."""

import os
from dataclasses import dataclass
from pathlib import Path

from perpetua.config import Config
from perpetua.errors import InputError
from perpetua.formats.config import ExportConfig, split_of_room
from perpetua.formats.layout import AUDIT, LOG_FILE
from perpetua.io.files import load_json, write_json
from perpetua.pipeline.lease import hold_when_free
from perpetua.pipeline.store import StageFolder, StageName, stage_folder

WORK_FOLDER = ".work"
RUN_FILE = "run.json"
ROOM_LOG = LOG_FILE
# Pictures of sequences that generate and preview draw, in the output folder and the current one.
PREVIEW_FOLDER = "previews"


def sequence_name(seed: int, room: int) -> str:
    """Name of a sequence; it does not depend on how many rooms are made."""
    return f"seed{seed}-room{room:04d}"


@dataclass(frozen=True)
class RunLayout:
    """The folders of one run: the output folder, and what the names below it depend on."""

    out: Path
    export: ExportConfig
    seed: int

    def room(self, room: int) -> "RoomLayout":
        """The folders of one room."""
        return RoomLayout(self, room)

    @property
    def work_area(self) -> Path:
        """What is kept to go on from."""
        return self.out / WORK_FOLDER

    @property
    def slurm_folder(self) -> Path:
        """Files of the tasks that a cluster has."""
        return self.work_area / "slurm"

    @property
    def log_file(self) -> Path:
        """What happened, one JSON object per line."""
        return self.out / LOG_FILE


@dataclass(frozen=True)
class RoomLayout:
    """The folders and files of one room of a run."""

    run: RunLayout
    number: int

    @property
    def name(self) -> str:
        """Of the room's sequence."""
        return sequence_name(self.run.seed, self.number)

    @property
    def work_folder(self) -> Path:
        """Where the room's stages are kept."""
        return self.run.work_area / self.name

    def stage(self, stage: StageName) -> StageFolder:
        """Where one of them is kept."""
        return stage_folder(self.work_folder, stage)

    @property
    def sequence_folder(self) -> Path:
        """Where the finished sequence appears."""
        return self.run.out / split_of_room(self.run.export, self.run.seed, self.number) / self.name

    @property
    def other_sequence_folders(self) -> list[Path]:
        """Folders of splits, other than the room's own, in which an earlier config published the room."""
        own = self.sequence_folder
        found = (path for path in self.run.out.glob(f"*/{self.name}") if path.parent.name != WORK_FOLDER)
        return sorted(path for path in found if path != own and (path / AUDIT).is_file())

    @property
    def contact_sheet(self) -> Path:
        """The picture of the finished sequence."""
        return self.run.out / PREVIEW_FOLDER / f"{self.name}.png"

    @property
    def log_file(self) -> Path:
        """What happened to the room, one JSON object per line."""
        return self.work_folder / ROOM_LOG

    @property
    def failure_file(self) -> Path:
        """Why the last attempt at the room failed, if it did."""
        return self.work_folder / "failure.json"

    @property
    def rejections_file(self) -> Path:
        """The keys of stages whose draw was rejected, with the reasons, so that no run tries them again."""
        return self.work_folder / "rejected.json"


@dataclass(frozen=True)
class RunRecord:
    """What was asked for in an output folder, kept in run.json."""

    seed: int
    rooms: tuple[int, ...]
    config: Config

    def layout(self, out: Path) -> RunLayout:
        """Its folders, in the output folder ``out``."""
        return RunLayout(out, self.config.export, self.seed)


def read_run(out: Path) -> RunRecord:
    """The record of an output folder.

    Raises:
        InputError: the folder holds no run.
    """
    path = out / RUN_FILE
    try:
        content = load_json(path)
        return RunRecord(
            int(content["seed"]),
            tuple(int(room) for room in content["rooms"]),
            Config.model_validate(content["config"]),
        )
    except OSError:
        raise InputError(f"'{out}' holds no run of perpetua (no {RUN_FILE}): give the --out of a generate") from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"'{path}' cannot be read ({error}): run the same perpetua generate with --replace, which writes it anew"
        ) from None


def check_writable(out: Path) -> None:
    """Passes an output folder that is there, or can be made, and takes files.

    Raises:
        InputError: a file stands in the way, or the user may not write there.
    """
    place = out.absolute()
    while not place.exists():
        place = place.parent
    if not place.is_dir():
        raise InputError(f"--out '{out}' cannot be a folder, as '{place}' is a file: choose another --out")
    if not os.access(place, os.W_OK | os.X_OK):
        raise InputError(f"--out '{out}' cannot be written: you may not write to '{place}': choose another --out")


def open_run(out: Path, seed: int, rooms: range, config: Config, replace: bool) -> RunRecord:
    """Records the rooms asked for; an output folder keeps one seed and one config, so nothing is overwritten.

    Raises:
        InputError: the folder was made with another seed or config and ``replace`` is false, or is not writable.
    """
    try:
        # Of two runs that begin at once, neither may forget the other's rooms.
        with hold_when_free(out / WORK_FOLDER):
            return _record_rooms(out, seed, rooms, config, replace)
    except OSError as error:
        raise InputError(f"cannot write to --out '{out}': {error.strerror}") from None


def run_before(out: Path, seed: int, config: Config) -> RunRecord | None:
    """The run that ``out`` holds, if any.

    Raises:
        InputError: it was made with another seed or config.
    """
    if not (out / RUN_FILE).exists():
        return None
    before = read_run(out)
    differences = _differences(before, seed, config)
    if differences:
        raise InputError(
            f"'{out}' was made with other settings ({differences}): choose another --out, or pass --replace to "
            "make its sequences anew"
        )
    return before


def _record_rooms(out: Path, seed: int, rooms: range, config: Config, replace: bool) -> RunRecord:
    wanted = set(rooms)
    before = None if replace else run_before(out, seed, config)
    if before is not None:
        wanted |= set(before.rooms)
    record = RunRecord(seed, tuple(sorted(wanted)), config)
    write_json(out / RUN_FILE, {"seed": seed, "rooms": list(record.rooms), "config": config.model_dump(mode="json")})
    return record


def _differences(before: RunRecord, seed: int, config: Config) -> str:
    found = [f"--seed {before.seed}, now {seed}"] if before.seed != seed else []
    old, new = _flat(before.config.content()), _flat(config.content())
    found += [f"{key} {old.get(key)}, now {new[key]}" for key in new if old.get(key) != new[key]]
    return "; ".join(found[:4]) + ("; ..." if len(found) > 4 else "")


def _flat(tree: dict[str, object], prefix: str = "") -> dict[str, object]:
    flat: dict[str, object] = {}
    for key, value in tree.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat
