"""Sparse factorisation of symmetric or Hermitian positive definite matrices.

CHOLMOD where it is installed, inside the cvxopt wheel; SuperLU otherwise. Both give the same solutions to round-off.
The unknowns of a large mesh are ordered by nested dissection (METIS).

A large matrix is cut in two halves, each factorised and solved with in a thread of its own. A few unknowns s separate
the others into two sets that are not coupled. Each half, factorised together with them, has a Schur complement S_h
(`SchurComplement`); that of the whole matrix is S = S_1 + S_2 - A_ss. A right-hand side goes down both halves,
through S and up again. The steps are the same on one core, and so is every bit.

References
----------
Y. Chen, T. A. Davis, W. W. Hager, S. Rajamanickam, Algorithm 887: CHOLMOD, supernodal sparse Cholesky factorization
and update/downdate, ACM Trans. Math. Softw. 35 (2008) 22.
X. S. Li, An overview of SuperLU: algorithms, implementation, and user interface, ACM Trans. Math. Softw. 31 (2005)
302-325.
G. Karypis, V. Kumar, A fast and high quality multilevel scheme for partitioning irregular graphs,
SIAM J. Sci. Comput. 20 (1998) 359-392.
J. S. Przemieniecki, Matrix structural analysis of substructures, AIAA Journal 1 (1963) 138-147.
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rom.errors import FactorisationError
from rom.linear_algebra.cholmod import CholmodFactor, bears_threads, columns_at_once, library
from rom.linear_algebra.schur_complement import SchurComplement
from rom.linear_algebra.threads import SHARED_FROM, at_once, return_memory

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix, csr_matrix

# Below this size minimum degree is as good and METIS takes longer than it saves (docs/developers/dependencies.md).
DISSECT_FROM = 60_000
BISECT_FROM = SHARED_FROM
_PER_NODE = 3  # unknowns, ordered node by node
Array = NDArray[np.float64]
BACKENDS = ("auto", "cholmod", "superlu")
NOT_DEFINITE = (
    "the stiffness matrix is not positive definite: the body is not held, an element is degenerate or, "
    "with rotation, the speed is beyond its stability limit"
)


@dataclass(frozen=True)
class Bisection:
    """A separator that cuts the unknowns of a symmetric matrix into two halves without couplings."""

    # (a,), unknowns of each half, in an order of elimination by nested dissection
    halves: tuple[NDArray[np.int64], NDArray[np.int64]]
    separator: NDArray[np.int64]  # (s,), the other unknowns, ascending


def nested_dissection(matrix: csr_matrix, from_size: int | None = None) -> NDArray[np.int64] | None:
    """Elimination order (n,) of the unknowns of a symmetric matrix; None where METIS does not pay.

    There are three unknowns for each node; the nodes are ordered, and their unknowns with them. None for a matrix of
    fewer than `from_size` unknowns (by default `DISSECT_FROM`), for a number of unknowns that is not a multiple of
    three, and where pymetis is missing.
    """
    if matrix.shape[0] < (DISSECT_FROM if from_size is None else from_size) or not _can_dissect(matrix):
        return None
    return _unknowns(_dissected(*_node_graph(matrix)))


def bisection(matrix: csr_matrix) -> Bisection | None:
    """A cut of the unknowns of a symmetric matrix into halves of like size; None as in `nested_dissection`.

    METIS cuts the graph of the nodes with few edges between both parts. The separator are the nodes of one part that
    have neighbours in the other, of the part that has fewer of them. None too where a half is empty.
    """
    if matrix.shape[0] < BISECT_FROM or not _can_dissect(matrix):
        return None
    import pymetis

    starts, neighbours = _node_graph(matrix)
    _, part = pymetis.part_graph(2, pymetis.CSRAdjacency(starts, neighbours))
    side = np.asarray(part)
    node = np.repeat(np.arange(len(side)), np.diff(starts))
    crossing = node[side[node] != side[neighbours]]
    edges = [np.unique(crossing[side[crossing] == k]) for k in (0, 1)]
    separator = min(edges, key=len)
    side[separator] = 2
    halves = [np.flatnonzero(side == k) for k in (0, 1)]
    if not all(map(len, (separator, *halves))):
        return None
    first, second = (_unknowns(half[_dissected(*_part_of_graph(starts, neighbours, half))]) for half in halves)
    return Bisection((first, second), _unknowns(separator))


def _can_dissect(matrix: csr_matrix) -> bool:
    """Whether there are three unknowns for each node, and the package that dissects."""
    return matrix.shape[0] % _PER_NODE == 0 and importlib.util.find_spec("pymetis") is not None


def _unknowns(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Unknowns of nodes, in their order."""
    return (_PER_NODE * nodes[:, None] + np.arange(_PER_NODE)).ravel()


def _dissected(starts: NDArray[np.int32], neighbours: NDArray[np.int32]) -> NDArray[np.int64]:
    """Order of the nodes of a graph in compressed form by nested dissection."""
    import pymetis

    order, _ = pymetis.nested_dissection(pymetis.CSRAdjacency(starts, neighbours))
    return np.asarray(order, dtype=np.int64)


def _part_of_graph(
    starts: NDArray[np.int32], neighbours: NDArray[np.int32], nodes: NDArray[np.int64]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The graph of some nodes (k,) alone, numbered in their order."""
    from scipy.sparse import csr_matrix

    count = len(starts) - 1
    graph = csr_matrix((np.ones(len(neighbours), np.int8), neighbours, starts), shape=(count, count))
    part = graph[nodes][:, nodes]
    return part.indptr.astype(np.int32), part.indices.astype(np.int32)


def _node_graph(matrix: csr_matrix) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Adjacency of the nodes in compressed form: where the list of each node starts (n + 1,), and all lists."""
    from scipy.sparse import csr_matrix

    entries = np.ones(matrix.nnz, dtype=np.int8)
    pattern = csr_matrix((entries, matrix.indices, matrix.indptr), shape=matrix.shape)
    blocks = pattern.tobsr(blocksize=(_PER_NODE, _PER_NODE))
    count = matrix.shape[0] // _PER_NODE
    nodes = np.repeat(np.arange(count, dtype=np.int32), np.diff(blocks.indptr))
    others = blocks.indices != nodes
    starts = np.concatenate([[0], np.cumsum(np.bincount(nodes[others], minlength=count))])
    return starts.astype(np.int32), blocks.indices[others].astype(np.int32)


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


class Factor(Protocol):
    """A factorised symmetric, or Hermitian, positive definite matrix A."""

    @property
    def backend(self) -> str:
        """Name of the library: "cholmod" or "superlu"."""

    @property
    def block(self) -> int:
        """Number of right-hand sides for which a solution is most efficient, for methods that may choose it."""

    def solve(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """Solve A x = rhs. `rhs` (n, k): one or more right-hand sides; not changed. Returns (n, k): the solutions."""


class Analysis(Protocol):
    """An analysed matrix, ready to be factorised: the matrix itself may be freed, which saves memory."""

    def factor(self) -> Factor:
        """Compute the factor; called once a matrix. Raises FactorisationError for a singular or indefinite matrix."""

    def load(self, matrix: csr_matrix) -> None:
        """Take another matrix with the same pattern, zeros stored alike. The last factor is no longer valid."""


def factorise(matrix: csr_matrix, backend: str = "auto") -> Factor:
    """Factorise a symmetric, or complex Hermitian, positive definite sparse matrix."""
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
