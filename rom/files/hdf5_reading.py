"""Reading HDF5 files from untrusted sources."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from geometry import check_dataset, check_links

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
def opened(path: str | os.PathLike[str]) -> Iterator["h5py.File"]:
    """Context manager: the HDF5 file `path`, open for reading, without links into other files.

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
    ValueError
        The file holds a link into another file. For a damaged file any of `UNREADABLE` is raised.

    Examples
    --------
    >>> from rom import new_hdf5, opened
    >>> with new_hdf5("areas.h5") as file:
    ...     file["area"] = np.ones((4, 3))
    >>> with opened("areas.h5") as file:
    ...     print(file["area"].shape)
    (4, 3)
    """
    import h5py

    with h5py.File(path, "r") as file:
        check_links(file)
        yield file


def stored_array(dataset: Any) -> np.ndarray:
    """All numbers of an h5py dataset.

    A dataset can claim terabytes that were never written: reading them would fill the memory with zeros. It can also
    take its data from other files.

    Parameters
    ----------
    dataset : h5py.Dataset
        The dataset.

    Returns
    -------
    array
        Its numbers.

    Raises
    ------
    ValueError
        The dataset claims far more than the file holds, takes its data from other files, or holds no numbers.

    Examples
    --------
    >>> from rom import new_hdf5, opened, stored_array
    >>> with new_hdf5("areas.h5") as file:
    ...     file["area"] = np.ones((4, 3))
    >>> with opened("areas.h5") as file:
    ...     print(stored_array(file["area"]).sum())
    12.0
    """
    if dataset.shape is None:
        raise ValueError(f"{dataset.name}: empty, allowed: numbers")
    if dataset.dtype.kind not in "biufc":
        raise ValueError(f"{dataset.name}: type {dataset.dtype}, allowed: numbers")
    check_dataset(dataset)
    return np.asarray(dataset[()])


def why_unreadable(error: BaseException) -> str:
    """Message of an exception of `UNREADABLE`: the system's own, or its first line; HDF5 adds internals on others.

    Parameters
    ----------
    error : BaseException
        The exception.

    Examples
    --------
    >>> from rom import why_unreadable
    >>> why_unreadable(ValueError("area: empty, allowed: numbers"))
    'area: empty, allowed: numbers'
    """
    if isinstance(error, OSError) and error.errno:  # an error of the system, wrapped by HDF5 in its own words
        return os.strerror(error.errno)
    return str(error).strip("'\"").splitlines()[0] if str(error) else type(error).__name__
