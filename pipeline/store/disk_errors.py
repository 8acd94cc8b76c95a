"""A disk that takes no more: one line that says where, and what to do."""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Iterator
from pathlib import Path

from pipeline.errors import one_line

_FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_CLOSED = {errno.EROFS, errno.EIO, errno.ESTALE, errno.ENODEV}
_SHORT = re.compile(r"\d+ requested and \d+ written")  # what NumPy says of a file that it could not write
_NUMBER = re.compile(r"errno(?: =|) (\d+)", re.IGNORECASE)  # HDF5 and processes apart say it in words only


class StorageError(Exception):
    """Results cannot be written any more; the message names the place and what to do. Nothing is half-written.

    full: for want of room.
    """

    def __init__(self, message: str, full: bool) -> None:
        super().__init__(message, full)
        self.message, self.full = message, full

    def __str__(self) -> str:
        return self.message


def storage_error(error: BaseException, folder: Path) -> StorageError | None:
    """What to tell where the reason of `error`, or of what led to it, is the disk under `folder`; otherwise None."""
    if isinstance(error, StorageError):
        return error
    for each in _chain(error):
        number = _number(each)
        if number in _FULL:
            return _full(number, _place(each, folder))
        if number in _CLOSED:
            what = f"{os.strerror(number)}: make it writable"
            return StorageError(_line(_place(each, folder), what), full=False)
    return None


def _full(number: int, place: Path) -> StorageError:
    what = {
        errno.ENOSPC: "no space left on the disk: free some",
        errno.EDQUOT: "the disk quota is used up: free some space",
        errno.EFBIG: "a file would get larger than allowed here: raise the limit (ulimit -f)",
    }[number]
    return StorageError(_line(place, what), full=True)


def _line(place: Path, what: str) -> str:
    return one_line(f"{place}: {what} and run the same command again; what is done is kept")


def _chain(error: BaseException) -> Iterator[BaseException]:
    """The error and what led to it."""
    seen: set[int] = set()
    each: BaseException | None = error
    while each is not None and id(each) not in seen:
        seen.add(id(each))
        yield each
        each = each.__cause__ or each.__context__


def _number(error: BaseException) -> int:
    """The operating system's number of an error, 0 where it has none."""
    if isinstance(error, OSError) and error.errno:
        return error.errno
    if isinstance(error, OSError) and _SHORT.search(str(error)):
        return errno.ENOSPC
    found = _NUMBER.search(str(error))
    return int(found.group(1)) if found else 0


def _place(error: BaseException, folder: Path) -> Path:
    """The folder that could not be written: `folder`, or the one of a file elsewhere, such as a cache."""
    name = getattr(error, "filename", None)
    if not isinstance(name, str) or not name:
        return folder
    try:
        inside = Path(name).resolve().is_relative_to(folder.resolve())
    except OSError:
        return folder
    return folder if inside else Path(name).parent
