"""Takes one room through the stages: skips what is done, computes the rest, redraws, publishes the sequence."""

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from perpetua.config import Config
from perpetua.errors import ActorError, CameraError, PerpetuaError, RouteError, TrackError
from perpetua.formats.layout import AUDIT as AUDIT_FILE
from perpetua.io.files import read_json, write_json
from perpetua.machine.memory import PeakMemory, give_back
from perpetua.machine.scripts import scripts_sha256
from perpetua.pipeline import codec, store
from perpetua.pipeline.events import Event, OnEvent
from perpetua.pipeline.layout import RoomLayout, RunLayout
from perpetua.pipeline.lease import Lease, hold
from perpetua.pipeline.os_errors import explained
from perpetua.pipeline.stages import SEQUENCE_FOLDER, STAGES, Stage, StageContext, UndeclaredInputError
from perpetua.pipeline.work_area import free_work
from perpetua.seeding import StageSeed

# Errors that another draw of the routes, or of the room, may not meet.
REDRAWN = (RouteError, ActorError, CameraError, TrackError)


@dataclass
class RoomRun:
    """One room on its way through the stages."""

    config: Config
    seed: int
    room: int
    out: Path
    device: str
    on_event: OnEvent
    stages: tuple[Stage, ...] = STAGES
    rejected: int = 0
    keys: dict[str, str] = field(default_factory=dict)
    values: dict[str, Any] = field(default_factory=dict)
    shared: dict[str, Any] = field(default_factory=dict)
    lease: Lease = field(init=False)

    def __post_init__(self) -> None:
        self.layout = RunLayout(self.out, self.config.export, self.seed).room(self.room)

    def run(self, until: str, even_if_published: bool = False) -> None:
        """Runs the stages up to and with ``until``; the last one publishes the sequence.

        Args:
            until: name of a stage.
            even_if_published: run them, as far as their results are not there, also for a room whose sequence is
                published and needs none.

        Raises:
            PerpetuaError: a stage failed; what is finished stays.
            LeaseHeldError: another run is at the room.
        """
        self._report("room_started")
        if even_if_published or not self._is_published():
            first = self.stages[0].name
            with explained(first, self.layout.work_folder), hold(self.layout.work_folder) as self.lease:
                # Another run may have made it since.
                if even_if_published or not self._is_published():
                    self.layout.failure_file.unlink(missing_ok=True)
                    self._run_draws(until)
        self.layout.failure_file.unlink(missing_ok=True)
        if until == self.stages[-1].name:
            free_work(self.layout.work_folder, self.config.work.keep, self.stages)
        self.values.clear()
        self.shared.clear()
        give_back()
        self._report("room_finished")

    def _is_published(self) -> bool:
        return published_redraw(self.layout, self.config, self.stages) is not None

    def _run_draws(self, until: str) -> None:
        """Draws that an earlier run found wanting are not tried again, so the outcome has no history."""
        while True:
            # Of a published room the record of rejected draws may be gone with the work area; their number is not.
            published = published_redraw(self.layout, self.config, self.stages)
            rejected = rejected_draws(self.layout, self.config, self.stages)
            self.rejected = rejected if published is None else published
            self.keys = stage_keys(self.config, self.seed, self.room, self.rejected, self.stages)
            self.values.clear()
            failed = self._run_stages(until)
            if failed is None:
                return
            stage, error = failed
            self._reject(stage, error)

    def _run_stages(self, until: str) -> tuple[Stage, PerpetuaError] | None:
        """None when all went well, or the stage whose draw has to be redrawn."""
        for stage in self.stages:
            try:
                self._run_stage(stage)
            except REDRAWN as error:
                return stage, error
            except PerpetuaError as error:
                self._note_failure(stage, error)
                raise
            if stage.name == until:
                break
        if until == self.stages[-1].name:
            with explained("publish", self.layout.sequence_folder):
                self._publish()
        return None

    def _reject(self, stage: Stage, error: PerpetuaError) -> None:
        rejections = read_json(self.layout.rejections_file) | {self.keys[stage.name]: str(error)}
        write_json(self.layout.rejections_file, rejections)
        limits = self.config.redraw
        if self.rejected + 1 >= (limits.routes_per_room + 1) * (limits.rooms + 1):
            self._note_failure(stage, error)
            raise error
        self._report("message", text=f"draw {self.rejected + 1} rejected by {stage.name}: {error}")

    def _note_failure(self, stage: Stage, error: PerpetuaError) -> None:
        failure = {"stage": stage.name, "reason": str(error), "exit_code": error.exit_code}
        # On a full disk there is no place for the note either; the error itself is on its way to the user.
        with suppress(OSError):
            write_json(self.layout.failure_file, failure)

    def _run_stage(self, stage: Stage) -> None:
        folder = self.layout.stage(stage)
        key = self.keys[stage.name]
        if folder.is_complete(key, stage.leftovers):
            self._report("stage_skipped", stage.name)
            return
        self._report("stage_started", stage.name)
        self.lease.require_held()
        with explained(stage.name, folder.partial), self._undone_on_error(folder, stage):
            manifest = self._compute(folder, stage)
            self.lease.require_held()
            folder.finish(manifest)
        for name in stage.leftovers:
            shutil.rmtree(folder.final / name, ignore_errors=True)
        self._report("stage_finished", stage.name, seconds=manifest.seconds, peak_memory_mb=manifest.peak_memory_mb)

    @contextmanager
    def _undone_on_error(self, folder: store.StageFolder, stage: Stage) -> Iterator[None]:
        """Frees what a failed stage left, unless it serves to go on, or another run is at the room by now."""
        try:
            yield
        except Exception:
            if not stage.resumable and self.lease.is_held:
                shutil.rmtree(folder.partial, ignore_errors=True)
            raise

    def _compute(self, folder: store.StageFolder, stage: Stage) -> store.Manifest:
        key = self.keys[stage.name]
        started = time.monotonic()
        with PeakMemory() as memory:
            partial = folder.begin(key, stage.resumable)
            codec.save(stage.run(self._context(stage, partial)), partial)
            outputs = store.output_hashes(partial, stage.leftovers)
        return store.Manifest(
            key=key,
            stage=stage.name,
            version=stage.version,
            seed=self.seed,
            room=self.room,
            inputs={name: self.keys[name] for name in stage.needs},
            outputs=outputs,
            seconds=round(time.monotonic() - started, 3),
            peak_memory_mb=round(memory.peak_mb, 1),
            libraries=store.library_versions(),
        )

    def _context(self, stage: Stage, partial: Path) -> StageContext:
        def on_frame(done: int, total: int, seconds: float) -> None:
            self.lease.require_held()
            self._report("frame_rendered", stage.name, seconds=seconds, frames_done=done, frames_total=total)

        def declared(name: str) -> str:
            if name not in stage.needs:
                raise UndeclaredInputError(
                    f"stage '{stage.name}' reads '{name}', which its row in the stage table does not declare: add it "
                    f"to its needs, which are {stage.needs}"
                )
            return name

        return StageContext(
            config=self.config,
            seed=StageSeed(self.seed, self.room, stage.name, stage.redraw(self.rejected, self.config.redraw)),
            folder=partial,
            device=self.device,
            folder_of=lambda name: self._folder_of(declared(name)),
            upstream=lambda name: self._upstream(declared(name)),
            shared=self.shared,
            on_frame=on_frame,
        )

    def _folder_of(self, name: str) -> Path:
        stage = next(stage for stage in self.stages if stage.name == name)
        return self.layout.stage(stage).final

    def _upstream(self, name: str) -> Any:
        if name not in self.values:
            self.values[name] = codec.load(self._folder_of(name))
        return self.values[name]

    def _publish(self) -> None:
        """The sequence appears under its final name by rename, so that no reader sees half of one."""
        self.lease.require_held()
        target = self.layout.sequence_folder
        partial = target.with_name(f".{target.name}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        store.link_tree(self._folder_of("export") / SEQUENCE_FOLDER, partial)
        audit = read_json(self._folder_of("audit") / AUDIT_FILE)
        last = self.stages[-1].name
        write_json(partial / AUDIT_FILE, {**audit, "key": self.keys[last], "rejected_draws": self.rejected})
        # A picture of an earlier sequence of this name must not outlive it.
        self.layout.contact_sheet.unlink(missing_ok=True)
        store.flush_tree(partial)
        store.replace_folder(partial, target)
        # One room in two splits would leak from training to testing.
        for moved in self.layout.other_sequence_folders:
            shutil.rmtree(moved)

    def _report(self, kind: Any, stage: str = "", **details: Any) -> None:
        self.on_event(Event(kind, self.room, stage, **details))


def stage_keys(
    config: Config, seed: int, room: int, rejected: int = 0, stages: tuple[Stage, ...] = STAGES
) -> dict[str, str]:
    """The key of every stage of one room: it changes when the stage, its settings, or anything upstream does."""
    keys: dict[str, str] = {}
    for stage in stages:
        keys[stage.name] = store.key_of(
            {
                "stage": stage.name,
                "version": stage.version,
                "settings": stage.section(config),
                "seed": seed,
                "room": room,
                "redraw": stage.redraw(rejected, config.redraw),
                "upstream": {name: keys[name] for name in stage.needs},
                "scripts": _scripts_once(stage.scripts),
            }
        )
    return keys


@lru_cache
def _scripts_once(entries: tuple[Path, ...]) -> str:
    """The scripts as this process first saw them, so that keys do not change under a run, and cost is paid once."""
    return scripts_sha256(entries)


def rejected_draws(layout: RoomLayout, config: Config, stages: tuple[Stage, ...] = STAGES) -> int:
    """How many draws of a room are known to break a hard limit under this config."""
    rejections = read_json(layout.rejections_file)
    rejected = 0
    limit = (config.redraw.routes_per_room + 1) * (config.redraw.rooms + 1)
    while rejected + 1 < limit:
        keys = stage_keys(config, layout.run.seed, layout.number, rejected, stages)
        if not any(key in rejections for key in keys.values()):
            break
        rejected += 1
    return rejected


def published_redraw(layout: RoomLayout, config: Config, stages: tuple[Stage, ...] = STAGES) -> int | None:
    """How many draws were rejected before the published sequence; None if none is published under this config."""
    audit = read_json(layout.sequence_folder / AUDIT_FILE)
    rejected = audit.get("rejected_draws")
    if not isinstance(rejected, int):
        return None
    keys = stage_keys(config, layout.run.seed, layout.number, rejected, stages)
    return rejected if audit.get("key") == keys[stages[-1].name] else None
