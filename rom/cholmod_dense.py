"""CHOLMOD's solution with a dense block of right-hand sides, which the doors of cvxopt do not offer.

cvxopt solves a dense block column by column, each of which reads the whole factor from memory, and a sparse one four
columns at a time. CHOLMOD itself takes as many as it is given and is bound by arithmetic from eight on: a third to a
sixth of the time a column. The library is the one that cvxopt has loaded; its `cholmod_l_solve` is called on cvxopt's
factor.
"""

from __future__ import annotations

import ctypes
import weakref
from typing import Any

import numpy as np
from numpy.typing import NDArray

COLUMNS = 16  # at once: more are no quicker and take memory
_VERSION = 3  # of CHOLMOD, whose structures are described here
_CAPSULE = b"CHOLMOD FACTOR D L"  # what cvxopt calls a real factor
_COMMON_BYTES = 1 << 16  # cholmod_common takes some 3000
_REAL, _DOUBLE, _SOLVE_A = 1, 0, 0


class _Dense(ctypes.Structure):
    """cholmod_dense: a matrix by columns."""

    _fields_ = (
        ("nrow", ctypes.c_size_t),
        ("ncol", ctypes.c_size_t),
        ("nzmax", ctypes.c_size_t),
        ("d", ctypes.c_size_t),
        ("x", ctypes.c_void_p),
        ("z", ctypes.c_void_p),
        ("xtype", ctypes.c_int),
        ("dtype", ctypes.c_int),
    )


class DenseSolver:
    """Solves with a numeric factor of cvxopt for blocks of right-hand sides; made by `dense_solver`."""

    def __init__(self, library: Any, factor: Any) -> None:
        pointer = ctypes.pythonapi.PyCapsule_GetPointer
        pointer.restype, pointer.argtypes = ctypes.c_void_p, (ctypes.py_object, ctypes.c_char_p)
        self._capsule = factor  # kept alive as long as its address is used
        self._factor = ctypes.c_void_p(pointer(factor, _CAPSULE))
        self._library, self._common = library, ctypes.create_string_buffer(_COMMON_BYTES)
        library.cholmod_l_start(self._common)
        weakref.finalize(self, library.cholmod_l_finish, self._common)

    def solve(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """The solutions (k, n) of k right-hand sides, each a row here as it is a column in A x = b."""
        rows = np.ascontiguousarray(rows, dtype=float)
        k, n = rows.shape
        block = _Dense(n, k, rows.size, n, rows.ctypes.data, None, _REAL, _DOUBLE)
        found = self._library.cholmod_l_solve(_SOLVE_A, self._factor, ctypes.byref(block), self._common)
        if not found:
            raise MemoryError(f"CHOLMOD has no memory for {k} solutions of {n} unknowns")
        values = ctypes.cast(found.contents.x, ctypes.POINTER(ctypes.c_double))
        solution = np.ctypeslib.as_array(values, shape=(k, n)).copy()
        address = ctypes.c_void_p(ctypes.addressof(found.contents))
        self._library.cholmod_l_free_dense(ctypes.byref(address), self._common)
        return solution


def dense_solver(module_file: str, factor: Any) -> DenseSolver | None:
    """A solver for a factor of cvxopt, None where this build of cvxopt does not let one in.

    module_file: of the extension module `cvxopt.cholmod`, through which its library is found; factor: a numeric one.
    """
    name = ctypes.pythonapi.PyCapsule_GetName
    name.restype, name.argtypes = ctypes.c_char_p, (ctypes.py_object,)
    try:
        library = ctypes.CDLL(module_file)
        version = (ctypes.c_int * 3)()
        library.cholmod_l_version(version)
        library.cholmod_l_solve.restype = ctypes.POINTER(_Dense)
        complete = all(hasattr(library, f"cholmod_l_{part}") for part in ("start", "finish", "free_dense"))
        known = complete and version[0] == _VERSION and name(factor) == _CAPSULE
    except (OSError, AttributeError, ValueError):
        return None
    return DenseSolver(library, factor) if known else None
