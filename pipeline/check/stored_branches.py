"""The branches of a stored curve, as far as the search for solutions at one frequency needs them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.stages.curve_file import BRANCHES

if TYPE_CHECKING:
    import h5py


@dataclass(frozen=True)
class StoredBranch:
    """Points of a branch: frequencies (P,), coefficients d^(h) (P, H+1, n_c, 3), harmonics balanced (P,)."""

    frequency_hz: NDArray[np.float64]
    relative_displacement: NDArray[np.complex128]
    kept_harmonics: NDArray[np.int64]

    @property
    def range_hz(self) -> tuple[float, float]:
        """Lowest and highest frequency, Hz."""
        return float(self.frequency_hz.min()), float(self.frequency_hz.max())


def stored_branches(file: Path) -> list[StoredBranch]:
    """The main branch and the detached ones of a curve file, in the order of their numbers 0, 1, ..."""
    import h5py

    with h5py.File(file, "r") as source:
        detached = sorted(source.get(BRANCHES, ()), key=int)
        return [_branch(source), *(_branch(source[f"{BRANCHES}/{number}"]) for number in detached)]


def _branch(group: h5py.Group) -> StoredBranch:
    values: dict[str, Any] = {name: group[name][()] for name in StoredBranch.__dataclass_fields__}
    return StoredBranch(**values)
