"""What to give to Slurm: which rooms still lack what, packed into the tasks of arrays."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from perpetua.errors import InputError
from perpetua.pipeline.layout import RoomLayout, RunRecord
from perpetua.pipeline.runner import published_redraw, rejected_draws, stage_keys
from perpetua.pipeline.stages import STAGES

# The last stage that needs no renderer: what lies before it runs on CPUs.
LAST_OF_GEOMETRY = "cameras"

Need = Literal["nothing", "pictures", "geometry"]


@dataclass(frozen=True)
class Resources:
    """What one task is given, and how many run at a time.

    ``gpus`` are of the tasks that render; ``rooms_per_task`` None lets the number of tasks decide.
    """

    partition: str | None
    geometry_partition: str | None
    cpus: int
    memory_gb: float
    gpus: int
    minutes: int
    array_parallelism: int
    rooms_per_task: int | None

    def geometry_workers(self, room_memory_mb: float) -> int:
        """Rooms at a time in a task of geometry: it is work of one thread per room."""
        return max(1, min(self.cpus, int(self.memory_gb * 1000 / room_memory_mb)))

    @property
    def render_workers(self) -> int:
        """Rooms at a time in a task that renders: a GPU each, or all CPUs for one."""
        return max(1, self.gpus)


@dataclass(frozen=True)
class Plan:
    """Rooms by what is done with them. Each inner tuple is the rooms of one task.

    ``from_start`` goes through an array for geometry and a dependent one for the rest, ``from_pictures`` through one
    for the rest alone.
    """

    finished: int
    scheduled_before: int
    from_start: tuple[tuple[int, ...], ...]
    from_pictures: tuple[tuple[int, ...], ...]

    @property
    def rooms(self) -> int:
        """How many are to be scheduled now."""
        return sum(len(task) for task in (*self.from_start, *self.from_pictures))


def make_plan(
    run: RunRecord,
    layouts: Sequence[RoomLayout],
    scheduled: Iterable[int],
    resources: Resources,
    room_memory_mb: float,
    most_tasks: int,
) -> Plan:
    """Decides what to schedule.

    Args:
        run: what is asked for.
        layouts: the rooms asked for.
        scheduled: rooms that queued or running tasks have.
        resources: of one task.
        room_memory_mb: what one room at work may need.
        most_tasks: tasks that Slurm allows in an array.

    Raises:
        InputError: with the given rooms per task there would be more tasks than Slurm allows.
    """
    busy = set(scheduled)
    needs = {layout.number: _need(run, layout) for layout in layouts if layout.number not in busy}
    at_least = resources.geometry_workers(room_memory_mb)
    return Plan(
        finished=sum(need == "nothing" for need in needs.values()),
        scheduled_before=len(layouts) - len(needs),
        from_start=_pack([room for room in needs if needs[room] == "geometry"], resources, at_least, most_tasks),
        from_pictures=_pack(
            [room for room in needs if needs[room] == "pictures"], resources, resources.render_workers, most_tasks
        ),
    )


def has_geometry(run: RunRecord, layout: RoomLayout) -> bool:
    """Whether a room is finished up to its cameras; files are not hashed, as the task that goes on does so."""
    keys = stage_keys(run.config, run.seed, layout.number, rejected_draws(layout, run.config))
    stage = next(stage for stage in STAGES if stage.name == LAST_OF_GEOMETRY)
    manifest = layout.stage(stage).manifest()
    return manifest is not None and manifest.key == keys[stage.name]


def _need(run: RunRecord, layout: RoomLayout) -> Need:
    if published_redraw(layout, run.config) is not None:
        return "nothing"
    return "pictures" if has_geometry(run, layout) else "geometry"


def _pack(rooms: list[int], resources: Resources, at_least: int, most_tasks: int) -> tuple[tuple[int, ...], ...]:
    needed = math.ceil(len(rooms) / most_tasks)
    size = max(needed, at_least) if resources.rooms_per_task is None else resources.rooms_per_task
    if size < needed:
        raise InputError(
            f"--rooms-per-task {size} would make {math.ceil(len(rooms) / size)} tasks, and Slurm allows {most_tasks} "
            f"in an array here: give at least {needed}"
        )
    return tuple(tuple(rooms[start : start + size]) for start in range(0, len(rooms), size))
