"""Cholesky factor of a part of a matrix, some unknowns eliminated last: the Schur complement of these.

The unknowns i and s of a symmetric positive definite matrix, factorised with s last,

    [[A_ii, A_is], [A_si, A_ss]] = L L^T,

leave in the last block of L the Schur complement, L_ss L_ss^T = S = A_ss - A_si A_ii^-1 A_is. A right-hand side goes
down L; then L_ss y_s is minus what the unknowns i take from the right-hand side of s. What else is done with S -
another half of the matrix is added, s is constrained - does not change the factor.

References
----------
J. S. Przemieniecki, Matrix structural analysis of substructures, AIAA Journal 1 (1963) 138-147.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.linear_algebra.cholmod import COLUMNS, CholmodFactor

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Array = NDArray[np.float64]

_BLOCK = 512  # columns of a product at once


class SchurComplement:
    """Factor of the unknowns `own` (a,) and `last` (s,) of a matrix, eliminated in this order.

    `own` holds them afterwards in the order of elimination. Raises ValueError where CHOLMOD would not eliminate
    `last` last: where the others hardly depend on them.
    """

    def __init__(self, matrix: csr_matrix, own: NDArray[np.int64], last: NDArray[np.int64]) -> None:
        order = np.concatenate([own, last])
        unknowns = np.sort(order)
        self._factor = CholmodFactor(matrix, np.searchsorted(unknowns, order), unknowns)
        order = unknowns[self._factor.order]
        self.own, self._count = order[: len(own)], len(last)
        if not np.array_equal(order[len(own) :], last):
            raise ValueError("the given unknowns are not eliminated last")

    def load(self, matrix: csr_matrix) -> None:
        """Take another matrix with the same pattern."""
        self._factor.load(matrix)

    def factorise(self) -> Array | None:
        """The Schur complement (s, s); None where the matrix is not positive definite."""
        if not self._factor.factorise():
            return None
        self._corner = self._factor.last_block(self._count)
        return gram_of_lower(self._corner).T  # by columns, as LAPACK has matrices

    def down(self, rows: Array) -> Array:
        """What right-hand sides (k, a) of the unknowns `own` add to those of the last ones, (k, s)."""
        inner = len(self.own)
        self._state = np.zeros((len(rows), inner + self._count))
        self._state[:, :inner] = rows
        self._factor.solve_lower(self._state)
        return np.asarray(self._state[:, inner:] @ self._corner.T)

    def condensed(self, rows: Array) -> tuple[Array, Array]:
        """What `down` adds for right-hand sides (k, a) that do not come up again, and b^T A_ii^-1 b of each, (k,)."""
        added, work = [], []
        for first in range(0, len(rows), COLUMNS):
            added.append(self.down(rows[first : first + COLUMNS]))
            work.append(np.sum(self._state[:, : len(self.own)] ** 2, axis=1))
            del self._state
        return np.vstack(added), np.concatenate(work)

    def up(self, at_last: Array) -> Array:
        """Solutions (k, a) of the right-hand sides that went down, from those of the last unknowns (k, s)."""
        inner = len(self.own)
        found = self._state
        del self._state
        found[:, inner:] = at_last @ self._corner
        self._factor.solve_upper(found)
        return found[:, :inner]


def gram_of_lower(lower: Array) -> Array:
    """L L^T (n, n) of a lower triangle L: a sixth of the operations of a product of full matrices."""
    n = len(lower)
    found = np.empty((n, n))
    for first in range(0, n, _BLOCK):
        part, last = slice(first, first + _BLOCK), min(first + _BLOCK, n)
        found[first:, part] = lower[first:, :last] @ lower[part, :last].T
        found[part, last:] = found[last:, part].T
    return found
