"""``perpetua export``: a finished sequence in the layout of another reader."""

import shutil
from pathlib import Path

from perpetua.errors import InputError
from perpetua.formats.reader import read_sequence
from perpetua.formats.source import EXPORTERS, ExportSource
from perpetua.pipeline.work_area import load_meshes, load_object_index


def load_source(sequence_folder: Path) -> ExportSource:
    """A finished sequence, with the rendered object index if it was written (``export.outputs``) or its work area is
    kept, and with the meshes if that is kept.

    Raises:
        SequenceFormatError: the sequence is damaged.
    """
    name = sequence_folder.resolve().name
    sequence = read_sequence(sequence_folder)
    own = tuple(view.object_index for view in sequence.views if view.object_index is not None)
    complete = sequence.record is not None and len(own) == len(sequence.views)
    object_index = own if complete else load_object_index(sequence_folder)
    return ExportSource(name, sequence, object_index, load_meshes(sequence_folder))


def export_sequence(sequence_folder: Path, export_format: str, target: Path) -> list[Path]:
    """Writes a sequence into the folder ``target`` in another layout; returns what it added there.

    The sequence alone is enough. Where its work area is kept, formats that tell objects apart or show meshes take
    these from it; an object index among the sequence's own files comes first.

    Raises:
        InputError: something of the same name is in ``target``.
        ConfigError: there is no such format.
        SequenceFormatError: the sequence is damaged, or cannot be said in the layout.
        EnvironmentSetupError: a library that the format needs is not installed.
    """
    exporter = EXPORTERS[export_format]()
    name = sequence_folder.resolve().name
    source = load_source(sequence_folder)
    partial = target / f".{name}.{export_format}.partial"
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    try:
        exporter.write(source, partial)
        return _publish(partial, target)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _publish(partial: Path, target: Path) -> list[Path]:
    """By rename, so that no reader sees half of a file."""
    made = sorted(partial.iterdir())
    taken = [path.name for path in made if (target / path.name).exists()]
    if taken:
        raise InputError(f"'{target / taken[0]}' exists: choose another --out, or remove it")
    return [path.rename(target / path.name) for path in made]
