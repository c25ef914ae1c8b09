"""What the runner reports while it works; the progress display, the plain log and log.jsonl all read these."""

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Literal

EventKind = Literal[
    "room_started",
    "stage_started",
    "stage_skipped",
    "stage_finished",
    "frame_rendered",
    "message",
    "room_finished",
    "room_failed",
]


@dataclass(frozen=True)
class Event:
    """One object that happened to one room. Fields that do not apply keep their defaults."""

    kind: EventKind
    room: int
    stage: str = ""
    seconds: float = 0.0
    peak_memory_mb: float = 0.0
    frames_done: int = 0
    frames_total: int = 0
    text: str = ""


OnEvent = Callable[[Event], None]


def log_line(event: Event) -> str:
    """An event of this moment as a line of a machine-readable log."""
    return json.dumps({"time": round(time.time(), 3), **asdict(event)}) + "\n"
