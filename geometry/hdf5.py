"""Reading HDF5 datasets that may come from anywhere."""

from typing import Any

import numpy as np

LARGEST_UNSTORED = 100_000_000  # bytes that a dataset may claim whatever the file holds of it
HIGHEST_COMPRESSION = 1000  # of bytes beyond that


def stored_array(dataset: Any) -> np.ndarray:
    """All of an h5py dataset.

    A dataset can claim terabytes that nobody ever wrote: reading them would fill the memory with zeros.
    Raises ValueError for one that claims far more than the file holds of it.
    """
    claimed, held = dataset.size * dataset.dtype.itemsize, dataset.id.get_storage_size()
    if claimed > LARGEST_UNSTORED and claimed > HIGHEST_COMPRESSION * held:
        raise ValueError(f"{dataset.name}: claims {claimed:.3g} bytes, the file holds {held} of them")
    return np.asarray(dataset[()])
