"""The bordered Jacobian solved by LU factors of its full size."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from nonlinear.contact.parameters import Array


@dataclass(frozen=True)
class DenseFactors:
    """LU factors of the Jacobian J = I - G df/dx, bordered by a column and a row.

    ::

        [ J   c ] [ x ]   [ b   ]
        [ t   e ] [ z ] = [ b_e ]

    Passive unknowns, on which no contact force depends (an open contact, a direction without friction), have the
    column of the unit matrix in J: they follow from the active ones and are eliminated before the factorisation.
    """

    coupling: Array  # (n, n_active), G df/dx in the columns of the active unknowns
    active: NDArray[np.intp]  # (n_active,), indices of the active and of the passive unknowns
    passive: NDArray[np.intp]  # (n_active,), indices of the active and of the passive unknowns
    column: Array  # (n,), c and t
    row: Array  # (n,), c and t
    factors: Array  # (n_active + 1, n_active + 1), LU factors of the transpose
    pivots: NDArray[np.int32]  # (n_active + 1, n_active + 1), LU factors of the transpose
    sign: int  # sign of the determinant

    @classmethod
    def of(cls, coupling: tuple[Array, NDArray[np.intp]], column: Array, row: Array, corner: float) -> "DenseFactors":
        """Factorise; `coupling` is that of `LinearisedResidual`. A singular system solves to NaN or infinity."""
        product, active = coupling
        size, n_active = product.shape
        passive = np.delete(np.arange(size), active) if n_active < size else np.empty(0, dtype=np.intp)
        matrix = np.empty((n_active + 1, n_active + 1))
        np.negative(product[active], out=matrix[:-1, :-1])
        matrix[np.arange(n_active), np.arange(n_active)] += 1.0
        matrix[:-1, -1] = column[active]
        matrix[-1, :-1], matrix[-1, -1] = row[active], corner
        if passive.size:
            matrix[-1, :-1] += row[passive] @ product[passive]
            matrix[-1, -1] -= row[passive] @ column[passive]
        factors, pivots, _ = dgetrf(matrix.T, overwrite_a=1)
        swaps = int(np.count_nonzero(pivots != np.arange(n_active + 1)))
        sign = int(np.prod(np.sign(factors.diagonal()))) * (-1) ** swaps
        return cls(product, active, passive, column, row, factors, pivots, sign)

    def solve(self, right: Array, last: float) -> tuple[Array, float]:
        """Solution (x, z) for the right-hand side (b (n,), b_e)."""
        reduced = np.append(right[self.active], last)
        if self.passive.size:
            reduced[-1] -= self.row[self.passive] @ right[self.passive]
        with np.errstate(all="ignore"):
            solution, _ = dgetrs(self.factors, self.pivots, reduced, trans=1, overwrite_b=1)
        found = np.empty(right.size)
        found[self.active] = solution[:-1]
        if self.passive.size:
            uncoupled = right[self.passive] + self.coupling[self.passive] @ solution[:-1]
            found[self.passive] = uncoupled - self.column[self.passive] * solution[-1]
        return found, float(solution[-1])
