"""``perpetua generate``: says what it will cost, makes the rooms, and says what came out and how to go on."""

import difflib
import logging
import shlex
import sys
from collections.abc import Callable
from functools import partial

from rich.console import Console

from perpetua.actors.bodies.assembly import check_people
from perpetua.cluster.local import raise_on_sigterm, run_rooms
from perpetua.errors import ConfigError, InputError, PerpetuaError
from perpetua.io.files import read_json
from perpetua.machine.devices import auto_workers
from perpetua.machine.free_memory import free_memory_mb
from perpetua.machine.system_libraries import require_libraries
from perpetua.pipeline.cost import (
    TIGHT_FRACTION,
    Cost,
    check_disk,
    estimate_cost,
    gigabytes,
)
from perpetua.pipeline.layout import check_writable, open_run, run_before
from perpetua.pipeline.progress import Progress
from perpetua.pipeline.room_work import GenerateRequest, note_failures, room_work
from perpetua.pipeline.runner import published_redraw
from perpetua.pipeline.stages import STAGE_NAMES, STAGES
from perpetua.rooms.acceptance.build import check_source

EXIT_INTERRUPTED = 130


def run_generate(request: GenerateRequest, console: Console, dry_run: bool) -> int:
    """Makes the sequences asked for.

    Returns:
        0 if every room came out, 1 if some failed, 2 if all that failed did for what the user gave, 130 if stopped.

    Raises:
        InputError: the request cannot be carried out as it stands.
    """
    say = _speaker(console)
    until = check_request(request)
    cost = estimate_cost(request.config, _rooms_to_make(request), max(1, request.workers))
    free_bytes = check_disk(cost, request.out)
    _say_cost(request, cost, free_bytes, until, console)
    if dry_run:
        return 0
    raise_on_sigterm()
    try:
        failures = make_rooms(request, until, console)
    except KeyboardInterrupt:
        say(f"stopped; what is done is kept. To go on, run the same command again:\n  {_this_command()}")
        return EXIT_INTERRUPTED
    _say_result(request, failures, until, console)
    return exit_code(request, failures)


def check_request(request: GenerateRequest) -> str:
    """Passes what can be carried out, as far as that can be told before the work begins; returns its last stage.

    Raises:
        InputError: a name is none of those known, or a library, a folder or a program is missing.
    """
    until = _checked_stage(request.until)
    require_libraries()
    check_inputs(request)
    return until


def check_inputs(request: GenerateRequest) -> None:
    """Passes what the user names, on a machine that need not be one that does the work.

    Raises:
        InputError: a file, a folder or a name is missing or wrong.
    """
    check_source(request.config.rooms)
    check_people(request.config.actors)
    check_writable(request.out)


def make_rooms(request: GenerateRequest, until: str, console: Console) -> dict[int, str]:
    """Takes the rooms through the stages, and shows how it goes.

    Returns:
        The reason of failure of each room that failed.

    Raises:
        InputError: see ``open_folder``.
        KeyboardInterrupt: the user stopped the work; what is finished stays.
    """
    open_folder(request, until)
    work = room_work(request, until)
    workers = request.workers
    if workers == 0:
        workers = auto_workers(len(request.rooms), request.device, free_memory_mb(), work.memory_mb)
        _speaker(console)(f"rooms made at a time on this machine: {workers}")
    logging.getLogger("perpetua").setLevel(logging.INFO)
    with Progress(request.layout.log_file, len(request.rooms), request.config.cameras.count, console) as progress:
        failures = run_rooms(request.rooms, workers, work, progress.show)
    note_failures(request, failures)
    return failures


def open_folder(request: GenerateRequest, until: str = STAGES[-1].name) -> None:
    """Records the rooms asked for in the output folder, which keeps what it holds unless ``replace`` was given.

    Raises:
        InputError: the folder was made with other settings, holds sequences of another version of the program, or
            cannot be written to.
    """
    if not request.replace:
        run_before(request.out, request.seed, request.config)
        if until == STAGES[-1].name:
            _refuse_outdated(request)
    open_run(request.out, request.seed, request.rooms, request.config, request.replace)


