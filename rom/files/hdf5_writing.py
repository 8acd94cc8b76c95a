"""Writing HDF5 files on disks that may be full."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rom.files.deferred_signals import deferred_signals


@contextmanager
def new_hdf5(path: str | os.PathLike[str]) -> Iterator[Any]:
    """Context manager: a new HDF5 file, written within the block; signals are deferred to its end.

    HDF5 itself does not survive a full disk: it fails again in its clean-up and in the end crashes the process.
    Therefore it writes to a file object whose writes always succeed; a failure is raised once, at the end.

    Parameters
    ----------
    path : str or path
        The file.

    Yields
    ------
    h5py.File
        The open file.

    Raises
    ------
    OSError
        The file cannot be written.

    Examples
    --------
    >>> from rom import new_hdf5, opened
    >>> with new_hdf5("blade.h5") as file:
    ...     file.attrs["n_blades"] = 40
    >>> with opened("blade.h5") as file:
    ...     print(file.attrs["n_blades"])
    40
    """
    import h5py

    config = h5py.get_config()
    order = config.track_order
    with deferred_signals(), open(path, "w+b", buffering=0) as raw:
        target = _ErrorKeepingFile(raw)
        config.track_order = (
            False  # some libraries change it for the whole process, and with it the bytes of each file
        )
        try:
            with h5py.File(target, "w") as file:
                yield file
        finally:
            config.track_order = order
            if target.failure is not None:
                raise target.failure


class _ErrorKeepingFile(io.RawIOBase):
    """A file whose writes always succeed; it keeps the first failure, and writes nothing after it."""

    def __init__(self, raw: io.FileIO) -> None:
        self.raw = raw
        self.failure: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all of the data: one system call writes 2 GB at most."""
        remaining = memoryview(data).cast("B")
        size = len(remaining)
        try:
            while self.failure is None and len(remaining) > 0:
                remaining = remaining[self.raw.write(remaining) :]
        except OSError as error:
            self._note(error)
        return size

    def readinto(self, buffer: Any) -> int:
        """As in the file; zeros beyond its end."""
        view = memoryview(buffer).cast("B")
        found = self.raw.readinto(view) or 0
        view[found:] = bytes(len(view) - found)
        return len(view)

    def seek(self, offset: int, whence: int = 0) -> int:
        """As in the file."""
        return self.raw.seek(offset, whence)

    def tell(self) -> int:
        """As in the file."""
        return self.raw.tell()

    def truncate(self, size: int | None = None) -> int:
        """As in the file."""
        try:
            return self.raw.truncate(size)
        except OSError as error:
            self._note(error)
            return size or 0

    def flush(self) -> None:
        """Nothing is buffered."""

    def _note(self, error: OSError) -> None:
        self.failure = self.failure or error
