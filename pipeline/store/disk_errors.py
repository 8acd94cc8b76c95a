"""Errors that the disk causes: one line with the place and the remedy."""

from __future__ import annotations

import errno
import os
import re
from pathlib import Path

from pipeline.errors import one_line

_FULL = {
    errno.ENOSPC: "no space left on the disk: free some",
    errno.EDQUOT: "the disk quota is used up: free some space",
    errno.EFBIG: "a file would get larger than allowed here: raise the limit (ulimit -f)",
}
_CLOSED = {errno.EROFS, errno.EIO, errno.ESTALE, errno.ENODEV}
_SHORT = re.compile(r"\d+ requested and \d+ written")  # NumPy's message of a failed write has no number
_NUMBER = re.compile(r"errno(?: =|) (\d+)", re.IGNORECASE)  # HDF5 and child processes give it in the message only


class StorageError(Exception):
    """The disk takes no more results; those written before are whole.

    `message`: place and remedy, on one line.
    `full`: whether the disk is full (or its quota used up), otherwise it cannot be written at all.
    """

    def __init__(self, message: str, full: bool) -> None:
        super().__init__(message, full)
        self.message, self.full = message, full

    def __str__(self) -> str:
        return self.message


def storage_error(error: BaseException | None, folder: Path) -> StorageError | None:
    """The StorageError for an exception that the disk under `folder` caused, directly or not; otherwise None."""
    while error is not None and not isinstance(error, StorageError):
        number = _number(error)
        if number in _FULL or number in _CLOSED:
            remedy = _FULL.get(number, f"{os.strerror(number)}: make it writable")
            text = f"{_place(error, folder)}: {remedy} and run the same command again; what is done is kept"
            return StorageError(one_line(text), number in _FULL)
        error = error.__cause__ or error.__context__
    return error


def _number(error: BaseException) -> int:
    """The operating system's error number, 0 where there is none."""
    if isinstance(error, OSError):
        if error.errno:
            return error.errno
        if _SHORT.search(str(error)):
            return errno.ENOSPC
    found = _NUMBER.search(str(error))
    return int(found.group(1)) if found else 0


def _place(error: BaseException, folder: Path) -> Path:
    """The output folder, or the folder of the file that failed where that is elsewhere (a cache)."""
    name = getattr(error, "filename", None)
    elsewhere = isinstance(name, str) and name and not Path(os.path.realpath(name)).is_relative_to(folder.resolve())
    return Path(str(name)).parent if elsewhere else folder
