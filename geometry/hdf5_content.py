"""What an HDF5 file from elsewhere must not have: links and data in other files, claims beyond what it holds."""

from __future__ import annotations

from typing import Any

import numpy as np

LARGEST_UNSTORED = 100_000_000  # bytes that a dataset may claim without any data in the file
HIGHEST_COMPRESSION = 100  # of datasets beyond that: real data do not compress to a hundredth


def check_links(file: Any) -> None:
    """Refuse links into other files; none is followed."""

    def elsewhere(name: str, link: Any) -> str | None:
        return None if type(link).__name__ in ("HardLink", "SoftLink") else name

    found = file.visititems_links(elsewhere)
    if found is not None:
        raise ValueError(f"{found}: a link into another file, allowed: data in the file itself")


def check_dataset(dataset: Any) -> None:
    """Refuse a dataset that takes its data from other files or claims far more than the file holds."""
    if dataset.is_virtual or dataset.external:
        raise ValueError(f"{dataset.name}: its data are in other files, allowed: data in the file itself")
    held = dataset.id.get_storage_size()
    for shape in (dataset.shape, dataset.chunks):
        claimed = float(np.prod(shape or (1,), dtype=float)) * dataset.dtype.itemsize
        if claimed > LARGEST_UNSTORED and claimed > HIGHEST_COMPRESSION * held:
            raise ValueError(f"{dataset.name}: claims {claimed:.3g} bytes, the file holds {held} of them")
