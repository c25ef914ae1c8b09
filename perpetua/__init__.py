"""Perpetua: procedural multi-view indoor video with exact 3D ground truth."""

from perpetua.api import generate, sequences
from perpetua.api import open_sequence as open

__all__ = ["__version__", "generate", "open", "sequences"]

__version__ = "0.1.0"
