"""Arrays out of a motion file that nobody vouches for."""

from pathlib import Path

import numpy as np

from perpetua.errors import AssetError
from perpetua.io.npz import ArchiveError, open_npz

# No motion of one person is larger.
MOST_BYTES = 256 * 2**20


def read_arrays(path: Path, names: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Those of the named arrays that an .npz file holds; others are not touched.

    Raises:
        AssetError: not an .npz file; an array is damaged, holds Python objects, or is larger than 256 MiB.
    """
    try:
        with open_npz(path, MOST_BYTES) as file:
            return {name: file.read(name) for name in names if name in file}
    except ArchiveError as error:
        raise AssetError(str(error)) from None
