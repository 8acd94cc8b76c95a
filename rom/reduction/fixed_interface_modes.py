"""Lowest modes of the structure with every kept dof held."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import FactorisationError, RomParameterError
from rom.linear_algebra.block_lanczos import lowest_eigenpairs
from rom.linear_algebra.factorisation import Factor

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_SEED = 20240607
_FIRST_GUESS = 20
_MOST_MODES = 1000
_TOLERANCE = 1e-9  # of the shapes; the error of an eigenvalue is the square of it, round-off


def lowest_modes(mass: csr_matrix, factor: Factor, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The `count` lowest modes of K phi = w^2 M phi: w (m,) [rad/s] ascending, mass-normalised shapes (n, m).

    Block Lanczos with a factor of K. The start block is fixed and so are the signs (projection on its first
    vector positive), so the same matrices give the same modes.
    Raises FactorisationError when an eigenvalue is not above 0.
    """
    size = mass.shape[0]
    count = min(count, size)
    if count < 1:
        return np.zeros(0), np.zeros((size, 0))
    start = np.random.default_rng(_SEED).standard_normal((min(factor.block, size), size))
    squared, rows = lowest_eigenpairs(lambda block: factor.solve(block.T).T, mass, start, count, _TOLERANCE)
    if squared[0] <= 0.0:
        raise FactorisationError(
            f"the held structure has the eigenvalue {squared[0]:.3g} (rad/s)^2, allowed: above 0; "
            "it is not held or, with rotation, not stable"
        )
    return np.sqrt(squared), (rows * np.where(rows @ start[0] < 0.0, -1.0, 1.0)[:, None]).T


def modes_up_to(
    mass: csr_matrix, factor: Factor, frequency_limit: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """All modes up to frequency_limit [Hz], as `lowest_modes`; asks for twice as many until one lies beyond.

    Raises RomParameterError where there are more than can be kept, beside what `lowest_modes` raises.
    """
    limit, count = 2 * np.pi * frequency_limit, _FIRST_GUESS
    while True:
        angular, shapes = lowest_modes(mass, factor, count)
        if len(angular) < count or angular[-1] > limit:
            within = angular <= limit
            return angular[within], shapes[:, within]
        if count >= _MOST_MODES:
            allowed = (
                f"a lower one: more than {_MOST_MODES} modes lie below, up to {angular[-1] / (2 * np.pi):.4g} Hz"
            )
            raise RomParameterError("rom", "frequency_limit", frequency_limit, allowed)
        count = min(2 * count, _MOST_MODES)
