"""The content of sequence.json, audit.json and log.jsonl, as far as it is known. The files may come from anywhere."""

import json
import re
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from perpetua.formats.source import PERSON

Model = TypeVar("Model", bound="Lenient")


class Lenient(BaseModel):
    """A model of the known entries of a file; other entries are ignored."""

    model_config = ConfigDict(extra="ignore", frozen=True)


class ObjectRecord(Lenient):
    """An object of a sequence."""

    category: str = ""
    description: str = ""


class SequenceRecord(Lenient):
    """Where a sequence comes from."""

    perpetua: str | None = None
    room: int | None = None
    room_kind: str | None = None
    fps: float | None = Field(None, gt=0.0)
    objects: tuple[ObjectRecord, ...] = ()

    @property
    def people(self) -> tuple[str, ...]:
        """Descriptions of the people."""
        return tuple(obj.description for obj in self.objects if obj.category == PERSON)


class CheckRecord(Lenient):
    """A rule that was checked."""

    name: str
    passed: bool
    value: float | None = None
    bound: str = ""


class AuditPart(Lenient):
    """The checks of a sequence's files, or of its motion."""

    checks: tuple[CheckRecord, ...] = ()


class AuditRecord(Lenient):
    """What the audits found."""

    sequence: AuditPart = AuditPart()
    motion: AuditPart = AuditPart()

    @property
    def checks(self) -> tuple[CheckRecord, ...]:
        """Those of the files, then those of the motion."""
        return self.sequence.checks + self.motion.checks


class StageEvent(Lenient):
    """A line of a run's log."""

    kind: str
    room: int
    stage: str = ""
    seconds: float = 0.0
    peak_memory_mb: float = 0.0


def read_record(path: Path, kind: type[Model]) -> Model | str:
    """The content of a JSON file, or why there is none."""
    if not path.exists():
        return f"there is no {path.name}"
    try:
        return kind.model_validate_json(path.read_bytes())
    except OSError as error:
        return f"{path.name} cannot be read: {error.strerror}"
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        return f"{path.name} is not as Perpetua writes it: {place + ': ' if place else ''}{first['msg']}"


def read_stages(log: Path, room: int) -> dict[str, StageEvent]:
    """The last time that each stage of a room was finished, by its name; nothing where the log is gone."""
    stages: dict[str, StageEvent] = {}
    try:
        lines = log.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return {}
    for line in lines:
        try:
            event = StageEvent.model_validate(json.loads(line))
        except (ValueError, RecursionError):
            continue
        if event.kind == "stage_finished" and event.room == room:
            stages[event.stage] = event
    return stages


def height_cm(description: str) -> float | None:
    """The height in a person's description."""
    found = re.search(r"(\d{2,3}) cm tall", description)
    return None if found is None else float(found[1])


def garments(description: str) -> tuple[str, ...]:
    """The clothes in a person's description, each by its last word: "a teal V-neck T-shirt" is a T-shirt."""
    worn = description.partition("wearing ")[2]
    pieces = re.split(r", | and | under | over ", worn) if worn else []
    return tuple(piece.split()[-1] for piece in pieces if piece.split())
