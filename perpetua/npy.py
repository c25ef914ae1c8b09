"""Opens ``.npy`` files that nobody vouches for: nothing in them is run, and nothing is believed about their size."""

import math
import tokenize
from pathlib import Path

import numpy as np

_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
_PLAIN = "biufcSU"


def open_npy(path: Path) -> np.ndarray:
    """The array in a file, mapped read-only.

    Raises:
        OSError: there is no such file, or it cannot be read.
        ValueError: it is no regular file, no ``.npy`` of plain numbers, or not of the length that its header promises.
    """
    if path.exists() and not path.is_file():
        raise ValueError("it is no regular file")
    with path.open("rb") as handle:
        try:
            version = np.lib.format.read_magic(handle)
            if version not in _HEADERS:
                raise ValueError(f"it is of .npy version {version}; (1, 0) or (2, 0) is required")
            shape, fortran_order, dtype = _HEADERS[version](handle)
        # What numpy's parser of headers can say of a forged one.
        except (
            SyntaxError, tokenize.TokenError, TypeError, KeyError, EOFError, RecursionError, MemoryError, OverflowError
        ) as error:  # fmt: skip
            raise ValueError(f"its header is no header of an array: {error}") from None
        start = handle.tell()
    if dtype.kind not in _PLAIN or dtype.hasobject:
        raise ValueError(f"it holds {dtype}, and only plain numbers and text are read, never pickled objects")
    promised = start + math.prod(shape) * dtype.itemsize
    if min(shape, default=0) < 0 or path.stat().st_size != promised:
        raise ValueError(f"its header promises {dtype} {shape}, which does not fit its {path.stat().st_size} bytes")
    if math.prod(shape) == 0:
        return np.empty(shape, dtype)
    return np.memmap(path, dtype, "r", start, shape, order="F" if fortran_order else "C")
