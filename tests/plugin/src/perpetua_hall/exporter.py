"""Tracks as a table."""

from pathlib import Path

import numpy as np

from perpetua.formats import ExportSource


class TrackTable:
    """World positions of the tracks in metres, one row per frame and track."""

    def write(self, source: ExportSource, folder: Path) -> None:
        """Writes ``<sequence>.csv`` into ``folder``."""
        tracks_m = source.sequence.tracks_m
        frame, track = np.indices(tracks_m.shape[:2])
        rows = np.column_stack([frame.ravel(), track.ravel(), tracks_m.reshape(-1, 3)])
        path = folder / f"{source.name}.csv"
        np.savetxt(path, rows, fmt=["%d", "%d", "%.4f", "%.4f", "%.4f"], delimiter=",", header="frame,track,x,y,z")
