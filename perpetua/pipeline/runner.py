"""Takes one room through the stages: skips what is done, computes the rest, publishes the sequence."""

import json
import shutil
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from perpetua.config import Config
from perpetua.errors import PerpetuaError
from perpetua.pipeline import codec, store
from perpetua.pipeline.events import Event, OnEvent
from perpetua.pipeline.layout import OutputLayout
from perpetua.pipeline.memory import PeakMemory
from perpetua.pipeline.scripts import scripts_sha256
from perpetua.pipeline.stages import AUDIT_FILE, SEQUENCE_FOLDER, STAGES, Stage, StageContext
from perpetua.seeding import StageSeed


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
    keys: dict[str, str] = field(default_factory=dict)
    values: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.layout = OutputLayout(self.out, self.config.export.split, self.seed, self.room)
        self.keys = stage_keys(self.config, self.seed, self.room, self.stages)

    def run(self, until: str) -> None:
        """Runs the stages up to and with ``until``; the last one publishes the sequence.

        Raises:
            PerpetuaError: a stage failed; what is finished stays.
        """
        self._report("room_started")
        if not self._is_published():
            with self.layout.lock():
                self._run_stages(until)
        self.layout.failure_file.unlink(missing_ok=True)
        self._report("room_finished")

    def _run_stages(self, until: str) -> None:
        for stage in self.stages:
            try:
                self._run_stage(stage)
            except PerpetuaError as error:
                store.write_json(self.layout.failure_file, {"stage": stage.name, "reason": str(error)})
                raise
            if stage.name == until:
                break
        if until == self.stages[-1].name:
            self._publish()

    def _is_published(self) -> bool:
        try:
            audit = json.loads((self.layout.sequence_folder / AUDIT_FILE).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return False
        return isinstance(audit, dict) and audit.get("key") == self.keys[self.stages[-1].name]

    def _run_stage(self, stage: Stage) -> None:
        folder = store.StageFolder(self.layout.work_folder, stage.number, stage.name)
        key = self.keys[stage.name]
        if folder.is_complete(key, stage.leftovers):
            self._report("stage_skipped", stage.name)
            return
        self._report("stage_started", stage.name)
        started = time.monotonic()
        partial = folder.begin(key, stage.resumable)
        with PeakMemory() as memory:
            codec.save(stage.run(self._context(stage, partial)), partial)
            outputs = store.output_hashes(partial, stage.leftovers)
        seconds = time.monotonic() - started
        folder.finish(
            store.Manifest(
                key=key,
                stage=stage.name,
                version=stage.version,
                seed=self.seed,
                room=self.room,
                inputs={name: self.keys[name] for name in stage.needs},
                outputs=outputs,
                seconds=round(seconds, 3),
                peak_memory_mb=round(memory.peak_mb, 1),
                libraries=store.library_versions(),
            )
        )
        for name in stage.leftovers:
            shutil.rmtree(folder.final / name, ignore_errors=True)
        self._report("stage_finished", stage.name, seconds=seconds, peak_memory_mb=memory.peak_mb)

    def _context(self, stage: Stage, partial: Path) -> StageContext:
        def on_frame(done: int, total: int, seconds: float) -> None:
            self._report("frame_rendered", stage.name, seconds=seconds, frames_done=done, frames_total=total)

        return StageContext(
            config=self.config,
            seed=StageSeed(self.seed, self.room, stage.name),
            folder=partial,
            device=self.device,
            stage_folders={name: self._folder_of(name) for name in stage.needs},
            upstream=self._upstream,
            on_frame=on_frame,
        )

    def _folder_of(self, name: str) -> Path:
        stage = next(stage for stage in self.stages if stage.name == name)
        return store.StageFolder(self.layout.work_folder, stage.number, stage.name).final

    def _upstream(self, name: str) -> Any:
        if name not in self.values:
            self.values[name] = codec.load(self._folder_of(name))
        return self.values[name]

    def _publish(self) -> None:
        """The sequence appears under its final name by rename, so that no reader sees half of one."""
        target = self.layout.sequence_folder
        partial = target.with_name(f".{target.name}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        target.parent.mkdir(parents=True, exist_ok=True)
        store.link_tree(self._folder_of("export") / SEQUENCE_FOLDER, partial)
        audit = json.loads((self._folder_of("audit") / AUDIT_FILE).read_text(encoding="utf-8"))
        store.write_json(partial / AUDIT_FILE, {**audit, "key": self.keys[self.stages[-1].name]})
        store.replace_folder(partial, target)

    def _report(self, kind: Any, stage: str = "", **details: Any) -> None:
        self.on_event(Event(kind, self.room, stage, **details))


def stage_keys(config: Config, seed: int, room: int, stages: tuple[Stage, ...] = STAGES) -> dict[str, str]:
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
                "upstream": {name: keys[name] for name in stage.needs},
                "scripts": scripts_sha256(stage.scripts),
            }
        )
    return keys
