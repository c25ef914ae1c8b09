# SPDX-License-Identifier: GPL-3.0-or-later
"""The arrays of a job: .npy files beside job.json, named in it."""

from pathlib import Path

import numpy as np


class JobArrays:
    """Reads a job's arrays; long ones (vertices of all frames) stay on disk and are mapped."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def load(self, name: str) -> np.ndarray:
        """The array of this file name, mapped read-only."""
        return np.load(self._folder / name, mmap_mode="r", allow_pickle=False)

    def load_optional(self, name: str | None) -> np.ndarray | None:
        """The array, or None where the job names none."""
        return None if name is None else self.load(name)
