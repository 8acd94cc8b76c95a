"""Sparse factorisation of symmetric positive definite matrices.

CHOLMOD where its wheel is installed, tuned SuperLU otherwise. CHOLMOD comes inside the cvxopt wheel
(docs/dependencies.md says why). Both give the same solutions to round-off.
"""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rom.cholmod_dense import COLUMNS, dense_solver
from rom.errors import FactorisationError

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

BACKENDS = ("auto", "cholmod", "superlu")

# Sparse right-hand sides given to CHOLMOD at once, where its door for dense ones is shut; bounds the copies.
_SPARSE_COLUMNS = 32
_NOT_DEFINITE = (
    "the stiffness matrix is not positive definite: the body is not held, an element is degenerate or, "
    "with rotation, the speed is beyond its stability limit"
)


class Factor(Protocol):
    """A factorised matrix A; `backend` names what did it."""

    @property
    def backend(self) -> str:
        """Name of the library that holds the factor."""

    @property
    def block(self) -> int:
        """Right-hand sides that a process which may choose does best to bring at once."""

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """A^-1 rhs for one (n,) or many (n, k) right-hand sides; rhs is left as it is."""


def factorise(matrix: csr_matrix, backend: str = "auto") -> Factor:
    """Factorise a symmetric positive definite sparse matrix (n, n).

    backend: "cholmod", "superlu", or "auto" for the first that is installed. Raises FactorisationError when
    the matrix is singular or indefinite (SuperLU notices only exact singularity), ValueError for an unknown or
    missing backend.
    """
    if backend not in BACKENDS:
        raise ValueError(f"backend = {backend!r}: must be one of {', '.join(BACKENDS)}")
    installed = importlib.util.find_spec("cvxopt") is not None
    if backend == "cholmod" and not installed:
        raise ValueError("backend = 'cholmod': needs the package cvxopt (pip install 'shroud[cholmod]')")
    chosen = _Superlu if backend == "superlu" or not installed else _Cholmod
    return chosen(matrix)


class _Cholmod:
    """Supernodal Cholesky factor with an approximate minimum degree ordering."""

    backend = "cholmod"
    block = 8

    def __init__(self, matrix: csr_matrix) -> None:
        import cvxopt
        from cvxopt import cholmod

        lower = _lower_triangle(matrix)
        self._library, self._cholmod = cvxopt, cholmod
        self._factor: Any = cholmod.symbolic(lower)
        try:
            cholmod.numeric(lower, self._factor)
        except ArithmeticError:
            raise FactorisationError(_NOT_DEFINITE) from None
        self._dense = dense_solver(cholmod.__file__, self._factor)

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """See Factor."""
        rhs = np.asarray(rhs, dtype=float)
        columns = np.atleast_2d(rhs.T)
        solution = np.empty(columns.shape)
        many = COLUMNS if self._dense is not None else _SPARSE_COLUMNS
        for first in range(0, len(columns), many):
            part = slice(first, first + many)
            solution[part] = self._solve_rows(columns[part])
        return solution.reshape(rhs.T.shape).T

    def _solve_rows(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solutions (k, n) of right-hand sides (k, n)."""
        if self._dense is not None:
            return self._dense.solve(rows)
        # The door for sparse right-hand sides takes several columns at once, the dense one each by itself.
        block = self._library.sparse(self._library.matrix(np.ascontiguousarray(rows.T)))
        return np.array(self._library.matrix(self._cholmod.spsolve(self._factor, block))).T


def _lower_triangle(matrix: csr_matrix) -> Any:
    """The lower triangle for CHOLMOD; what is needed on the way is gone before the factor comes, which is large."""
    import cvxopt
    from scipy.sparse import triu

    # The upper triangle by rows is the lower triangle by columns, which is what CHOLMOD reads.
    upper = triu(matrix, format="coo")
    rows, columns = cvxopt.matrix(upper.col.astype(np.int64)), cvxopt.matrix(upper.row.astype(np.int64))
    return cvxopt.spmatrix(cvxopt.matrix(upper.data), rows, columns, matrix.shape)


class _Superlu:
    """LU factors of SciPy with a symmetric ordering and pivots kept on the diagonal."""

    backend = "superlu"
    block = 2

    def __init__(self, matrix: csr_matrix) -> None:
        from scipy.sparse.linalg import splu

        try:
            self._factor = splu(
                matrix.tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError:
            raise FactorisationError(_NOT_DEFINITE) from None

    def solve(self, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        """See Factor."""
        rhs = np.asarray(rhs, dtype=float)
        if rhs.ndim == 1:
            return self._factor.solve(rhs)
        # One at a time: SuperLU slows down several-fold with many columns at once.
        return np.column_stack([self._factor.solve(column) for column in rhs.T])
