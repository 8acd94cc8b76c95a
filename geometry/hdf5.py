"""HDF5: files read that may come from anywhere, files written on disks that may be full."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from geometry.signals import signals_later

if TYPE_CHECKING:
    import h5py

LARGEST_UNSTORED = 100_000_000  # bytes that a dataset may claim whatever the file holds of it
HIGHEST_COMPRESSION = 100  # of bytes beyond that: numbers that mean something do not shrink to a hundredth

# What h5py raises over damaged files: HDF5's own errors come as OSError, RuntimeError, KeyError or ValueError, and
# what it makes of nonsense in a header trips NumPy and Python.
UNREADABLE = (
    OSError,
    RuntimeError,
    LookupError,
    TypeError,
    ValueError,
    AttributeError,
    ArithmeticError,
    MemoryError,
    SystemError,
)


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator["h5py.File"]:
    """An HDF5 file to read that leads nowhere else.

    Raises ValueError where a part of it is a link into another file, and one of `UNREADABLE` where it is damaged.
    """
    import h5py

    def elsewhere(name: str, link: Any) -> str | None:
        return name if isinstance(link, h5py.ExternalLink) else None

    with h5py.File(path, "r") as file:
        found = file.visititems_links(elsewhere)
        if found is not None:
            raise ValueError(f"{found}: a link into another file, allowed: data in the file itself")
        yield file


def stored_array(dataset: Any) -> np.ndarray:
    """All of an h5py dataset of numbers.

    A dataset can claim terabytes that nobody ever wrote: reading them would fill the memory with zeros. And it can
    take its numbers from other files.
    Raises ValueError for one that claims far more than the file holds of it, that other files hold, or that holds no
    numbers.
    """
    if dataset.shape is None:
        raise ValueError(f"{dataset.name}: empty, allowed: numbers")
    if dataset.dtype.kind not in "biufc":
        raise ValueError(f"{dataset.name}: type {dataset.dtype}, allowed: numbers")
    if dataset.is_virtual or dataset.external:
        raise ValueError(f"{dataset.name}: its data are in other files, allowed: data in the file itself")
    held = dataset.id.get_storage_size()
    for shape in (dataset.shape, dataset.chunks):
        claimed = float(np.prod(shape or (1,), dtype=float)) * dataset.dtype.itemsize
        if claimed > LARGEST_UNSTORED and claimed > HIGHEST_COMPRESSION * held:
            raise ValueError(f"{dataset.name}: claims {claimed:.3g} bytes, the file holds {held} of them")
    return np.asarray(dataset[()])


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


def why_unreadable(error: BaseException) -> str:
    """What h5py says of a file, on one line: HDF5 adds the date and its internals on further lines."""
    return str(error).strip("'\"").splitlines()[0] if str(error) else type(error).__name__