def _refuse_outdated(request: GenerateRequest) -> None:
    for room in request.rooms:
        layout = request.layout.room(room)
        if layout.sequence_folder.is_dir() and published_redraw(layout, request.config) is None:
            raise InputError(
                f"'{layout.sequence_folder}' is not what this version of perpetua makes of these settings: choose "
                "another --out, or pass --replace to make it and others like it anew"
            )


def exit_code(request: GenerateRequest, failures: dict[int, str]) -> int:
    """0 without failures, 2 if all were for something that the user gave, else 1."""
    if not failures:
        return 0
    layouts = [request.layout.room(room) for room in failures]
    codes = {read_json(layout.failure_file).get("exit_code") for layout in layouts}
    return InputError.exit_code if codes == {InputError.exit_code} else PerpetuaError.exit_code


def _rooms_to_make(request: GenerateRequest) -> int:
    """Rooms without a sequence: finished ones need no more disk."""
    layouts = (request.layout.room(room) for room in request.rooms)
    return sum(not layout.sequence_folder.exists() for layout in layouts)


def _checked_stage(until: str | None) -> str:
    if until is None:
        return STAGE_NAMES[-1]
    if until not in STAGE_NAMES:
        near = difflib.get_close_matches(until, STAGE_NAMES, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        raise ConfigError(f"--until must be one of {', '.join(STAGE_NAMES)}, not '{until}'{hint}")
    return until


def _say_cost(request: GenerateRequest, cost: Cost, free_bytes: float, until: str, console: Console) -> None:
    say = _speaker(console)
    render = request.config.render
    say(f"{len(request.rooms)} room(s) of seed {request.seed}, first {request.rooms.start}, through stage '{until}'")
    say(
        f"each: {cost.frames} frames x {request.config.cameras.count} views = {cost.images} images of "
        f"{render.width_px} x {render.height_px} px at {render.samples} samples; the time is estimated after the "
        "first frame"
    )
    say(
        f"disk: about {gigabytes(cost.sequence_bytes)} per sequence, {gigabytes(cost.work_bytes)} of its work is kept, "
        f"{gigabytes(cost.busy_bytes)} while it is made; {gigabytes(cost.total_bytes)} for {cost.rooms} room(s) that "
        f"are not there yet; {gigabytes(free_bytes)} free"
    )
    if cost.total_bytes > TIGHT_FRACTION * free_bytes:
        say("warning: that is tight; --set work.keep=none keeps nothing of the work behind finished sequences")
    say(f"writes to: {request.out.absolute()}")


def _say_result(request: GenerateRequest, failures: dict[int, str], until: str, console: Console) -> None:
    say = _speaker(console)
    for room in request.rooms:
        layout = request.layout.room(room)
        if room in failures:
            say(f"room {room} failed: {failures[room]}")
        elif until == STAGE_NAMES[-1]:
            say(f"room {room}: {layout.sequence_folder}\n  look at {layout.contact_sheet}")
        else:
            say(f"room {room}: done through '{until}' in {layout.work_folder}")
    if until == STAGE_NAMES[-1] and len(failures) < len(request.rooms):
        say(f"pictures, figures and checks of all on a page: perpetua report {shlex.quote(str(request.out))}")
    if failures:
        say(f"{len(failures)} of {len(request.rooms)} rooms failed; to try them again:\n  {_this_command()}")


def _speaker(console: Console) -> Callable[[str], None]:
    """Prints a text as it is: no markup in it, no colours guessed, long lines left to the terminal."""
    return partial(console.print, highlight=False, markup=False, soft_wrap=True)


def _this_command() -> str:
    return shlex.join(["perpetua", *sys.argv[1:]])
