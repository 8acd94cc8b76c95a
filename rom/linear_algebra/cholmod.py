"""CHOLMOD, called directly in the library inside the cvxopt wheel.

The interface of cvxopt copies a matrix twice and solves a dense block column by column; each column reads the whole
factor from memory. CHOLMOD itself takes the arrays of SciPy as they are and any number of columns at once: from eight
on it is bound by arithmetic, a third to a sixth of the time for each column.

References
----------
Y. Chen, T. A. Davis, W. W. Hager, S. Rajamanickam, Algorithm 887: CHOLMOD, supernodal sparse Cholesky factorization
and update/downdate, ACM Trans. Math. Softw. 35 (2008) 22.
"""

from __future__ import annotations

import ctypes
import functools
import importlib
import weakref
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.linear_algebra.blas_kernels import best_kernels, holds_locks

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

COLUMNS = 16  # right-hand sides at once: more are no faster and take memory
MANY, MORE_COLUMNS = 256, 64  # of so many right-hand sides more at once: a third less time, little memory beside them
_SLAB = 200_000  # entries of a matrix
_VERSION = 3  # version of CHOLMOD whose structures are described here
_LONG, _REAL, _COMPLEX, _DOUBLE, _UPPER, _NATURAL, _ALWAYS = 2, 1, 2, 0, 1, 0, 2
_SOLVE_A, _SOLVE_L, _SOLVE_LT = 0, 4, 5  # A x = b; L x = b and L^T x = b in the order of elimination
_FUNCTIONS = ("start", "finish", "analyze_p", "ptranspose", "factorize", "solve2")
_RELEASES = ("free_sparse", "free_factor", "free_dense")


class _Common(ctypes.Structure):
    """The head of cholmod_common: settings; the rest is internal to CHOLMOD."""

    _fields_ = (
        ("limits", ctypes.c_double * 3),
        ("sizes", ctypes.c_size_t * 2),
        ("supernodal_switch", ctypes.c_double),
        ("supernodal", ctypes.c_int),
        ("final", ctypes.c_int * 6),
        ("zrelax", ctypes.c_double * 3),
        ("nrelax", ctypes.c_size_t * 3),
        ("prefer", ctypes.c_int * 4),
        ("print", ctypes.c_int),
        ("precise", ctypes.c_int),
        ("try_catch", ctypes.c_int),
        ("error_handler", ctypes.c_void_p),
        ("nmethods", ctypes.c_int),
        ("rest", ctypes.c_char * (1 << 16)),  # CHOLMOD uses some 3000 bytes
    )


class _Sparse(ctypes.Structure):
    """cholmod_sparse: a matrix in compressed columns."""

    _fields_ = (
        *((name, ctypes.c_size_t) for name in ("nrow", "ncol", "nzmax")),
        *((name, ctypes.c_void_p) for name in ("p", "i", "nz", "x", "z")),
        *((name, ctypes.c_int) for name in ("stype", "itype", "xtype", "dtype", "sorted", "packed")),
    )


class _Dense(ctypes.Structure):
    """cholmod_dense: a column-major matrix."""

    _fields_ = (
        *((name, ctypes.c_size_t) for name in ("nrow", "ncol", "nzmax", "d")),
        *((name, ctypes.c_void_p) for name in ("x", "z")),
        *((name, ctypes.c_int) for name in ("xtype", "dtype")),
    )


class _Factor(ctypes.Structure):
    """cholmod_factor; `minor` is the first column that was not positive definite, n for none."""

    _fields_ = (
        *((name, ctypes.c_size_t) for name in ("n", "minor")),
        *((name, ctypes.c_void_p) for name in ("perm", "col_count", "inverse_perm")),
        ("nzmax", ctypes.c_size_t),
        *((name, ctypes.c_void_p) for name in ("p", "i", "x", "z", "nz", "next", "prev")),
        *((name, ctypes.c_size_t) for name in ("nsuper", "ssize", "xsize", "maxcsize", "maxesize")),
        *((name, ctypes.c_void_p) for name in ("super", "pi", "px", "s")),
        *((name, ctypes.c_int) for name in ("ordering", "is_ll", "is_super", "is_monotonic", "itype", "xtype")),
    )


_COMMON_DEFAULTS = {"supernodal_switch": 40.0, "supernodal": 1, "print": 3, "nmethods": 0}
_FACTOR_OF_TWO = {"n": 2, "minor": 2, "nsuper": 1, "xsize": 4, "is_ll": 1, "is_super": 1, "itype": _LONG, "xtype": 0}


