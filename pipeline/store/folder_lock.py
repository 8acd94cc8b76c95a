"""One run at a time works in an output folder; the next one waits.

The lock is the operating system's (flock): it ends with the process that holds it, however that process ends. Where
the file system has no flock, filelock's soft lock takes its place: a file that exists as long as the lock is held and
names the process that holds it.
"""

from __future__ import annotations

import errno
import fcntl
import os
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

SOFT = ".soft"  # added to the name of the lock file where the lock is a soft one
_NO_FLOCK = {errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EINVAL}
_NO_FILE = {errno.ELOOP, errno.EISDIR, errno.ENXIO, errno.EMLINK}  # a link, a folder, a pipe or a socket
_OPENED = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_LOOK = 0.05  # seconds between two looks whether the lock is free
_LONGEST = 20  # bytes of the number of a process


@contextmanager
def locked(path: Path, waiting: Callable[[str], None]) -> Iterator[None]:
    """Hold the lock file `path` within the block."""
    try:
        held = _flocked(path, waiting)
    except OSError as error:
        if error.errno not in _NO_FLOCK:
            raise
        with _softly(path.with_name(path.name + SOFT), waiting):
            yield
        return
    try:
        yield
    finally:
        os.close(held)


def _flocked(path: Path, waiting: Callable[[str], None]) -> int:
    """Descriptor of the locked file, also where another process deletes its folder meanwhile."""
    announced = False
    while True:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            held = _opened(path)
        except FileNotFoundError:  # deleted in between
            if not announced:
                raise
            continue
        holder = None
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_at(held, path):
                _write_number(held)
                return held
        except BlockingIOError:
            holder = _number(held)
        except BaseException:
            os.close(held)
            raise
        os.close(held)
        if holder is not None:
            if not announced:
                waiting(holder)
                announced = True
            time.sleep(_LOOK)


def _opened(path: Path) -> int:
    """The lock file, opened without a change to what stands there."""
    try:
        held = os.open(path, _OPENED, 0o644)
    except OSError as error:
        if error.errno in _NO_FILE:
            raise ValueError(f"{path} is a link, a folder or a pipe, not the lock of a run; delete it") from None
        raise
    found = os.fstat(held)
    if stat.S_ISREG(found.st_mode) and found.st_nlink <= 1:
        return held
    os.close(held)
    raise ValueError(f"{path} is a device or a second name of another file, not the lock of a run; delete it")


def _is_at(held: int, path: Path) -> bool:
    """Whether the locked file is still the one of this name."""
    try:
        return os.path.samestat(os.fstat(held), os.stat(path))
    except OSError:
        return False


def _write_number(held: int) -> None:
    """The number of this process, which only serves the message; a text that is no number is left as it is."""
    with suppress(OSError):
        text = os.pread(held, _LONGEST + 1, 0)
        if len(text) <= _LONGEST and (not text.strip() or text.strip().isdigit()):
            os.ftruncate(held, 0)
            os.pwrite(held, str(os.getpid()).encode(), 0)


def _number(held: int) -> str:
    """Number of the process that holds the lock, as its file says."""
    with suppress(OSError):
        return os.pread(held, _LONGEST, 0).decode("ascii", errors="replace").strip()
    return ""


@contextmanager
def _softly(path: Path, waiting: Callable[[str], None]) -> Iterator[None]:
    """Hold the soft lock `path` within the block."""
    from filelock import SoftFileLock, Timeout

    lock, announced = SoftFileLock(path), False
    while not lock.is_locked:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            lock.acquire(timeout=1.0 if announced else 0.0)
        except Timeout:
            if not announced:
                with suppress(OSError):
                    waiting(path.read_text(encoding="ascii", errors="replace").partition("\n")[0].strip())
                announced = True
        except FileNotFoundError:
            if not announced:
                raise
    try:
        yield
    finally:
        lock.release()
