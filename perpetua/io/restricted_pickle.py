"""Reads a pickled array of byte arrays without running anything of the file's choosing.

``images_jpeg_bytes.npy`` is a numpy object array, which numpy reads with pickle: a hostile file could run code, and
even numpy's own classes are no safe ground, because a data type's pickled state may lie about what it holds. So the
few names that such a file needs stand for plain records here, which are checked and turned into arrays afterwards.
"""

import codecs
import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from jaxtyping import UInt8

from perpetua.errors import SequenceFormatError

_UINT8_NAMES = ("u1", "|u1", "uint8", "B")


@dataclass(frozen=True)
class _NumpyClass:
    name: str


class _DataType:
    """A pickled data type: its name alone; the state that follows it is not believed."""

    __slots__ = ("name",)

    def __init__(self, name: str) -> None:
        self.name = name

    def __setstate__(self, state: object) -> None:
        return None


class _Array:
    """A pickled array: shape, data type, and bytes or a list of arrays."""

    __slots__ = ("data", "dtype", "shape")

    def __init__(self, shape: object = (), dtype: object = None, data: object = None) -> None:
        self.shape, self.dtype, self.data = shape, dtype, data

    def __setstate__(self, state: Any) -> None:
        _, self.shape, self.dtype, _, self.data = state


class _ByteArrayUnpickler(pickle.Unpickler):
    """Knows the names that arrays of byte arrays need, and none else."""

    def find_class(self, module: str, name: str) -> Any:
        known = {
            ("numpy", "ndarray"): _NumpyClass("ndarray"),
            ("numpy", "dtype"): self._dtype,
            ("numpy.core.multiarray", "_reconstruct"): self._reconstruct,
            ("numpy._core.multiarray", "_reconstruct"): self._reconstruct,
            ("numpy.core.numeric", "_frombuffer"): self._frombuffer,
            ("numpy._core.numeric", "_frombuffer"): self._frombuffer,
            ("_codecs", "encode"): self._encode,
        }
        if (module, name) not in known:
            raise pickle.UnpicklingError(f"it asks for '{module}.{name}', which no array of JPEG bytes needs")
        return known[module, name]

    # Bound methods, because a pickle can set attributes of a class or function that it is given, but not of these.
    def _dtype(self, name: str, *_: object) -> _DataType:
        return _DataType(str(name))

    def _reconstruct(self, *_: object) -> _Array:
        return _Array()

    def _frombuffer(self, data: object, dtype: object, shape: object, _order: object) -> _Array:
        return _Array(shape, dtype, data)

    def _encode(self, text: str, encoding: str) -> bytes:
        if encoding != "latin1":
            raise pickle.UnpicklingError(f"it encodes text as '{encoding}'")
        return codecs.latin_1_encode(text)[0]


def read_byte_arrays(path: Path) -> tuple[UInt8[np.ndarray, " _"], ...]:
    """The 1-D uint8 arrays of a ``.npy`` file that holds a 1-D object array of them.

    Raises:
        SequenceFormatError: the file is missing, damaged, or holds anything else.
    """
    try:
        if path.exists() and not path.is_file():
            raise ValueError("it is no regular file")
        with path.open("rb") as handle:
            shape = _object_shape(handle)
            content = _ByteArrayUnpickler(handle).load()
    except Exception as error:  # a hostile pickle can raise anything
        raise SequenceFormatError(
            f"'{path}' must be a numpy object array of 1-D uint8 arrays, and is not: {error}"
        ) from None
    if not isinstance(content, _Array) or not isinstance(content.data, list) or len(content.data) != shape[0]:
        raise SequenceFormatError(f"'{path}' must hold a 1-D object array of {shape[0]} arrays")
    return tuple(_byte_array(path, index, item) for index, item in enumerate(content.data))


def _object_shape(handle: BinaryIO) -> tuple[int]:
    version = np.lib.format.read_magic(handle)
    if version == (1, 0):
        shape, _, dtype = np.lib.format.read_array_header_1_0(handle)
    else:
        shape, _, dtype = np.lib.format.read_array_header_2_0(handle)
    if dtype != np.dtype(object) or len(shape) != 1:
        raise ValueError(f"its header says {dtype} {shape}")
    return (int(shape[0]),)


def _byte_array(path: Path, index: int, item: object) -> UInt8[np.ndarray, " _"]:
    if isinstance(item, _Array) and isinstance(item.dtype, _DataType) and isinstance(item.data, bytes | bytearray):
        data = bytes(item.data)
        if item.dtype.name in _UINT8_NAMES and item.shape == (len(data),):
            return np.frombuffer(data, np.uint8)
    raise SequenceFormatError(f"'{path}' entry {index} must be a 1-D uint8 array of JPEG bytes")
