"""Lowest modes of K phi = w^2 M phi by a block Lanczos process with K^-1 M (shift-invert at shift 0).

A block of solutions with a factor of K costs a fraction of as many single ones, which is what ARPACK asks for. The
basis is reorthogonalised in full, by classical Gram-Schmidt twice (CGS2), and blocks are orthonormalised by SVQB. So
no eigenvector appears twice; a multiple eigenvalue is found with its multiplicity, up to the width of the block.
Vectors are rows here: a block (p, n) is contiguous for the solver and for the products with the basis.

SVQB orthonormalises vectors by the eigenvectors of their Gram matrix. A mass acts alike on x, y and z: it is kept as
one number for each pair of nodes.

References
----------
R. G. Grimes, J. G. Lewis, H. D. Simon, A shifted block Lanczos algorithm for solving sparse symmetric generalized
eigenproblems, SIAM J. Matrix Anal. Appl. 15 (1994) 228-272.
A. Stathopoulos, K. Wu, A block orthogonalization procedure with constant synchronization requirements,
SIAM J. Sci. Comput. 23 (2002) 2165-2182.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rom.linear_algebra.threads import at_once, return_memory, shared

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

# Smallest eigenvalue of the scaled Gram matrix that is not round-off of the others.
_DEPENDENT = 1e-11
# Smallest length of a vector after others were taken out of it, over its length before.
_LOST = 1e-7
_PER_NODE = 3
Block = NDArray[Any]  # real or complex
_CLEAN = 1e-12  # part inside the basis below which a block's product with M is not formed again
_LITTLE = 1e-6  # part inside the basis that is taken out in one pass to round-off
_WELL = 1e-2  # smallest eigenvalue of a block's scaled Gram matrix with which one pass loses two digits at most
_CHECK_AFTER = 1.05  # growth of the basis between two checks of convergence


def svqb(
    gram: NDArray[Any], lengths: NDArray[np.float64], smallest: float, most: int | None = None
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Combinations of k vectors that are orthonormal, from their Gram matrix G.

    With D = diag(lengths) and D^-1 G D^-1 = V S V^H the combinations are X = D^-1 V S^-1/2: X^H G X = I. Linearly
    dependent directions are dropped.
    Shapes: `gram` (k, k), `lengths` (k,), returns `combinations` (k, r), `components` (r, k).
    """
    squares, directions = np.linalg.eigh(0.5 * (gram + gram.conj().T) / np.outer(lengths, lengths))
    chosen = np.flatnonzero(squares > smallest)
    if most is not None:
        chosen = chosen[len(chosen) - min(most, len(chosen)) :]
    roots, directions = np.sqrt(squares[chosen]), directions[:, chosen]
    return (directions / roots) / lengths[:, None], (roots * directions).conj().T * lengths


def orthonormal_combinations(gram: NDArray[Any], before: NDArray[np.float64] | None = None) -> NDArray[Any]:
    """Combinations (k, r), r <= k, of k vectors with Gram matrix (k, k), real or Hermitian, that are orthonormal.

    before (k,): squared lengths of the vectors before they were made orthogonal to others. A vector of which next to
    nothing is left is round-off; it is left out.
    """
    squared = np.maximum(np.diag(gram).real, 0.0)
    used = squared > (0.0 if before is None else _LOST**2 * before)
    found, _ = svqb(gram[np.ix_(used, used)], np.sqrt(squared[used]), _DEPENDENT)
    combinations = np.zeros((len(gram), found.shape[1]), found.dtype)
    combinations[used] = found
    return combinations


