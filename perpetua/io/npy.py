"""Opens ``.npy`` files that nobody vouches for: nothing in them is run, and nothing is believed about their size."""

import math
import tokenize
from dataclasses import dataclass
from io import BufferedIOBase
from pathlib import Path

import numpy as np

_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
_PLAIN = "biufcSU"


@dataclass(frozen=True)
class ArrayHeader:
    """What an array says of itself."""

    shape: tuple[int, ...]
    dtype: np.dtype
    fortran_order: bool

    @property
    def count(self) -> int:
        """How many numbers there are."""
        return math.prod(self.shape)

    @property
    def order(self) -> str:
        """The order of the numbers, as numpy names it."""
        return "F" if self.fortran_order else "C"


def read_header(handle: BufferedIOBase, size: int) -> ArrayHeader:
    """Reads the header of an array of plain numbers or text, found to fit the ``size`` of all its bytes.

    Raises:
        ValueError: it is no such header, or promises another size.
    """
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
    header = ArrayHeader(tuple(int(side) for side in shape), dtype, fortran_order)
    if dtype.kind not in _PLAIN or dtype.hasobject:
        raise ValueError(f"it holds {dtype}, and only plain numbers and text are read, never pickled objects")
    if min(header.shape, default=0) < 0 or size != handle.tell() + header.count * dtype.itemsize:
        raise ValueError(f"its header promises {dtype} {header.shape}, which does not fit its {size} bytes")
    return header


def open_npy(path: Path) -> np.ndarray:
    """The array in a file, mapped read-only.

    Raises:
        OSError: there is no such file, or it cannot be read.
        ValueError: it is no regular file, no ``.npy`` of plain numbers, or not of the length that its header promises.
    """
    if path.exists() and not path.is_file():
        raise ValueError("it is no regular file")
    with path.open("rb") as handle:
        header = read_header(handle, path.stat().st_size)
        start = handle.tell()
    if header.count == 0:
        return np.empty(header.shape, header.dtype)
    return np.memmap(path, header.dtype, "r", start, header.shape, order=header.order)  # type: ignore[call-overload]
