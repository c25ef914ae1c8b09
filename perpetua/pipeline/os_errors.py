"""Troubles of the machine that any stage can meet, said as errors for a user."""

import errno
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from perpetua.errors import StageError

_DISK_FAULTS = {
    errno.ENOSPC: "the disk is full: free space (perpetua clean frees the work of finished rooms)",
    errno.EDQUOT: "the disk quota is used up: free space (perpetua clean frees the work of finished rooms)",
    errno.EROFS: "the disk is read-only: mount it for writing",
    errno.EACCES: "it may not be written: change its owner or permissions",
    errno.EPERM: "it may not be written: change its owner or permissions",
    errno.EIO: "the disk fails: look at its health, and copy what matters elsewhere",
    errno.ESTALE: "the file server lost the folder: mount it again",
    errno.EMFILE: "too many files are open: raise the limit with ulimit -n",
    errno.ENFILE: "too many files are open on this machine: raise its limit",
}
# What numpy says, without a number, when it could not write a whole array.
_NUMPY_CUT_SHORT = re.compile(r"\d+ requested and \d+ written")
# What PyTorch says, as a plain RuntimeError, when memory runs out.
_OUT_OF_MEMORY = ("can't allocate memory", "not enough memory", "out of memory")


class DiskError(StageError):
    """The place that a stage writes to is full, cannot be written, or fails."""


class OutOfMemoryError(StageError):
    """A stage wanted more memory than there is."""


@contextmanager
def explained(stage: str, folder: Path) -> Iterator[None]:
    """Turns a full or failing disk, and memory that ran out, into errors with a remedy; others pass.

    Raises:
        DiskError: of the first kind.
        OutOfMemoryError: of the second kind.
    """
    try:
        yield
    except OSError as error:
        number = errno.ENOSPC if _NUMPY_CUT_SHORT.fullmatch(str(error)) else error.errno or 0
        fault = _DISK_FAULTS.get(number)
        if fault is None:
            raise
        place = error.filename or folder
        raise DiskError(
            f"stage '{stage}' could not write '{place}': {fault}, then run the same command again; what is finished "
            f"is kept ({os.strerror(number)})"
        ) from error
    except (MemoryError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and not any(words in str(error) for words in _OUT_OF_MEMORY):
            raise
        raise OutOfMemoryError(
            f"stage '{stage}' ran out of memory: lower --workers, or the size of the room or of the pictures, then run "
            f"the same command again; what is finished is kept ({error})"
        ) from error
