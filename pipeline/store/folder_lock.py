"""One run at a time works in an output folder; the next one waits.

The lock is the operating system's and ends with the process that holds it, however that ends: none is left
behind.
"""

from __future__ import annotations

import errno
import fcntl
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_PAUSE = 0.05  # seconds between two looks
_NO_LOCKS = {errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL}


@contextmanager
def locked(path: Path, waiting: Callable[[str], None]) -> Iterator[bool]:
    """Hold the lock file `path` within the block; False where the file system knows no locks, and nothing is held.

    `waiting` is called once where another run holds it, with the number of its process (empty: not known).
    Raises OSError where the file cannot be made.
    """
    file = None
    try:
        file = _wait(path, waiting)
        with suppress(OSError):  # the number is only for people
            os.ftruncate(file, 0)
            os.write(file, str(os.getpid()).encode())
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
    try:
        yield file is not None
    finally:
        if file is not None:
            os.close(file)


def _wait(path: Path, waiting: Callable[[str], None]) -> int:
    """Descriptor of the file, locked."""
    told = False
    while True:
        try:
            return _take(path)
        except BlockingIOError:
            if not told:
                waiting(_holder(path))
                told = True
            time.sleep(_PAUSE)


def _take(path: Path) -> int:
    """Descriptor of the file, locked; BlockingIOError where somebody else holds it or has just removed it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except PermissionError:  # another user's, which can be locked all the same
        file = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not path.exists() or not os.path.samestat(os.fstat(file), os.stat(path)):
            raise BlockingIOError
    except BaseException:
        os.close(file)
        raise
    return file


def _holder(path: Path) -> str:
    with suppress(OSError):
        return path.read_text(encoding="ascii", errors="replace").strip()
    return ""
