"""Cholesky factor of a matrix cut in two halves, each factorised and solved with in a thread of its own.

A few unknowns s separate the others into two sets that are not coupled. Each half, factorised together with them, has
a Schur complement S_h (`SchurComplement`); that of the whole matrix is S = S_1 + S_2 - A_ss. A right-hand side goes
down both halves, through S and up again. The steps are the same on one core, and so is every bit.

References
----------
J. S. Przemieniecki, Matrix structural analysis of substructures, AIAA Journal 1 (1963) 138-147.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.linear_algebra.cholmod import columns_at_once
from rom.linear_algebra.ordering import Bisection
from rom.linear_algebra.schur_complement import SchurComplement
from rom.linear_algebra.threads import at_once, return_memory

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Array = NDArray[np.float64]


class TwoHalves:
    """Factor of a symmetric positive definite matrix (n, n), both triangles stored, cut by a bisection.

    Raises ValueError where CHOLMOD would not eliminate the separator last: where the halves hardly depend on it.
    """

    def __init__(self, matrix: csr_matrix, cut: Bisection) -> None:
        self._separator = cut.separator
        self._halves = at_once(lambda own: SchurComplement(matrix, own, cut.separator), cut.halves)
        self._corner = self._part(matrix)
        return_memory()

    def _part(self, matrix: csr_matrix) -> Array:
        return np.asarray(matrix[self._separator][:, self._separator].toarray())

    def load(self, matrix: csr_matrix) -> None:
        """Take another matrix with the same pattern; `factorise` then computes its factor in the place of the last.

        Raises ValueError for another number of entries.
        """
        at_once(lambda half: half.load(matrix), self._halves)
        self._corner = self._part(matrix)

    def factorise(self) -> bool:
        """Compute the factor; False where the matrix is not positive definite."""
        from scipy.linalg import LinAlgError, cho_factor

        found = [part for part in at_once(SchurComplement.factorise, self._halves) if part is not None]
        if len(found) < len(self._halves):
            return False
        schur = found.pop()
        schur += found.pop()
        schur -= self._corner
        del self._corner
        return_memory()
        try:
            self._top = cho_factor(schur, lower=True, overwrite_a=True)
        except LinAlgError:
            return False
        return True

    def solve(self, rows: Array) -> Array:
        """Solutions (k, n) of A x = b for k right-hand sides, stored as rows."""
        rows = np.asarray(rows, dtype=float)
        solution = np.empty(rows.shape)
        step = columns_at_once(len(rows))
        for first in range(0, len(rows), step):
            part = slice(first, first + step)
            self._solve_at_once(rows[part], solution[part])
        return_memory()
        return solution

    def _solve_at_once(self, rows: Array, solution: Array) -> None:
        from scipy.linalg import cho_solve

        at_separator = rows[:, self._separator] + sum(
            at_once(lambda half: half.down(rows[:, half.own]), self._halves)
        )
        solution[:, self._separator] = at_separator = cho_solve(self._top, at_separator.T).T

        def up(half: SchurComplement) -> None:
            solution[:, half.own] = half.up(at_separator)

        at_once(up, self._halves)