class CholmodFactor:
    """Supernodal Cholesky factor of a symmetric or Hermitian positive definite matrix (n, n), both triangles stored.

    The constructor analyses the matrix and copies a triangle of it; `factorise` computes the factor. CHOLMOD tries
    the elimination `order` (n,) and minimum degree, and takes the better one.

    With a `part` (n,), some unknowns of the matrix, ascending, the factor is that of their rows and columns, in the
    order given but for unknowns that do not depend on each other.
    """

    def __init__(
        self, matrix: csr_matrix, order: NDArray[np.int64] | None = None, part: NDArray[np.int64] | None = None
    ) -> None:
        found = library()
        if found is None:
            raise ValueError("this cvxopt has no CHOLMOD that is known here")
        self._library, self._common, self._part = found, _started(found), part
        triangle, _arrays = _upper_triangle(matrix, part)
        self._entries, self._type = triangle.nzmax, matrix.dtype
        self._common.nmethods = int(part is not None)  # the first of the methods is the given order
        common = ctypes.byref(self._common)
        given = None if order is None else np.ascontiguousarray(order, dtype=np.int64)
        place = None if given is None else given.ctypes.data
        self._address = ctypes.c_void_p(found.cholmod_l_analyze_p(ctypes.byref(triangle), place, None, 0, common))
        if not self._address:
            raise MemoryError(f"CHOLMOD has no memory to analyse a matrix of {matrix.shape[0]} unknowns")
        self._factor = ctypes.cast(self._address, ctypes.POINTER(_Factor)).contents
        self._idle: list[_Workspace] = []
        self._ordered = ctypes.c_void_p()
        weakref.finalize(self, _free, found, self._common, self._address, self._ordered)
        self._order(triangle)

    def load(self, matrix: csr_matrix) -> None:
        """Take another matrix with the same pattern; `factorise` then computes its factor in the place of the last.

        Raises ValueError for another number of entries.
        """
        triangle, _arrays = _upper_triangle(matrix, self._part)
        if triangle.nzmax != self._entries:
            raise ValueError(f"{triangle.nzmax} entries in a triangle, {self._entries} were analysed")
        self._order(triangle)

    def _order(self, triangle: _Sparse) -> None:
        """Copy the lower triangle in the new order, on which CHOLMOD works: the given one need not stay in memory."""
        common = ctypes.byref(self._common)
        self._library.cholmod_l_free_sparse(ctypes.byref(self._ordered), common)
        self._ordered.value = self._library.cholmod_l_ptranspose(
            ctypes.byref(triangle), 2, self._factor.perm, None, 0, common
        )
        if not self._ordered:
            raise MemoryError(f"CHOLMOD has no memory to order a matrix of {self._factor.n} unknowns")

    def factorise(self) -> bool:
        """Compute the factor and free the triangle; False where the matrix is not positive definite."""
        common = ctypes.byref(self._common)
        ordering, self._factor.ordering = self._factor.ordering, _NATURAL  # the triangle is in order already
        done = self._library.cholmod_l_factorize(self._ordered, self._address, common)
        self._factor.ordering = ordering
        self._library.cholmod_l_free_sparse(ctypes.byref(self._ordered), common)
        if not done:
            raise MemoryError(f"CHOLMOD has no memory for the factor of {self._factor.n} unknowns")
        return bool(self._factor.minor == self._factor.n)

    @property
    def order(self) -> NDArray[np.int64]:
        """Order of elimination (n,) of the unknowns."""
        return _view(self._factor.perm, self._factor.n, ctypes.c_int64).copy()

    def last_block(self, count: int) -> NDArray[np.float64]:
        """Lower triangle (count, count) of the factor for the unknowns eliminated last."""
        factor, first = self._factor, self._factor.n - count
        columns, rows, values = (
            _view(place, factor.nsuper + 1, ctypes.c_int64) for place in (factor.super, factor.pi, factor.px)
        )
        block = np.zeros((count, count))
        for k in range(int(np.searchsorted(columns, first, side="right")) - 1, factor.nsuper):
            row = _view(factor.s, factor.ssize, ctypes.c_int64)[rows[k] : rows[k + 1]]
            panel = _view(factor.x, factor.xsize, ctypes.c_double)[values[k] : values[k + 1]]
            dropped = max(first - columns[k], 0)  # a supernode may begin before
            found = panel.reshape(-1, len(row))[dropped:, dropped:].T
            block[np.ix_(row[dropped:] - first, np.arange(columns[k] + dropped, columns[k + 1]) - first)] = found
        return np.tril(block)

    def solve(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Solutions (k, n) of A x = b for k right-hand sides, stored as rows; complex ones of a Hermitian matrix.

        Several threads may ask for them at once, if CHOLMOD `bears_threads`.
        """
        rows = np.ascontiguousarray(rows, dtype=self._type)
        solution = np.empty_like(rows)
        self._solve(rows, solution, _SOLVE_A)
        return solution

    def solve_lower(self, rows: NDArray[np.float64]) -> None:
        """Replace contiguous rows b (k, n) by the solutions of L x = b, unknowns in the order of elimination."""
        self._solve(rows, rows, _SOLVE_L)

    def solve_upper(self, rows: NDArray[np.float64]) -> None:
        """Replace contiguous rows b (k, n) by the solutions of L^T x = b, unknowns in the order of elimination."""
        self._solve(rows, rows, _SOLVE_LT)

    def _solve(self, rows: NDArray[Any], solution: NDArray[Any], system: int) -> None:
        workspace = self._idle.pop() if self._idle else _Workspace(self._library)
        step = columns_at_once(len(rows))
        for first in range(0, len(rows), step):
            part = slice(first, first + step)
            self._solve_at_once(rows[part], solution[part], system, workspace)
        self._idle.append(workspace)

    def _solve_at_once(self, rows: NDArray[Any], solution: NDArray[Any], system: int, workspace: _Workspace) -> None:
        k, n = rows.shape
        block = _Dense(n, k, rows.size, n, rows.ctypes.data, None, _kind(rows), _DOUBLE)
        x, y, e = (ctypes.byref(room) for room in workspace.room)
        done = self._library.cholmod_l_solve2(
            system, self._address, ctypes.byref(block), None, x, None, y, e, ctypes.byref(workspace.common)
        )
        if not done:
            raise MemoryError(f"CHOLMOD has no memory for {k} solutions of {n} unknowns")
        found = ctypes.cast(workspace.room[0], ctypes.POINTER(_Dense)).contents
        parts = rows.itemsize // 8  # of a number: 2 for real and imaginary part
        solution[:] = _view(found.x, k * n * parts, ctypes.c_double).view(rows.dtype).reshape(k, n)


def columns_at_once(count: int) -> int:
    """How many of `count` right-hand sides are solved for at once."""
    return COLUMNS if count < MANY else MORE_COLUMNS


class _Workspace:
    """What CHOLMOD writes to while it solves: of one thread at a time."""

    def __init__(self, found: Any) -> None:
        self.common = _started(found)
        self.room = (ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_void_p())  # solution and workspace
        weakref.finalize(self, _free_room, found, self.common, self.room)


def _kind(values: NDArray[Any]) -> int:
    """CHOLMOD's name for real or complex numbers."""
    return _COMPLEX if np.iscomplexobj(values) else _REAL


def _view(address: int, count: int, kind: Any) -> NDArray[Any]:
    """The array of CHOLMOD at an address, not copied."""
    return np.ctypeslib.as_array(ctypes.cast(address, ctypes.POINTER(kind)), shape=(count,))


@functools.cache
def library() -> Any:
    """The library with CHOLMOD's functions, None where there is none of the known version."""
    try:
        with best_kernels():
            module = importlib.import_module("cvxopt.cholmod")
        return _opened(str(module.__file__))
    except ImportError:
        return None


@functools.cache
def bears_threads() -> bool:
    """Whether two factors may be worked on in two threads at once.

    An OpenBLAS built for one thread gives every caller the same workspace, unless it was built with locks.
    """
    if library() is None:
        return False
    folder = Path(str(importlib.import_module("cvxopt").__file__)).parent.with_name("cvxopt.libs")
    files = list(folder.glob("libopenblas*"))
    return len(files) == 1 and holds_locks(files[0])


def _opened(module_file: str) -> Any:
    """CHOLMOD in the extension module that is linked to it; None where it is not of the known version."""
    try:
        found = ctypes.CDLL(module_file)
        version = (ctypes.c_int * 3)()
        found.cholmod_l_version(version)
        complete = all(hasattr(found, f"cholmod_l_{name}") for name in _FUNCTIONS + _RELEASES)
    except (OSError, AttributeError):
        return None
    if version[0] != _VERSION or not complete:
        return None
    found.cholmod_l_analyze_p.restype = ctypes.c_void_p
    found.cholmod_l_analyze_p.argtypes = [ctypes.c_void_p] * 3 + [ctypes.c_size_t, ctypes.c_void_p]
    found.cholmod_l_ptranspose.restype = ctypes.c_void_p
    found.cholmod_l_ptranspose.argtypes = [
        ctypes.c_void_p,
        ctypes.c_int,
        *[ctypes.c_void_p] * 2,
        ctypes.c_size_t,
        ctypes.c_void_p,
    ]
    found.cholmod_l_factorize.argtypes = [ctypes.c_void_p] * 3
    found.cholmod_l_solve2.argtypes = [ctypes.c_int] + [ctypes.c_void_p] * 8
    return found if _has_known_layout(found) else None


def _has_known_layout(found: Any) -> bool:
    """Self-test: whether the structures are laid out as described here, with known values in their places."""
    common = _Common()
    found.cholmod_l_start(ctypes.byref(common))
    known = _holds(common, _COMMON_DEFAULTS)
    if known:
        common.supernodal, common.print = _ALWAYS, 0
        arrays = np.array([0, 1, 3]), np.array([0, 0, 1]), np.array([2.0, 1.0, 2.0])
        triangle = _sparse(2, *arrays)
        address = ctypes.c_void_p(
            found.cholmod_l_analyze_p(ctypes.byref(triangle), None, None, 0, ctypes.byref(common))
        )
        known = bool(address) and _holds(ctypes.cast(address, ctypes.POINTER(_Factor)).contents, _FACTOR_OF_TWO)
        found.cholmod_l_free_factor(ctypes.byref(address), ctypes.byref(common))
    found.cholmod_l_finish(ctypes.byref(common))
    return known


def _holds(structure: ctypes.Structure, expected: Mapping[str, float]) -> bool:
    return all(getattr(structure, name) == value for name, value in expected.items())


def _started(found: Any) -> _Common:
    """Settings and workspace of one factor: always supernodal, which needs positive pivots; no printing."""
    common = _Common()
    found.cholmod_l_start(ctypes.byref(common))
    common.supernodal, common.print = _ALWAYS, 0
    return common


def _upper_triangle(
    matrix: csr_matrix, part: NDArray[np.int64] | None = None
) -> tuple[_Sparse, tuple[NDArray[Any], ...]]:
    """The upper triangle by columns (the conjugate of the lower one by rows) of a part, and its arrays."""
    if not matrix.has_canonical_format:
        matrix = matrix.copy()
        matrix.sum_duplicates()
    lengths = np.diff(matrix.indptr) if part is None else np.diff(matrix.indptr)[part]
    ends, n = np.concatenate([[0], np.cumsum(lengths)]), len(lengths)
    number = None if part is None else np.full(matrix.shape[0], -1)
    if number is not None:
        number[part] = np.arange(n)
    # memory that is never written takes no room: half of the arrays
    starts, indices, count = np.zeros(n + 1, np.int64), np.empty(ends[-1], np.int64), 0
    values = np.empty(ends[-1], matrix.dtype)
    for rows in _slabs(ends):  # in slabs: large temporary arrays cost more than the work
        row = np.repeat(rows, lengths[rows])
        if part is None or number is None:
            columns, entries = (array[ends[rows[0]] : ends[rows[-1] + 1]] for array in (matrix.indices, matrix.data))
        else:
            slab = matrix[part[rows]]
            columns, entries = number[slab.indices], slab.data
        lower = columns <= row
        if number is not None:
            lower &= columns >= 0
        place = slice(count, count + int(np.count_nonzero(lower)))
        indices[place], values[place] = columns[lower], entries[lower].conj()
        starts[rows + 1] = np.bincount(row[lower] - rows[0], minlength=len(rows))
        count = place.stop
    arrays = np.cumsum(starts), indices, values
    return _sparse(n, *arrays), arrays


def _sparse(n: int, starts: NDArray[np.int64], indices: NDArray[np.int64], values: NDArray[Any]) -> _Sparse:
    """CHOLMOD's view of an upper triangle by columns; the arrays must outlive it."""
    p, i, x = (array.ctypes.data for array in (starts, indices, values))
    return _Sparse(n, n, starts[-1], p, i, None, x, None, _UPPER, _LONG, _kind(values), _DOUBLE, 1, 1)


def _slabs(starts: NDArray[np.integer[Any]]) -> Iterator[NDArray[np.int64]]:
    """Consecutive rows with some 200 000 entries in all; `starts` (n + 1,) are the row pointers."""
    first, n = 0, len(starts) - 1
    while first < n:
        last = int(np.searchsorted(starts, starts[first] + _SLAB, side="right"))
        last = min(max(last - 1, first + 1), n)
        yield np.arange(first, last)
        first = last


def _free_room(found: Any, common: _Common, room: tuple[ctypes.c_void_p, ...]) -> None:
    """Free what CHOLMOD has written to while it solved."""
    for address in room:
        found.cholmod_l_free_dense(ctypes.byref(address), ctypes.byref(common))
    found.cholmod_l_finish(ctypes.byref(common))


def _free(found: Any, common: _Common, factor: ctypes.c_void_p, ordered: ctypes.c_void_p) -> None:
    """Free a factor; what is freed already is null."""
    found.cholmod_l_free_sparse(ctypes.byref(ordered), ctypes.byref(common))
    found.cholmod_l_free_factor(ctypes.byref(factor), ctypes.byref(common))
    found.cholmod_l_finish(ctypes.byref(common))
