"""HDF5 files: reading what may be damaged or hostile, writing on disks that may be full."""

import io
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Any

import numpy as np

from geometry.hdf5_content import check_dataset, check_links

if TYPE_CHECKING:
    import h5py

# Exceptions of h5py on damaged files: errors of HDF5 come as OSError, RuntimeError, KeyError or ValueError; nonsense
# in a header makes NumPy and Python raise the others.
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
def deferred_signals() -> Iterator[None]:
    """Context manager: defer the handlers of Ctrl-C, SIGTERM and SIGHUP to the end of the block.

    An exception that a handler raises in a Python callback of C code would be lost, or leave the work half done.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        received.append(number)

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    handlers = {number: handler for number, handler in before.items() if callable(handler)}
    for number in handlers:
        signal.signal(number, note)
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if received:
            handlers[signal.Signals(received[0])](received[0], None)


@contextmanager
def new_hdf5(path: str | os.PathLike[str]) -> Iterator[Any]:
    """Context manager: a new HDF5 file, written within the block; signals are deferred to its end.

    HDF5 itself does not survive a full disk: it fails again in its clean-up and in the end crashes the process.
    Therefore it writes to a file object whose writes always succeed; a failure is raised once, at the end.
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


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator["h5py.File"]:
    """Context manager: the HDF5 file `path`, open for reading, without links into other files."""
    import h5py

    with h5py.File(path, "r") as file:
        check_links(file)
        yield file


def stored_array(dataset: Any) -> np.ndarray:
    """All numbers of an h5py dataset.

    A dataset can claim terabytes that were never written: reading them would fill the memory with zeros. It can also
    take its data from other files.
    """
    if dataset.shape is None:
        raise ValueError(f"{dataset.name}: empty, allowed: numbers")
    if dataset.dtype.kind not in "biufc":
        raise ValueError(f"{dataset.name}: type {dataset.dtype}, allowed: numbers")
    check_dataset(dataset)
    return np.asarray(dataset[()])


def why_unreadable(error: BaseException) -> str:
    """Message of an exception of `UNREADABLE`: the system's own, or its first line; HDF5 adds internals on others."""
    if isinstance(error, OSError) and error.errno:  # an error of the system, wrapped by HDF5 in its own words
        return os.strerror(error.errno)
    return str(error).strip("'\"").splitlines()[0] if str(error) else type(error).__name__