@dataclass(frozen=True)
class IsotropicMatrix:
    """Matrix A (3n, 3n) of n nodes whose block for a pair of nodes is a number times the identity.

    A product with k columns is that of the numbers with 3k columns: a third of the entries is read.
    """

    pairs: csr_matrix  # (n, n), the number of each pair

    @classmethod
    def of(cls, matrix: csr_matrix) -> IsotropicMatrix:
        """From the matrix (3n, 3n) itself, of which only the x components are read."""
        return cls(matrix[::_PER_NODE][:, ::_PER_NODE].tocsr())

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, (3n, 3n)."""
        rows, columns = self.pairs.shape
        return _PER_NODE * rows, _PER_NODE * columns

    def __matmul__(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """A x for x (3n,) or (3n, k), node-major x, y, z."""
        rows, inner = self.pairs.shape
        together = np.ascontiguousarray(columns).reshape(inner, columns.size // max(inner, 1))
        product = np.empty((rows, together.shape[1]))

        def multiply(part: slice) -> None:
            product[part] = self._rows(part) @ together

        at_once(multiply, [slice(s.start // _PER_NODE, s.stop // _PER_NODE) for s in shared(_PER_NODE * rows)])
        return product.reshape(_PER_NODE * rows, *columns.shape[1:])

    def _rows(self, part: slice) -> csr_matrix:
        """Some rows of the pairs, not copied."""
        from scipy.sparse import csr_matrix

        pairs, starts = self.pairs, self.pairs.indptr[part.start : part.stop + 1]
        place = slice(starts[0], starts[-1])
        shape = part.stop - part.start, pairs.shape[1]
        return csr_matrix((pairs.data[place], pairs.indices[place], starts - starts[0]), shape=shape)


class Mass(Protocol):
    """A Hermitian matrix (n, n) that multiplies columns (n, k)."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns."""

    def __matmul__(self, columns: Any) -> Any:
        """The product."""


class _Basis:
    """M-orthonormal rows (k, n) and the projection of K^-1 M on them, (k, k)."""

    def __init__(self, size: int, capacity: int, kind: np.dtype[Any]) -> None:
        self._rows, self._projected = np.empty((capacity, size), kind), np.zeros((capacity, capacity), kind)
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
            kind = self._rows.dtype
            rows, projected = np.empty((capacity, self._rows.shape[1]), kind), np.zeros((capacity, capacity), kind)
            rows[:first], projected[:first, :first] = self.rows, self.projected
            self._rows, self._projected = rows, projected
        self._rows[first:last] = block
        self.count = last

    def set_image(self, coefficients: Block) -> None:
        """Store the image of the last p rows: coefficients (k, p) in the rows of the basis."""
        p = coefficients.shape[1]
        self.projected[:, -p:] = coefficients
        self.projected[-p:] = coefficients.conj().T


def lowest_eigenpairs(
    solve: Callable[[Block], Block], mass: Mass, start: Block, count: int, tolerance: float
) -> tuple[NDArray[np.float64], Block]:
    """The `count` eigenvalues w^2 (m,) of smallest modulus, ascending, and their M-orthonormal shapes (m, n).

    Shapes: `mass` (n, n), `start` (p, n).
    """
    size = mass.shape[0]
    basis = _Basis(size, min(size, 4 * count + 8 * len(start)), start.dtype)
    rng = np.random.default_rng(len(start))
    before: Block = np.zeros((0, size), start.dtype)
    block, weighted, _ = _orthonormal(mass, solve(_times(mass, start)), basis, before)
    check = min(2 * count, size)
    while True:
        basis.append(block)
        image, neighbours = solve(weighted), np.vstack([before, weighted])
        before = weighted
        block, weighted, (coefficients, off_diagonal) = _orthonormal(mass, image, basis, neighbours)
        basis.set_image(coefficients)
        exhausted = basis.count == size
        if exhausted or basis.count >= check:
            values, vectors, residuals = _ritz(basis, off_diagonal, count)
            if exhausted or np.all(residuals <= tolerance * np.abs(values)):
                order = np.argsort(1.0 / values)
                return_memory()
                return 1.0 / values[order], vectors[:, order].T @ basis.rows
            check = int(_CHECK_AFTER * basis.count)
        if not len(block):  # an invariant subspace: go on with another start block outside it
            before = before[:0]
            other = rng.standard_normal((min(len(start), size - basis.count), size)).astype(start.dtype)
            block, weighted, _ = _orthonormal(mass, other, basis, before)
            if not len(block):  # the mass is singular: there are no further modes
                values, vectors, _ = _ritz(basis, off_diagonal, count)
                order = np.argsort(1.0 / values)
                return 1.0 / values[order], vectors[:, order].T @ basis.rows


