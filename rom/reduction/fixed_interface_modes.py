"""Lowest natural modes; with the boundary dofs held they are the fixed-interface modes of Craig and Bampton."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import FactorisationError, RomParameterError
from rom.linear_algebra.block_lanczos import IsotropicMatrix, lowest_eigenpairs
from rom.linear_algebra.factorisation import Factor

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_SEED = 20240607
_FIRST_GUESS = 20
_MOST_MODES = 1000
_TOLERANCE = 1e-9  # of the shapes; the error of an eigenvalue is the square of it, round-off


@dataclass(frozen=True)
class ModalBasis:
    """Natural modes of a structure."""

    omega: NDArray[np.float64]  # (m,), natural frequencies in rad/s, ascending
    shapes: NDArray[np.float64]  # (n, m), mass-normalised mode shapes

    def __len__(self) -> int:
        return len(self.omega)

    @property
    def highest_hz(self) -> float:
        """Highest natural frequency in Hz, 0 without modes."""
        return float(self.omega[-1]) / (2.0 * np.pi) if len(self) else 0.0

    def first(self, count: int) -> ModalBasis:
        """The lowest `count` modes."""
        return ModalBasis(self.omega[:count], self.shapes[:, :count])


def lowest_modes(mass: csr_matrix | IsotropicMatrix, factor: Factor, count: int) -> ModalBasis:
    """The `count` lowest modes of K phi = w^2 M phi, by block Lanczos with a factor of K.

    The start block is fixed, and so are the signs (positive projection on its first vector): the same matrices give
    the same modes. Raises FactorisationError when an eigenvalue is not above 0.
    """
    size = mass.shape[0]
    count = min(count, size)
    if count < 1:
        return ModalBasis(np.zeros(0), np.zeros((size, 0)))
    start = np.random.default_rng(_SEED).standard_normal((min(factor.block, size), size))
    squared, rows = lowest_eigenpairs(lambda block: factor.solve(block.T).T, mass, start, count, _TOLERANCE)
    if squared[0] <= 0.0:
        raise FactorisationError(
            f"the held structure has the eigenvalue {squared[0]:.3g} (rad/s)^2, allowed: above 0; "
            "it is not held or, with rotation, not stable"
        )
    return ModalBasis(np.sqrt(squared), (rows * np.where(rows @ start[0] < 0.0, -1.0, 1.0)[:, None]).T)


def modes_up_to(mass: csr_matrix | IsotropicMatrix, factor: Factor, frequency_limit: float) -> ModalBasis:
    """All modes up to `frequency_limit` in Hz; twice as many are computed until one lies beyond.

    Raises RomParameterError where there are too many, and what `lowest_modes` raises.
    """
    limit, count = 2 * np.pi * frequency_limit, _FIRST_GUESS
    while True:
        modes = lowest_modes(mass, factor, count)
        if len(modes) < count or modes.omega[-1] > limit:
            return modes.first(int(np.searchsorted(modes.omega, limit, side="right")))
        if count >= _MOST_MODES:
            allowed = f"a lower one: more than {_MOST_MODES} modes lie below, up to {modes.highest_hz:.4g} Hz"
            raise RomParameterError("rom", "frequency_limit", frequency_limit, allowed)
        count = min(2 * count, _MOST_MODES)
