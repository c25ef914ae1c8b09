"""What the page shows of one sequence, read from its files alone."""

from dataclasses import dataclass
from pathlib import Path

from perpetua.errors import SequenceFormatError
from perpetua.formats import layout
from perpetua.formats.layout import LOG_FILE
from perpetua.formats.reader import read_sequence
from perpetua.report.measure import Measured, measure
from perpetua.report.records import (
    AuditRecord,
    CheckRecord,
    SequenceRecord,
    StageEvent,
    garments,
    height_cm,
    read_record,
    read_stages,
)
from perpetua.report.thumbnails import thumbnails

USUAL_FPS = 24.0


@dataclass(frozen=True)
class SequenceFigures:
    """A sequence on the page, which has ``name`` there. ``missing`` lists what is unknown, and why.

    ``measured`` is None where the files cannot be read; ``pictures`` are data URIs, one per view, or none.
    """

    folder: Path
    name: str
    missing: tuple[str, ...]
    record: SequenceRecord
    checks: tuple[CheckRecord, ...]
    stages: dict[str, StageEvent]
    measured: Measured | None = None
    pictures: tuple[str, ...] = ()

    @property
    def heights_cm(self) -> list[float]:
        """Heights of the people whose description has one."""
        return [height for words in self.record.people if (height := height_cm(words)) is not None]

    @property
    def garments(self) -> list[str]:
        """Garments of all people."""
        return [garment for words in self.record.people for garment in garments(words)]

    @property
    def passed(self) -> int:
        """How many checks passed."""
        return sum(check.passed for check in self.checks)

    @property
    def seconds(self) -> float | None:
        """Time of all stages together; None where it is unknown."""
        return sum(event.seconds for event in self.stages.values()) if self.stages else None


def gather(folder: Path, name: str, pictured: bool) -> SequenceFigures:
    """Reads a sequence, with pictures if wanted; what is missing or damaged is listed in the result, not raised."""
    record, audit = read_record(folder / layout.RECORD, SequenceRecord), read_record(folder / layout.AUDIT, AuditRecord)
    missing = [said for said in (record, audit) if isinstance(said, str)]
    known = SequenceRecord() if isinstance(record, str) else record
    checks = () if isinstance(audit, str) else audit.checks
    stages = {} if known.room is None else read_stages(folder.resolve().parent.parent / LOG_FILE, known.room)
    if known.room is not None and not stages:
        missing.append(f"what it cost is unknown: there is no entry for it in {LOG_FILE} two folders up")
    if known.fps is None:
        missing.append(f"no frames per second are recorded: {USUAL_FPS:g} are taken for speeds")
    try:
        sequence = read_sequence(folder)
        measured = measure(sequence, known.fps or USUAL_FPS)
        pictures = thumbnails(sequence) if pictured else ()
    except (SequenceFormatError, OSError) as error:
        return SequenceFigures(folder, name, (*missing, f"cannot be read: {error}"), known, checks, stages)
    flat = [str(number) for number, view in enumerate(sequence.views) if view.depth_m is None]
    if flat:
        missing.append(f"there is no {layout.DEPTH} in view {', '.join(flat)}")
    return SequenceFigures(folder, name, tuple(missing), known, checks, stages, measured, pictures)