def _ritz(basis: _Basis, off_diagonal: Block, count: int) -> tuple[NDArray[np.float64], Block, NDArray[np.float64]]:
    """The `count` largest Ritz values 1/w^2, their vectors (k, m) in the basis and their residuals (m,)."""
    values, vectors = np.linalg.eigh(basis.projected)
    largest = np.argsort(-np.abs(values))[:count]
    values, vectors = values[largest], vectors[:, largest]
    return values, vectors, np.linalg.norm(off_diagonal @ vectors[basis.count - off_diagonal.shape[1] :], axis=0)


def _times(mass: Mass, rows: Block) -> Block:
    """The rows times M."""
    return (mass @ np.ascontiguousarray(rows.T)).T


def _orthonormal(
    mass: Mass, block: Block, basis: _Basis, neighbours: Block
) -> tuple[Block, Block, tuple[Block, Block]]:
    """Orthonormalise a block (p, n) in M against the basis and in itself.

    Returns the new block (q, n), its product with M, and the coefficients of the given block in the basis, (k, p),
    and in the new block, (q, p). Directions that lie in the basis are dropped. `neighbours` are the products with M
    of the last rows of the basis; in exact arithmetic an image has no part in the rows before them. Two passes are
    enough: the second removes the round-off of the first. One is where it takes next to nothing out of a block whose
    rows are well independent: little round-off is magnified.
    """
    coefficients = np.zeros((basis.count, len(block)), block.dtype)
    first = basis.count - len(neighbours)
    coefficients[first:] = (neighbours @ block.conj().T).conj()
    block = block - coefficients[first:].T @ basis.rows[first:]
    taken, off_diagonal = np.sum(np.abs(coefficients) ** 2, axis=0), np.eye(len(block))
    for _ in range(2):
        weighted = _times(mass, block)
        drift, gram = _products(basis.rows, weighted), (block @ weighted.conj().T).conj()
        lengths = np.sqrt(np.maximum(np.diag(gram).real + taken, np.finfo(float).tiny))
        columns, scale = svqb(gram - drift.conj().T @ drift, lengths, _DEPENDENT**2, basis.room)
        transform = columns.T
        part = np.max(np.abs(drift) / lengths, initial=0.0)
        well = len(scale) == len(block) and np.min(np.linalg.norm(scale / lengths, axis=1), initial=1.0) ** 2 > _WELL
        block = _without(block, drift, basis.rows, transform)
        coefficients += drift @ off_diagonal
        taken, off_diagonal = np.zeros(len(block)), scale @ off_diagonal
        if well and part < _LITTLE:
            break
    return block, transform @ weighted if part < _CLEAN else _times(mass, block), (coefficients, off_diagonal)


def _products(rows: Block, others: Block) -> Block:
    """Scalar products (k, p) of rows (k, n), conjugated, with others (p, n)."""
    adjoint = others.conj()
    found = at_once(lambda part: rows[:, part] @ adjoint[:, part].T, shared(rows.shape[1]))
    return np.conj(found[0] if len(found) == 1 else found[0] + found[1])


def _without(block: Block, drift: Block, rows: Block, transform: Block) -> Block:
    """Combinations (q, p) of a block (p, n) less its parts (k, p) along rows (k, n)."""
    found = np.empty((len(transform), block.shape[1]), block.dtype)

    def subtract(part: slice) -> None:
        found[:, part] = transform @ (block[:, part] - drift.T @ rows[:, part])

    at_once(subtract, shared(block.shape[1]))
    return found
