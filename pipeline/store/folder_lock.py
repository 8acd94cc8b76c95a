"""One run at a time works in an output folder; the next one waits.

The lock is the operating system's (flock, by way of filelock): it ends with the process that holds it, however that
process ends. Where the file system has no flock, filelock's soft lock takes its place: a file that exists as long as
the lock is held and names the process that holds it.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from filelock import BaseFileLock

SOFT = ".soft"  # added to the name of the lock file where the lock is a soft one
_NO_FLOCK = {errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL}


@contextmanager
def locked(path: Path, waiting: Callable[[str], None]) -> Iterator[None]:
    """Hold the lock file `path` within the block.

    Parameters
    ----------
    path : Path
        Lock file. Missing folders are made.
    waiting : callable
        Called once where another process holds the lock, with the number of that process ("" if not known).

    Raises
    ------
    OSError
        The file cannot be made.
    """
    from filelock import FileLock, SoftFileLock

    lock: BaseFileLock = FileLock(path, fallback_to_soft=False)
    try:
        _acquire(lock, waiting)
        with suppress(OSError):  # the number only serves the message
            path.write_text(str(os.getpid()), encoding="ascii")
    except OSError as error:
        if error.errno not in _NO_FLOCK:
            raise
        lock = SoftFileLock(path.with_name(path.name + SOFT))
        _acquire(lock, waiting)
    try:
        yield
    finally:
        lock.release()


def _acquire(lock: BaseFileLock, waiting: Callable[[str], None]) -> None:
    """Take the lock, also where another process deletes its folder meanwhile."""
    from filelock import Timeout

    path, announced = Path(lock.lock_file), False
    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            lock.acquire(timeout=1.0 if announced else 0.0)
            return
        except Timeout:
            if not announced:
                waiting(_holder(path))
                announced = True
        except FileNotFoundError:
            if not announced:
                raise


def _holder(path: Path) -> str:
    """Number of the process that holds the lock, as its file says."""
    with suppress(OSError):
        return path.read_text(encoding="ascii", errors="replace").partition("\n")[0].strip()
    return ""
