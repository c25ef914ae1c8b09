"""``perpetua submit``: says what is missing, gives it to Slurm, and says how to follow it."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from rich.console import Console

from perpetua.cluster import slurm
from perpetua.cluster.plan import LAST_OF_GEOMETRY, Plan, Resources, make_plan
from perpetua.cluster.task import RoomsTask
from perpetua.errors import InputError
from perpetua.pipeline.cost import estimate_cost, gigabytes
from perpetua.pipeline.layout import RunRecord
from perpetua.pipeline.lease import hold_when_free
from perpetua.pipeline.room_work import GenerateRequest
from perpetua.pipeline.stages import STAGES
from perpetua.runs.generate import check_inputs, open_folder


@dataclass(frozen=True)
class SubmitRequest:
    """What the user asked for; ``sbatch`` holds further options of sbatch by name."""

    generate: GenerateRequest
    resources: Resources
    python: str | None
    sbatch: dict[str, str]


def run_submit(request: SubmitRequest, console: Console, dry_run: bool) -> None:
    """Schedules what is missing and not scheduled yet.

    Raises:
        InputError: the request cannot be carried out as it stands.
        PerpetuaError: Slurm does not take it.
    """
    say = partial(console.print, highlight=False, markup=False, soft_wrap=True)
    generate = request.generate
    check_inputs(generate)
    if dry_run:
        for line in _describe(request, _plan(request)):
            say(line)
        return
    slurm.require_slurm()
    folder = generate.layout.slurm_folder.absolute()
    if generate.replace and slurm.scheduled_rooms(folder):
        raise InputError(
            f"tasks with the former settings of '{generate.out}' are scheduled: scancel them, then --replace"
        )
    open_folder(generate)
    slurm.open_folder(folder)
    # Of two that submit at once, the second must see what the first has scheduled.
    with hold_when_free(folder):
        plan = _plan(request)
        for line in _describe(request, plan):
            say(line)
        for line in _submit(request, plan):
            say(line)
    if plan.rooms:
        say(f"logs: {folder}\nhow far it is, from any node: perpetua status {generate.out}")


def _plan(request: SubmitRequest) -> Plan:
    generate = request.generate
    folder = generate.layout.slurm_folder.absolute()
    run = RunRecord(generate.seed, tuple(generate.rooms), generate.config)
    layouts = [generate.layout.room(room) for room in generate.rooms]
    room_memory_mb = estimate_cost(generate.config, 1).room_memory_mb
    return make_plan(run, layouts, slurm.scheduled_rooms(folder), request.resources, room_memory_mb, slurm.most_tasks())


def _describe(request: SubmitRequest, plan: Plan) -> list[str]:
    generate, resources = request.generate, request.resources
    cost = estimate_cost(generate.config, plan.rooms)
    lines = [
        f"{len(generate.rooms)} room(s) of seed {generate.seed}: {plan.finished} finished, {plan.scheduled_before} "
        f"scheduled before, {plan.rooms} to schedule ({gigabytes(cost.total_bytes)} of disk)"
    ]
    for tasks, what in ((plan.from_start, "geometry, then the rest"), (plan.from_pictures, "the rest alone")):
        if tasks:
            lines.append(
                f"{sum(map(len, tasks))} room(s) for {what}: {len(tasks)} task(s) of up to {len(tasks[0])}, at most "
                f"{resources.array_parallelism} at a time, each {resources.cpus} CPU(s), {resources.memory_gb:g} GB, "
                f"{resources.gpus} GPU(s) where pictures are made, {resources.minutes} min before it is requeued"
            )
    return lines


def _submit(request: SubmitRequest, plan: Plan) -> list[str]:
    """Gives the plan to Slurm, an array at a time; each is on record before the next one."""
    lines = []
    if plan.from_start:
        geometry = _submit_array(request, plan.from_start, LAST_OF_GEOMETRY, None)
        rest = _submit_array(request, plan.from_start, STAGES[-1].name, geometry)
        lines.append(f"geometry: job {geometry.job}; the rest: job {rest.job}, task by task as geometry is done")
    if plan.from_pictures:
        rest = _submit_array(request, plan.from_pictures, STAGES[-1].name, None)
        lines.append(f"the rest alone: job {rest.job}")
    return lines


def _submit_array(
    request: SubmitRequest, tasks: tuple[tuple[int, ...], ...], until: str, after: slurm.Submission | None
) -> slurm.Submission:
    generate, resources = request.generate, request.resources
    geometry = until == LAST_OF_GEOMETRY
    room_memory_mb = estimate_cost(generate.config, 1).room_memory_mb
    workers = resources.geometry_workers(room_memory_mb) if geometry else resources.render_workers
    on_node = replace(generate, out=generate.out.absolute(), workers=workers)
    functions = [RoomsTask(on_node, rooms, until) for rooms in tasks]
    extra: dict[str, Any] = {"requeue": True, "kill-on-invalid-dep": "yes", **request.sbatch}
    options: dict[str, Any] = {
        "job_name": f"perpetua-{'geometry' if geometry else 'rest'}",
        "time": resources.minutes,
        "cpus_per_task": resources.cpus,
        "mem": f"{round(resources.memory_gb * 1000)}M",
        "array_parallelism": resources.array_parallelism,
        "additional_parameters": extra,
        # Since Slurm 22.05 srun does not take this over from sbatch.
        "srun_args": [f"--cpus-per-task={resources.cpus}"],
    }
    partition = resources.geometry_partition if geometry else resources.partition
    if partition is not None:
        options["partition"] = partition
    if not geometry and resources.gpus:
        options["gpus_per_node"] = resources.gpus
    if after is not None:
        # With aftercorr a task starts when its own task of the array before has ended well, and need not wait for all.
        kind = "aftercorr" if len(tasks) > 1 else "afterok"
        options["dependency"] = f"{kind}:{after.job}"
    folder = on_node.layout.slurm_folder
    return slurm.submit_array(folder, functions, tasks, request.python, options)
