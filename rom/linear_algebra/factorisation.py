"""Sparse factorisation of symmetric or Hermitian positive definite matrices.

CHOLMOD where it is installed, inside the cvxopt wheel; SuperLU otherwise. Both give
the same solutions to round-off.

References
----------
Y. Chen, T. A. Davis, W. W. Hager, S. Rajamanickam, Algorithm 887: CHOLMOD, supernodal sparse Cholesky factorization
and update/downdate, ACM Trans. Math. Softw. 35 (2008) 22.
X. S. Li, An overview of SuperLU: algorithms, implementation, and user interface, ACM Trans. Math. Softw. 31 (2005)
302-325.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rom.errors import FactorisationError
from rom.linear_algebra.cholmod import CholmodFactor, bears_threads, library
from rom.linear_algebra.ordering import BISECT_FROM, bisection, nested_dissection
from rom.linear_algebra.two_halves import TwoHalves

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix, csr_matrix

BACKENDS = ("auto", "cholmod", "superlu")

NOT_DEFINITE = (
    "the stiffness matrix is not positive definite: the body is not held, an element is degenerate or, "
    "with rotation, the speed is beyond its stability limit"
)


class Factor(Protocol):
    """A factorised symmetric, or Hermitian, positive definite matrix A.

    Examples
    --------
    >>> from rom import factorise
    >>> from scipy.sparse import csr_matrix
    >>> factor = factorise(csr_matrix(np.diag([2.0, 4.0])), backend="superlu")
    >>> factor.backend, factor.solve(np.array([2.0, 2.0])).tolist()
    ('superlu', [1.0, 0.5])
    """

    @property
    def backend(self) -> str:
        """Name of the library: "cholmod" or "superlu"."""

    @property
    def block(self) -> int:
        """Number of right-hand sides for which a solution is most efficient, for methods that may choose it."""

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """Solve A x = rhs.

        Parameters
        ----------
        rhs : (n,) or (n, k) array
            One or more right-hand sides; not changed.

        Returns
        -------
        (n,) or (n, k) array
            The solutions.
        """


class Analysis(Protocol):
    """An analysed matrix, ready to be factorised: the matrix itself may be freed, which saves memory."""

    def factor(self) -> Factor:
        """Compute the factor; called once a matrix. Raises FactorisationError for a singular or indefinite matrix."""

    def load(self, matrix: csr_matrix) -> None:
        """Take another matrix with the same pattern, zeros stored alike. The last factor is no longer valid."""


def factorise(matrix: csr_matrix, backend: str = "auto") -> Factor:
    """Factorise a symmetric, or complex Hermitian, positive definite sparse matrix.

    Parameters
    ----------
    matrix : (n, n) CSR matrix
        The matrix.
    backend : {"auto", "cholmod", "superlu"}
        The library; "auto" takes the first that is installed.

    Returns
    -------
    Factor
        The factor.

    Raises
    ------
    FactorisationError
        The matrix is singular or indefinite; SuperLU detects only exact singularity.
    ValueError
        The backend is unknown or not installed.

    Examples
    --------
    >>> from rom import factorise
    >>> from scipy.sparse import csr_matrix
    >>> stiffness = csr_matrix(np.array([[2.0, -1.0], [-1.0, 1.0]]))  # two springs of 1 N/m in series
    >>> print(factorise(stiffness).solve(np.array([0.0, 1.0])).round(12))
    [1. 2.]
    """
    return analyse(matrix, backend).factor()


def analyse(matrix: csr_matrix, backend: str = "auto") -> Analysis:
    """Symbolic part of `factorise`, with the same arguments: order the unknowns, copy what is needed."""
    if backend not in BACKENDS:
        raise ValueError(f"backend = {backend!r}: must be one of {', '.join(BACKENDS)}")
    installed = library() is not None
    if backend == "cholmod" and not installed:
        raise ValueError("backend = 'cholmod': needs the package cvxopt (pip install 'shroud[cholmod]')")
    return _SuperluAnalysis(matrix) if backend == "superlu" or not installed else _CholmodAnalysis(matrix)


class _CholmodAnalysis:
    """Cut in two halves where that pays, otherwise by nested dissection or minimum degree, whichever is better."""

    def __init__(self, matrix: csr_matrix) -> None:
        self._analysed = _cut_in_two(matrix) or CholmodFactor(matrix, nested_dissection(matrix))

    def factor(self) -> Factor:
        """See Analysis."""
        if not self._analysed.factorise():
            raise FactorisationError(NOT_DEFINITE)
        return _Cholmod(self._analysed)

    def load(self, matrix: csr_matrix) -> None:
        """See Analysis."""
        self._analysed.load(matrix)


def _cut_in_two(matrix: csr_matrix) -> TwoHalves | None:
    """The matrix analysed in two halves; None where that does not pay or is not possible."""
    worth = matrix.shape[0] >= BISECT_FROM and np.isrealobj(matrix.data) and bears_threads()
    cut = bisection(matrix) if worth else None
    if cut is None:
        return None
    try:
        return TwoHalves(matrix, cut)
    except ValueError:
        return None


class _Cholmod:
    """Supernodal Cholesky factor."""

    backend = "cholmod"
    block = 8

    def __init__(self, factor: CholmodFactor | TwoHalves) -> None:
        self._factor = factor

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """See Factor."""
        columns = np.asarray(rhs).T
        return self._factor.solve(np.atleast_2d(columns)).reshape(columns.shape).T


class _SuperluAnalysis:
    """The matrix by columns, the format of SuperLU."""

    def __init__(self, matrix: csr_matrix) -> None:
        self._matrix = matrix.tocsc()

    def factor(self) -> Factor:
        """See Analysis."""
        return _Superlu(self._matrix)

    def load(self, matrix: csr_matrix) -> None:
        """See Analysis."""
        self._matrix = matrix.tocsc()


class _Superlu:
    """SciPy's LU factors with a symmetric ordering and pivots on the diagonal."""

    backend = "superlu"
    block = 2

    def __init__(self, matrix: csc_matrix) -> None:
        from scipy.sparse.linalg import splu

        self._type = matrix.dtype
        try:
            self._factor = splu(
                matrix,
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError:
            raise FactorisationError(NOT_DEFINITE) from None

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """See Factor."""
        rhs = np.asarray(rhs, dtype=self._type)
        if rhs.ndim == 1:
            return self._factor.solve(rhs)
        # One at a time: SuperLU slows down several-fold with many columns at once.
        return np.column_stack([self._factor.solve(column) for column in rhs.T])
