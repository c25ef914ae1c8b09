"""Perpetua: procedural multi-view indoor video with exact 3D ground truth."""

from perpetua.api import generate, sequences
from perpetua.api import open_sequence as open
from perpetua.machine.version import __version__

__all__ = ["__version__", "generate", "open", "sequences"]
