"""Perpetua: procedural multi-view indoor video with exact 3D ground truth."""

__version__ = "0.1.0"
