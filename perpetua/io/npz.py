"""Reads ``.npz`` files that nobody vouches for: nothing in them is run, and nothing unpacks to more than it may.

The one place where such a file is opened. An array's header is believed only where the member's length is what the
header promises; what is unpacked is cut off at that length, whatever the archive's directory says.
"""

import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from perpetua.errors import InputError
from perpetua.io.npy import ArrayHeader, read_header

MOST_BYTES = 256 * 2**20
# An .npz file of a data set holds a handful of arrays; a directory of millions is meant to hurt.
MOST_MEMBERS = 1024


class ArchiveError(InputError):
    """A file is no ``.npz`` archive, or an array in it is not what it may be."""


class NpzFile:
    """An open archive; made by ``open_npz``."""

    def __init__(self, path: Path, archive: zipfile.ZipFile, most_bytes: int) -> None:
        members = archive.infolist()
        if len(members) > MOST_MEMBERS:
            raise ArchiveError(f"'{path}' has {len(members)} members; an .npz file may have at most {MOST_MEMBERS}")
        self.path, self.most_bytes, self._archive = path, most_bytes, archive
        self.names = [member.filename.removesuffix(".npy") for member in members]
        self._members = dict(zip(self.names, members, strict=True))

    def __contains__(self, name: str) -> bool:
        return name in self._members

    def header(self, name: str) -> ArrayHeader:
        """Type and shape of an array.

        Raises:
            ArchiveError: the member is no plain array, too large, or not of the length that its header promises.
        """
        with self._reading(name) as handle:
            return self._read_header(name, handle)

    def read(self, name: str) -> np.ndarray:
        """An array.

        Raises:
            ArchiveError: as for ``header``, or the data are damaged.
        """
        with self._reading(name) as handle:
            header = self._read_header(name, handle)
            content = handle.read(header.count * header.dtype.itemsize)
            if len(content) != header.count * header.dtype.itemsize or handle.read(1):
                raise ValueError(f"its data are not the {header.count} numbers that its header promises")
            return np.frombuffer(content, header.dtype).reshape(header.shape, order=header.order)  # type: ignore[call-overload]

    def _read_header(self, name: str, handle: zipfile.ZipExtFile) -> ArrayHeader:
        size = self._members[name].file_size
        if size > self.most_bytes:
            raise ValueError(f"it unpacks to {size} bytes; at most {self.most_bytes} are read")
        return read_header(handle, size)

    @contextmanager
    def _reading(self, name: str) -> Iterator[zipfile.ZipExtFile]:
        try:
            with self._archive.open(self._members[name]) as handle:
                yield handle  # type: ignore[misc]
        # zipfile says NotImplementedError of a compression it does not know, RuntimeError of an encrypted file.
        except (
            OSError, zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError, KeyError,
            MemoryError,
        ) as error:  # fmt: skip
            raise ArchiveError(f"'{name}' in '{self.path}' is not a plain array: {error}") from None


@contextmanager
def open_npz(path: Path, most_bytes: int = MOST_BYTES) -> Iterator[NpzFile]:
    """Opens an archive, as a context.

    Args:
        path: the file.
        most_bytes: what one array may unpack to.

    Raises:
        ArchiveError: the file is missing, or no ``.npz`` archive.
    """
    try:
        archive = zipfile.ZipFile(path)
    # NotImplementedError: an archive that asks for a later version of the format.
    except (OSError, zipfile.BadZipFile, ValueError, EOFError, NotImplementedError) as error:
        raise ArchiveError(f"cannot read '{path}' as an .npz file: {error}") from None
    with archive:
        yield NpzFile(path, archive, most_bytes)
