"""Reading HDF5 files that may come from anywhere."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

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
    """The HDF5 file `path` to read, which leads nowhere else.

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


def why_unreadable(error: BaseException) -> str:
    """What h5py says of a file with an `error` of `UNREADABLE`, on one line: HDF5 adds its internals on others."""
    return str(error).strip("'\"").splitlines()[0] if str(error) else type(error).__name__
