"""Eigenvalues of large general matrices by LAPACK in a call that releases the lock of the interpreter.

That of numpy and of scipy holds the lock, for a minute with 2000 rows, in which no signal is heeded.
"""

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGE = 200  # rows, below which a call takes a moment


def general_eigenvalues(matrix: NDArray[Any]) -> NDArray[np.complex128]:
    """Eigenvalues of a matrix (..., n, n), (..., n); those of a real one in conjugate pairs."""
    if matrix.shape[-1] < LARGE:
        return np.asarray(np.linalg.eigvals(matrix), dtype=complex)
    every = matrix.reshape(-1, *matrix.shape[-2:])
    return np.stack([_of_large(one) for one in every]).reshape(matrix.shape[:-1])


def _of_large(matrix: NDArray[Any]) -> NDArray[np.complex128]:
    """Those of one matrix (n, n), by dgeev or zgeev."""
    if not np.isfinite(matrix).all():
        raise np.linalg.LinAlgError("Array must not contain infs or NaNs")
    n, is_complex = len(matrix), np.iscomplexobj(matrix)
    a = np.array(matrix, dtype=complex if is_complex else float, order="F")
    values, real = np.empty(n, dtype=complex), np.empty((2, n))
    none, one, rotation = np.empty(1, dtype=a.dtype), np.ones(1, dtype=np.intc), np.empty(2 * n)
    size, failed, length = np.array([n], dtype=np.intc), np.zeros(1, dtype=np.intc), np.array([-1], dtype=np.intc)
    work = np.empty(1, dtype=a.dtype)
    found = (values,) if is_complex else (real[0], real[1])
    for _ in range(2):  # first only the length of `work` is asked for
        parts = (
            size,
            a,
            size,
            *found,
            none,
            one,
            none,
            one,
            work,
            length,
            *((rotation,) if is_complex else ()),
            failed,
        )
        _lapack("zgeev" if is_complex else "dgeev", len(parts))(b"N", b"N", *(part.ctypes.data for part in parts))
        if length[0] < 0:
            length[0] = int(work[0].real)
            work = np.empty(length[0], dtype=a.dtype)
    if failed[0]:
        raise np.linalg.LinAlgError("Eigenvalues did not converge")
    return values if is_complex else real[0] + 1j * real[1]


def _lapack(name: str, arrays: int) -> Any:
    """A routine of LAPACK that takes two letters and so many arrays."""
    from scipy.linalg import cython_lapack

    capsule, api = cython_lapack.__pyx_capi__[name], ctypes.pythonapi
    name_of = ctypes.PYFUNCTYPE(ctypes.c_char_p, ctypes.py_object)(("PyCapsule_GetName", api))
    address_of = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(("PyCapsule_GetPointer", api))
    types = [ctypes.c_char_p] * 2 + [ctypes.c_void_p] * arrays
    return ctypes.CFUNCTYPE(None, *types)(address_of(capsule, name_of(capsule)))
