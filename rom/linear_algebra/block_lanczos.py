"""Lowest modes of K phi = w^2 M phi by a block Lanczos process with K^-1 M.

Blocks of solutions with a factor of K cost a fraction of as many single ones, which is what ARPACK asks for. The
basis is kept M-orthonormal in full, so no eigenvector appears twice; an eigenvalue is found as often as it is there,
up to the width of the block. R. G. Grimes, J. G. Lewis, H. D. Simon, A shifted block Lanczos algorithm for solving
sparse symmetric generalized eigenproblems, SIAM J. Matrix Anal. Appl. 15 (1994) 228-272.
Vectors are rows here: a block (p, n) is contiguous for the solver and for the products with the basis.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

Block = NDArray[np.float64]

_DEPENDENT = 1e-11  # a direction of a block of which no more is left lies in the basis
_CLEAN = 1e-12  # part in the basis below which a block's product with M need not be formed again
_LOOK_AFTER = 1.05  # the basis grows by so much between two looks at what has converged


class _Basis:
    """M-orthonormal rows (k, n) and what K^-1 M is in them, (k, k)."""

    def __init__(self, size: int, capacity: int) -> None:
        self._rows, self._projected = np.empty((capacity, size)), np.zeros((capacity, capacity))
        self.count = 0

    @property
    def rows(self) -> Block:
        return self._rows[: self.count]

    @property
    def projected(self) -> Block:
        return self._projected[: self.count, : self.count]

    @property
    def room(self) -> int:
        """Rows that are still missing from a basis of the whole space."""
        return self._rows.shape[1] - self.count

    def append(self, block: Block) -> None:
        first, last = self.count, self.count + len(block)
        if last > len(self._rows):
            capacity = max(last, 3 * len(self._rows) // 2)
            rows, projected = np.empty((capacity, self._rows.shape[1])), np.zeros((capacity, capacity))
            rows[:first], projected[:first, :first] = self.rows, self.projected
            self._rows, self._projected = rows, projected
        self._rows[first:last] = block
        self.count = last

    def set_image(self, coefficients: Block) -> None:
        """Note what the last p rows become: coefficients (k, p) in the rows that there are."""
        p = coefficients.shape[1]
        self.projected[:, -p:] = coefficients
        self.projected[-p:] = coefficients.T


def lowest_eigenpairs(
    solve: Callable[[Block], Block], mass: csr_matrix, start: Block, count: int, tolerance: float
) -> tuple[NDArray[np.float64], Block]:
    """The `count` eigenvalues w^2 (m,) of smallest size, ascending, and their M-orthonormal shapes (m, n).

    solve: K^-1 for rows (p, n); start (p, n): a block that holds some of every mode, random numbers. The residual
    of each pair in K^-1 M, relative to its eigenvalue, is below the tolerance; the error of w^2 is its square.
    """
    size = mass.shape[0]
    basis = _Basis(size, min(size, 4 * count + 8 * len(start)))
    rng = np.random.default_rng(len(start))
    before: Block = np.zeros((0, size))
    block, weighted, _ = _orthonormal(mass, solve(_times(mass, start)), basis, before)
    look = min(2 * count, size)
    while True:
        basis.append(block)
        image, neighbours = solve(weighted), np.vstack([before, weighted])
        before = weighted
        block, weighted, (coefficients, rest) = _orthonormal(mass, image, basis, neighbours)
        basis.set_image(coefficients)
        exhausted = basis.count == size
        if exhausted or basis.count >= look:
            values, vectors, residuals = _ritz(basis, rest, count)
            if exhausted or np.all(residuals <= tolerance * np.abs(values)):
                order = np.argsort(1.0 / values)
                return 1.0 / values[order], vectors[:, order].T @ basis.rows
            look = int(_LOOK_AFTER * basis.count)
        if not len(block):  # an invariant subspace: what is not in it comes from another start
            before = before[:0]
            other = rng.standard_normal((min(len(start), size - basis.count), size))
            block, weighted, _ = _orthonormal(mass, other, basis, before)


def _ritz(basis: _Basis, rest: Block, count: int) -> tuple[NDArray[np.float64], Block, NDArray[np.float64]]:
    """The `count` largest eigenvalues 1/w^2 in the basis, their vectors (k, m) and the size of what they leave."""
    values, vectors = np.linalg.eigh(basis.projected)
    largest = np.argsort(-np.abs(values))[:count]
    values, vectors = values[largest], vectors[:, largest]
    return values, vectors, np.linalg.norm(rest @ vectors[basis.count - rest.shape[1] :], axis=0)


def _times(mass: csr_matrix, rows: Block) -> Block:
    """The rows times M."""
    return (mass @ np.ascontiguousarray(rows.T)).T


def _orthonormal(
    mass: csr_matrix, block: Block, basis: _Basis, neighbours: Block
) -> tuple[Block, Block, tuple[Block, Block]]:
    """A block (p, n) freed of the basis and M-orthonormal, (q, n), and its product with M; what it was made of.

    neighbours: the products with M of the last rows of the basis, where the block has most; in exact arithmetic an
    image has nothing in the rows before them. Made of: coefficients (k, p) in the basis, (q, p) in the result.
    Directions that lie in the basis are dropped. Twice is enough: the second pass mends the round-off of the first.
    """
    coefficients = np.zeros((basis.count, len(block)))
    first = basis.count - len(neighbours)
    coefficients[first:] = neighbours @ block.T
    block = block - coefficients[first:].T @ basis.rows[first:]
    taken, rest = np.sum(coefficients**2, axis=0), np.eye(len(block))
    for _ in range(2):
        weighted = _times(mass, block)
        drift = basis.rows @ weighted.T
        gram = block @ weighted.T
        scale, transform = _principal(gram - drift.T @ drift, np.diag(gram) + taken, basis.room)
        block = transform @ (block - drift.T @ basis.rows)
        coefficients += drift @ rest
        taken, rest = np.zeros(len(block)), scale @ rest
    clean = np.max(np.abs(drift), initial=0.0) < _CLEAN
    return block, transform @ weighted if clean else _times(mass, block), (coefficients, rest)


def _principal(gram: Block, whole: NDArray[np.float64], most: int) -> tuple[Block, Block]:
    """The map (q, p) of a block to M-orthonormal rows, by its Gram matrix (p, p), and what it is in terms of them.

    whole (p,): squared lengths before the block was freed of the basis; `most`: rows there may be.
    """
    lengths = np.sqrt(np.maximum(whole, np.finfo(float).tiny))
    squares, directions = np.linalg.eigh(0.5 * (gram + gram.T) / np.outer(lengths, lengths))
    kept = np.flatnonzero(squares > _DEPENDENT**2)[-most:] if most else np.zeros(0, dtype=int)
    roots, directions = np.sqrt(squares[kept]), directions[:, kept]
    return (roots * directions).T * lengths, (directions / roots).T / lengths
