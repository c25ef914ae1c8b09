"""A ``.npy`` file of stacked frames that are never all in memory."""

from pathlib import Path
from types import TracebackType

import numpy as np


class FrameFile:
    """Takes frame after frame; as a context it closes the file.

    Args:
        path: the file.
        shape: of all frames together.
        dtype: of the numbers.
    """

    def __init__(self, path: Path, shape: tuple[int, ...], dtype: type[np.generic]) -> None:
        self.shape, self.dtype = shape, np.dtype(dtype)
        self._handle = path.open("wb")
        header = {"descr": np.lib.format.dtype_to_descr(self.dtype), "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(self._handle, header)

    def append(self, frame: np.ndarray) -> None:
        """Writes the next frame.

        Raises:
            ValueError: it has another shape than the frames of the file.
        """
        if frame.shape != self.shape[1:]:
            raise ValueError(f"a frame of '{self._handle.name}' must have shape {self.shape[1:]}, not {frame.shape}")
        self._handle.write(np.ascontiguousarray(frame, self.dtype).tobytes())

    def __enter__(self) -> "FrameFile":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._handle.close()
