"""Bordered systems with a block-tridiagonal cyclic matrix, by block elimination.

The last block of the ring and the border are taken out. What is left is a chain of N - 1 blocks, eliminated by the
block LU factorisation D_k = A_kk - A_(k,k-1) D_(k-1)^-1 A_(k-1,k) [1]_. The Schur complement of the chain is one
dense matrix of the size of a block and the border. Cost: about N b^2 (9 b + 4 w) multiplications for blocks of size b
and a border of width w.

Inside a block the elimination pivots, across blocks it does not: each solution is corrected with its residual, and is
NaN where that does not converge.

References
----------
.. [1] G. H. Golub, C. F. Van Loan, Matrix Computations, 4th ed., Johns Hopkins University Press, 2013, section 4.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from nonlinear.contact.parameters import Array

CORRECTIONS = 6
SOLVED = 1e-9  # relative residual, above which a system has no solution
ROUND_OFF = 1e-15


class CyclicBlocks(NamedTuple):
    """A block-tridiagonal cyclic matrix: row j has the blocks before[j], own[j] and after[j] at j-1, j and j+1.

    Each (N, b, b); indices modulo N. Blocks that meet in one place (N = 1, 2) are added.
    """

    before: Array
    own: Array
    after: Array

    def times(self, x: Array) -> Array:
        """The product with vectors (N, b, q)."""
        product: Array = self.own @ x + self.before @ np.roll(x, 1, axis=0) + self.after @ np.roll(x, -1, axis=0)
        return product

    def dense(self) -> Array:
        """The whole matrix, (N b, N b)."""
        count, size = self.own.shape[:2]
        matrix = np.zeros((count, size, count, size))
        for j in range(count):
            matrix[j, :, j] += self.own[j]
            matrix[j, :, (j - 1) % count] += self.before[j]
            matrix[j, :, (j + 1) % count] += self.after[j]
        return matrix.reshape(count * size, count * size)


class _Lu(NamedTuple):
    """LU factors of a matrix, transposed as NumPy's rows are LAPACK's columns."""

    factors: Array
    pivots: NDArray[np.int32]

    @classmethod
    def of(cls, matrix: Array) -> _Lu:
        factors, pivots, _ = dgetrf(np.ascontiguousarray(matrix).T)
        return cls(factors, pivots)

    @property
    def sign(self) -> int:
        """Sign of the determinant."""
        swaps = int(np.count_nonzero(self.pivots != np.arange(self.pivots.size)))
        return int(np.prod(np.sign(self.factors.diagonal()))) * (-1) ** swaps

    def solve(self, right: Array) -> Array:
        """The solution for right-hand sides (b, q)."""
        found: Array = dgetrs(self.factors, self.pivots, right, trans=1)[0]
        return found


@dataclass(frozen=True)
class CyclicBlockFactors:
    """Factors of a block-tridiagonal cyclic matrix A, bordered by w columns and rows.

    ::

        [ A   c ] [ x ]   [ b   ]
        [ t   e ] [ z ] = [ b_e ]
    """

    matrix: CyclicBlocks  # A
    # `column`, `row`: (N, b, w), c and the transpose of t
    column: Array
    row: Array
    corner: Array  # (w, w), e
    pivots: tuple[_Lu, ...]  # d_k of the chain, N - 1
    onward: Array  # (N - 1, b, b), d_k^-1 A_(k,k+1)
    coupling: Array  # (N - 1, b, b + w), the chain's solution for the columns of the last block and of the border
    schur: _Lu  # the Schur complement, b + w rows

    @classmethod
    def of(cls, matrix: CyclicBlocks, column: Array, row: Array, corner: Array) -> CyclicBlockFactors:
        """Factorise; a singular system solves to NaN.

        Shapes: `column` (N, b, w), `row` (N, b, w), `corner` (w, w).
        """
        count, size, width = column.shape
        chain, wide = count - 1, size + width
        beside = np.zeros((chain, size, wide))
        beside[..., size:] = column[:chain]
        if chain:
            beside[0, :, :size] += matrix.before[0]
            beside[-1, :, :size] += matrix.after[chain - 1]
        pivots, onward = [], np.zeros((chain, size, size))
        with np.errstate(all="ignore"):
            for k in range(chain):
                own = matrix.own[k]
                if k:
                    own = own - matrix.before[k] @ onward[k - 1]
                    beside[k] -= matrix.before[k] @ beside[k - 1]
                pivots.append(_Lu.of(own))
                last = k == chain - 1
                found = pivots[k].solve(beside[k] if last else np.hstack([beside[k], matrix.after[k]]))
                beside[k] = found[:, :wide]
                onward[k] = 0.0 if last else found[:, wide:]
            for k in range(chain - 2, -1, -1):
                beside[k] -= onward[k] @ beside[k + 1]
        schur = np.block([[matrix.own[-1], column[-1]], [row[-1].T, corner]])
        if chain:
            schur[:size] -= matrix.after[-1] @ beside[0] + matrix.before[-1] @ beside[-1]
            schur[size:] -= row[:chain].reshape(-1, width).T @ beside.reshape(-1, wide)
        else:
            schur[:size, :size] += matrix.before[0] + matrix.after[0]
        return cls(matrix, column, row, corner, tuple(pivots), onward, beside, _Lu.of(schur))

    @property
    def sign(self) -> int:
        """Sign of the determinant of the bordered matrix."""
        return int(np.prod([lu.sign for lu in self.pivots])) * self.schur.sign

    def solve(self, right: Array, last: Array) -> tuple[Array, Array]:
        """Solution (x, z) for the right-hand side (b (N, b), b_e (w,)), corrected to round-off; NaN if it fails."""
        whole = np.hypot(np.linalg.norm(right), np.linalg.norm(last))
        with np.errstate(all="ignore"):
            x, z = self.eliminated(right, last)
            size = np.inf
            for _ in range(CORRECTIONS):
                residual = right - self.matrix.times(x[..., None])[..., 0] - self.column @ z
                residual_last = last - np.einsum("kbw,kb->w", self.row, x) - self.corner @ z
                previous, size = size, np.hypot(np.linalg.norm(residual), np.linalg.norm(residual_last))
                if not size > ROUND_OFF * whole or not size < 0.5 * previous:
                    break
                dx, dz = self.eliminated(residual, residual_last)
                x, z = x + dx, z + dz
        if not min(size, previous) <= SOLVED * whole:
            return np.full_like(x, np.nan), np.full_like(z, np.nan)
        return x, z

    def eliminated(self, right: Array, last: Array) -> tuple[Array, Array]:
        """The solution of the factors alone, not corrected."""
        chain, size = len(self.pivots), right.shape[1]
        x = np.empty_like(right)
        for k in range(chain):
            rest = right[k] - self.matrix.before[k] @ x[k - 1] if k else right[k]
            x[k] = self.pivots[k].solve(rest)
        for k in range(chain - 2, -1, -1):
            x[k] -= self.onward[k] @ x[k + 1]
        reduced = np.concatenate([right[-1], last])
        if chain:
            reduced[:size] -= self.matrix.after[-1] @ x[0] + self.matrix.before[-1] @ x[chain - 1]
            reduced[size:] -= np.einsum("kbw,kb->w", self.row[:chain], x[:chain])
        end = self.schur.solve(reduced)
        x[-1] = end[:size]
        x[:chain] -= self.coupling @ end
        return x, end[size:]
