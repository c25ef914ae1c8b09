"""Reading finished sequences, giving them to a model as clips, and writing them in other layouts."""

from typing import TYPE_CHECKING, Any

from perpetua.formats import layout
from perpetua.formats.reader import Sequence, SequenceView, read_sequence
from perpetua.formats.resize import PixelCentreResize
from perpetua.formats.source import EXPORTERS, Exporter, ExportSource

if TYPE_CHECKING:
    from perpetua.formats.torch_dataset import Clip, SequenceDataset

__all__ = [
    "EXPORTERS",
    "Clip",
    "ExportSource",
    "Exporter",
    "PixelCentreResize",
    "Sequence",
    "SequenceDataset",
    "SequenceView",
    "layout",
    "read_sequence",
]


def __getattr__(name: str) -> Any:
    """The classes that need torch, which takes seconds to import."""
    if name not in ("Clip", "SequenceDataset"):
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from perpetua.formats import torch_dataset

    return getattr(torch_dataset, name)
