"""``perpetua preview SEQ``: the usual pictures of a sequence, in one folder."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from perpetua.errors import InputError
from perpetua.formats.source import ExportSource
from perpetua.report.pictures.contact_sheet import write_contact_sheet
from perpetua.report.pictures.depth_sheet import write_depth_sheet
from perpetua.report.pictures.object_sheet import write_object_sheet
from perpetua.report.pictures.plan_view import write_plan_view
from perpetua.report.pictures.video import write_animation, write_video
from perpetua.runs.export import load_source


@dataclass(frozen=True)
class _Picture:
    """A file of the set: how it is drawn from a source and a number of times, and why it may not be (None: it can).
    Some are drawn only if they are asked for."""

    file: str
    draw: Callable[[ExportSource, Path, int], None]
    lack: Callable[[ExportSource], str | None] = lambda source: None
    usual: bool = True


def _no_depth(source: ExportSource) -> str | None:
    without = [str(index) for index, view in enumerate(source.sequence.views) if view.depth_m is None]
    return f"there is no depth.npy in view {', '.join(without)}" if without else None


def _no_objects(source: ExportSource) -> str | None:
    if source.object_index is not None:
        return None
    return (
        "the object index is neither in the sequence (generate --set export.outputs=[object_index] writes it) nor in a "
        "work area, which perpetua clean frees"
    )


PICTURES = {
    "sheet": _Picture("sheet.jpg", lambda source, file, times: write_contact_sheet(source.sequence, file, times)),
    "video": _Picture("video.mp4", lambda source, file, times: write_video(source.sequence, source.fps, file)),
    "plan": _Picture("plan.png", lambda source, file, times: write_plan_view(source.sequence, file)),
    "depth": _Picture(
        "depth.jpg", lambda source, file, times: write_depth_sheet(source.sequence, file, times), _no_depth
    ),
    "objects": _Picture("objects.png", write_object_sheet, _no_objects),
    "animation": _Picture(
        "animation.webp", lambda source, file, times: write_animation(source.sequence, source.fps, file), usual=False
    ),
}


def write_previews(
    sequence_folder: Path, folder: Path, only: tuple[str, ...], times: int, say: Callable[[str], None]
) -> None:
    """Writes pictures of a sequence into ``folder``, and says which, and what lacks for the others.

    Args:
        sequence_folder: the sequence.
        folder: is made if need be; pictures of the same names are replaced.
        only: names of ``PICTURES``; none for the usual ones, as far as the sequence allows.
        times: frames that the sheets show.
        say: takes a line for the user.

    Raises:
        SequenceFormatError: the sequence cannot be read.
        InputError: a picture of ``only`` cannot be drawn, or the folder cannot be written to.
    """
    source = load_source(sequence_folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write into --out '{folder}': {error}") from None
    for name in only or (name for name, picture in PICTURES.items() if picture.usual):
        picture, target = PICTURES[name], folder / PICTURES[name].file
        lack = picture.lack(source)
        if lack is not None and only:
            raise InputError(f"cannot draw '{name}' of '{sequence_folder}': {lack}")
        if lack is not None:
            say(f"no {target.name}: {lack}")
            continue
        partial = target.with_name(f".partial.{target.name}")
        picture.draw(source, partial, times)
        partial.replace(target)
        say(f"wrote {target}")
