"""Motions of the kept dofs in reduced coordinates: contact, outputs and load."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import RomParameterError
from rom.reduction.boundary_dofs import BoundaryDofs


def boundary_selection(
    kept: BoundaryDofs, motion: NDArray[np.float64], direction: NDArray[np.float64]
) -> dict[str, Any]:
    """What a reduced model knows of its kept dofs: contact motions, outputs and load, by argument of `ReducedModel`.

    motion (b, n): kept dofs, in their frames, of the reduced coordinates; direction (3,) of the load, of length 1.
    """
    load = direction @ kept.displacement(kept.loaded, kept.size) @ motion
    tip = kept.displacement(kept.tip, kept.size) @ motion
    right, left = motion[: 6 * kept.n_contacts].reshape(2, 3 * kept.n_contacts, -1)
    return {
        "contact_right": right,
        "contact_left": left,
        "force_excitation": load,
        "outputs": {"tip": load, "tip_x": tip[0], "tip_y": tip[1], "tip_z": tip[2]},
    }


def unit_vector(direction: ArrayLike) -> NDArray[np.float64]:
    """Direction (3,) scaled to length 1."""
    vector = np.asarray(direction, dtype=float)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)) or not np.any(vector):
        raise RomParameterError("excitation", "direction", direction, "must be three finite numbers, not all 0")
    return vector / np.linalg.norm(vector)
