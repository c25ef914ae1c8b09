"""Perpetua in Python: make sequences, find them, open them. ``import perpetua`` brings these three functions.

::

    import perpetua

    folders = perpetua.generate("out", preset="quick", seed=3)
    sequence = perpetua.open(folders[0])
    sequence.tracks_m           # float32 (F, P, 3), world metres
    sequence.views[0].image(5)  # uint8 (H, W, 3), RGB

What goes wrong raises the errors of ``perpetua.errors``, with the message that the command line prints.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from perpetua.errors import GenerationError, InputError
from perpetua.formats.reader import Sequence, read_sequence


def generate(
    out: str | Path = "out",
    *,
    seed: int = 0,
    rooms: int | range = 1,
    preset: str = "standard",
    config: str | Path | None = None,
    settings: Mapping[str, Any] | None = None,
    workers: int | Literal["auto"] = 1,
    device: str = "auto",
    replace: bool = False,
    quiet: bool = False,
) -> list[Path]:
    """Makes sequences, as ``perpetua generate`` does; rooms that are made already are taken as they are.

    Args:
        out: the output folder.
        seed: decides everything drawn.
        rooms: how many, counted from room 0, or which, such as ``range(10, 20)``.
        preset: settings to start from: tiny, quick, standard or benchmark.
        config: a YAML file with settings.
        settings: changes by key, such as ``{"rooms.source": "procedural", "actors.count": 3}``.
        workers: rooms made at a time; auto for as many as the machine bears. With several they are made in processes
            of their own, which import the calling script: call this under ``if __name__ == "__main__":`` there.
        device: what Cycles renders on; auto takes a GPU if there is one.
        replace: allow other settings than the ones that ``out`` was made with.
        quiet: say nothing while rooms are made; ``out/log.jsonl`` tells all.

    Returns:
        The folders of the sequences, in the order of rooms.

    Raises:
        InputError: a setting, a folder or the machine does not allow it.
        GenerationError: some rooms failed; the others are made.
        KeyboardInterrupt: stopped; the same call goes on where it was.
    """
    from rich.console import Console

    from perpetua.config import load_config
    from perpetua.pipeline.room_work import GenerateRequest
    from perpetua.runs.generate import check_request, exit_code, make_rooms

    wanted = rooms if isinstance(rooms, range) else range(rooms)
    _check_numbers(seed, wanted, workers)
    request = GenerateRequest(
        config=load_config(preset, None if config is None else Path(config), changes=settings),
        seed=seed,
        rooms=wanted,
        until=None,
        out=Path(out),
        workers=0 if workers == "auto" else workers,
        device=device,
        replace=replace,
    )
    last_stage = check_request(request)
    failures = make_rooms(request, last_stage, Console(quiet=quiet))
    if failures:
        raise GenerationError(failures, len(wanted), exit_code(request, failures))
    return [request.layout.room(room).sequence_folder for room in wanted]


def open_sequence(folder: str | Path) -> Sequence:
    """A finished sequence; depth and masks stay on disk until they are read, and nothing in the files is run.

    Raises:
        SequenceFormatError: the folder is no sequence, or a file is missing, damaged, or of another type or shape.
    """
    return read_sequence(Path(folder))


def sequences(folder: str | Path) -> list[Path]:
    """The folders of all sequences in a folder, such as the output folder of a run, by name.

    Raises:
        SequenceFormatError: there is none.
    """
    from perpetua.audit.verify import find_sequences

    return find_sequences(Path(folder))


def _check_numbers(seed: int, rooms: range, workers: int | str) -> None:
    if seed < 0:
        raise InputError(f"seed must be 0 or more, not {seed}")
    if len(rooms) == 0 or rooms.start < 0 or rooms.step != 1:
        raise InputError(f"rooms must be 1 or more, or a range of rooms such as range(10, 20), not {rooms}")
    if workers != "auto" and (isinstance(workers, str) or workers < 1):
        raise InputError(f"workers must be 1 or more, or auto, not {workers}")
