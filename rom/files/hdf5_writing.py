"""Writing HDF5 files on disks that may be full."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rom.files.deferred_signals import signals_later


@contextmanager
def new_hdf5(path: str | os.PathLike[str]) -> Iterator[Any]:
    """A new h5py file at `path`, to be written within the block; signals wait for its end.

    HDF5 itself does not survive a full disk: it goes on failing in clean-ups and in the end crashes the process.
    So it writes by way of a file that takes what it is told, and a failure is raised here, once, as an OSError.
    """
    import h5py

    with signals_later(), open(path, "w+b", buffering=0) as raw:
        target = _Patient(raw)
        try:
            with h5py.File(target, "w") as file:
                yield file
        finally:
            if target.failure is not None:
                raise target.failure


class _Patient(io.RawIOBase):
    """A file whose writes always succeed; the first failure is noted, and nothing is written after it."""

    def __init__(self, raw: io.FileIO) -> None:
        self.raw = raw
        self.failure: OSError | None = None

    def write(self, data: Any) -> int:
        """All of the data: one call of the system writes 2 GB at most."""
        rest = memoryview(data).cast("B")
        size = len(rest)
        try:
            while self.failure is None and len(rest) > 0:
                rest = rest[self.raw.write(rest) :]
        except OSError as error:
            self._note(error)
        return size

    def readinto(self, buffer: Any) -> int:
        """As of the file; zeros where it has nothing."""
        view = memoryview(buffer).cast("B")
        found = self.raw.readinto(view) or 0
        view[found:] = bytes(len(view) - found)
        return len(view)

    def seek(self, offset: int, whence: int = 0) -> int:
        """As of the file."""
        return self.raw.seek(offset, whence)

    def tell(self) -> int:
        """As of the file."""
        return self.raw.tell()

    def truncate(self, size: int | None = None) -> int:
        """As of the file."""
        try:
            return self.raw.truncate(size)
        except OSError as error:
            self._note(error)
            return size or 0

    def flush(self) -> None:
        """Nothing is kept back."""

    def _note(self, error: OSError) -> None:
        self.failure = self.failure or error
