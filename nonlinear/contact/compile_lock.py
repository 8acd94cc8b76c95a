"""One process at a time compiles: what another one is just compiling is waited for and loaded, not compiled again."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO


class CompileLock(threading.local):
    """The lock of the kernel that this thread compiles, the operating system's: it ends with its process.

    A kernel compiles those that it calls, under the lock of the outermost one, which is given back at its end.
    `depth`: number of compilations under way in this thread, one within another.
    """

    depth = 0
    _file: IO[bytes] | None = None

    def take(self, file: Path) -> bool:
        """Wait until no other process holds the lock `file`; False where this one has the lock already.

        Nothing is waited for where the file system has no locks, or this system no flock.
        """
        if self._file is not None:
            return False
        with suppress(ImportError, OSError):
            import fcntl

            self._file = file.open("ab")
            fcntl.flock(self._file, fcntl.LOCK_EX)
        return True

    @contextmanager
    def compilation(self) -> Iterator[None]:
        """A block that may take the lock, which it gives back."""
        self.depth += 1
        try:
            yield
        finally:
            self.depth -= 1
            if self.depth == 0 and self._file is not None:
                self._file.close()
                self._file = None
