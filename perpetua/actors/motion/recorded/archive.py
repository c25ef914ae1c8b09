"""Arrays out of an .npz file that nobody vouches for: no pickles, no surprises in size."""

import io
import zipfile
import zlib
from pathlib import Path

import numpy as np

from perpetua.errors import AssetError

MOST_BYTES = 256 * 2**20


def read_arrays(path: Path, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Those of the named arrays that an .npz file holds.

    Args:
        path: the file.
        names: arrays to read; others are not touched.

    Raises:
        AssetError: not an .npz file; an array is damaged, holds Python objects, or is larger than 256 MiB.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            return {name: _read(archive, members[name], path) for name in names if name in members}
    # zipfile says NotImplementedError of a compression it does not know, RuntimeError of an encrypted file.
    except (OSError, zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise AssetError(f"cannot read '{path}' as an .npz file: {error}") from None


def _read(archive: zipfile.ZipFile, info: zipfile.ZipInfo, path: Path) -> np.ndarray:
    name = f"'{info.filename}' in '{path}'"
    if info.file_size > MOST_BYTES:
        raise AssetError(f"{name} unpacks to {info.file_size} bytes; at most {MOST_BYTES} are read")
    with archive.open(info) as handle:
        # What the directory of the archive says about sizes can be a lie.
        content = handle.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise AssetError(f"{name} unpacks to more than {MOST_BYTES} bytes")
    try:
        stream = io.BytesIO(content)
        version = np.lib.format.read_magic(stream)
        read_header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
        shape, fortran_order, dtype = read_header[version](stream)
        body = content[stream.tell() :]
        if dtype.kind not in "biufUS" or int(np.prod(shape, dtype=object)) * dtype.itemsize != len(body):
            raise ValueError(f"dtype {dtype} and shape {shape} do not fit {len(body)} bytes of plain numbers")
        return np.frombuffer(body, dtype).reshape(shape, order="F" if fortran_order else "C")
    except (ValueError, KeyError, TypeError, SyntaxError) as error:
        raise AssetError(f"{name} is not a plain array: {error}") from None
