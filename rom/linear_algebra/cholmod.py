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
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rom.linear_algebra.blas_kernels import best_kernels

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

COLUMNS = 16  # right-hand sides at once: more are no faster and take memory
_SLAB = 200_000  # entries of a matrix
_VERSION = 3  # version of CHOLMOD whose structures are described here
_LONG, _REAL, _DOUBLE, _UPPER, _NATURAL, _SOLVE_A, _ALWAYS = 2, 1, 0, 1, 0, 0, 2
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


_COMMON_DEFAULTS = {"supernodal_switch": 40.0, "supernodal": 1, "print": 3}
_FACTOR_OF_TWO = {"n": 2, "minor": 2, "nsuper": 1, "xsize": 4, "is_ll": 1, "is_super": 1, "itype": _LONG, "xtype": 0}


class CholmodFactor:
    """Supernodal Cholesky factor of a symmetric positive definite matrix (n, n) with both triangles stored.

    The constructor analyses the matrix and copies a triangle of it; `factorise` computes the factor. CHOLMOD tries
    the elimination `order` (n,) and minimum degree, and takes the better one.
    """

    def __init__(self, matrix: csr_matrix, order: NDArray[np.int64] | None = None) -> None:
        found = library()
        if found is None:
            raise ValueError("this cvxopt has no CHOLMOD that is known here")
        self._library, self._common = found, _started(found)
        triangle, _arrays = _upper_triangle(matrix)
        self._entries = triangle.nzmax
        common = ctypes.byref(self._common)
        given = None if order is None else np.ascontiguousarray(order, dtype=np.int64)
        place = None if given is None else given.ctypes.data
        self._address = ctypes.c_void_p(found.cholmod_l_analyze_p(ctypes.byref(triangle), place, None, 0, common))
        if not self._address:
            raise MemoryError(f"CHOLMOD has no memory to analyse a matrix of {matrix.shape[0]} unknowns")
        self._factor = ctypes.cast(self._address, ctypes.POINTER(_Factor)).contents
        self._room = (ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_void_p())  # solution and workspace
        self._ordered = ctypes.c_void_p()
        weakref.finalize(self, _free, found, self._common, self._address, self._ordered, self._room)
        self._order(triangle)

    def load(self, matrix: csr_matrix) -> None:
        """Take another matrix with the same pattern; `factorise` then computes its factor in the place of the last.

        Raises ValueError for another number of entries.
        """
        triangle, _arrays = _upper_triangle(matrix)
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

    def solve(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Solutions (k, n) of A x = b for k right-hand sides, stored as rows."""
        rows = np.ascontiguousarray(rows, dtype=float)
        solution = np.empty(rows.shape)
        for first in range(0, len(rows), COLUMNS):
            part = slice(first, first + COLUMNS)
            self._solve_at_once(rows[part], solution[part])
        return solution

    def _solve_at_once(self, rows: NDArray[np.float64], solution: NDArray[np.float64]) -> None:
        k, n = rows.shape
        block = _Dense(n, k, rows.size, n, rows.ctypes.data, None, _REAL, _DOUBLE)
        x, y, e = (ctypes.byref(room) for room in self._room)
        done = self._library.cholmod_l_solve2(
            _SOLVE_A, self._address, ctypes.byref(block), None, x, None, y, e, ctypes.byref(self._common)
        )
        if not done:
            raise MemoryError(f"CHOLMOD has no memory for {k} solutions of {n} unknowns")
        found = ctypes.cast(self._room[0], ctypes.POINTER(_Dense)).contents
        values = ctypes.cast(found.x, ctypes.POINTER(ctypes.c_double))
        solution[:] = np.ctypeslib.as_array(values, shape=(k, n))


@functools.cache
def library() -> Any:
    """The library with CHOLMOD's functions, None where there is none of the known version."""
    try:
        with best_kernels():
            module = importlib.import_module("cvxopt.cholmod")
        return _opened(str(module.__file__))
    except ImportError:
        return None


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


def _upper_triangle(matrix: csr_matrix) -> tuple[_Sparse, tuple[NDArray[Any], ...]]:
    """The upper triangle by columns (equal to the lower one by rows), and the arrays that hold it."""
    if not matrix.has_canonical_format:
        matrix = matrix.copy()
        matrix.sum_duplicates()
    n = matrix.shape[0]
    starts, indices, values = np.zeros(n + 1, np.int64), np.empty(matrix.nnz, np.int64), np.empty(matrix.nnz)
    count = 0
    for rows in _slabs(matrix.indptr):  # in slabs: large temporary arrays cost more than the work
        place = slice(matrix.indptr[rows[0]], matrix.indptr[rows[-1] + 1])
        columns, row = matrix.indices[place], np.repeat(rows, np.diff(matrix.indptr[rows[0] : rows[-1] + 2]))
        lower = columns <= row
        found = int(np.count_nonzero(lower))
        indices[count : count + found], values[count : count + found] = columns[lower], matrix.data[place][lower]
        starts[rows + 1] = np.bincount(row[lower] - rows[0], minlength=len(rows))
        count += found
    arrays = np.cumsum(starts), indices, values
    return _sparse(n, *arrays), arrays


def _sparse(n: int, starts: NDArray[np.int64], indices: NDArray[np.int64], values: NDArray[np.float64]) -> _Sparse:
    """CHOLMOD's view of an upper triangle by columns; the arrays must outlive it."""
    p, i, x = (array.ctypes.data for array in (starts, indices, values))
    return _Sparse(n, n, starts[-1], p, i, None, x, None, _UPPER, _LONG, _REAL, _DOUBLE, 1, 1)


def _slabs(starts: NDArray[np.integer[Any]]) -> Iterator[NDArray[np.int64]]:
    """Consecutive rows with some 200 000 entries in all; `starts` (n + 1,) are the row pointers."""
    first, n = 0, len(starts) - 1
    while first < n:
        last = int(np.searchsorted(starts, starts[first] + _SLAB, side="right"))
        last = min(max(last - 1, first + 1), n)
        yield np.arange(first, last)
        first = last


def _free(
    found: Any, common: _Common, factor: ctypes.c_void_p, ordered: ctypes.c_void_p, room: tuple[ctypes.c_void_p, ...]
) -> None:
    """Free the memory of CHOLMOD; what is freed already is null."""
    for address in room:
        found.cholmod_l_free_dense(ctypes.byref(address), ctypes.byref(common))
    found.cholmod_l_free_sparse(ctypes.byref(ordered), ctypes.byref(common))
    found.cholmod_l_free_factor(ctypes.byref(factor), ctypes.byref(common))
    found.cholmod_l_finish(ctypes.byref(common))
