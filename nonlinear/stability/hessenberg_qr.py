"""Eigenvalues of many small complex matrices, compiled: Hessenberg form by elimination, then shifted QR iteration.

The steps are those of COMHES and COMQR. At 12 rows LAPACK takes three times as long, mostly beside the arithmetic.

References
----------
R. S. Martin, J. H. Wilkinson, Similarity reduction of a general matrix to Hessenberg form, Numerische Mathematik 12,
1968.
B. T. Smith et al., Matrix Eigensystem Routines: EISPACK Guide, Springer, 1976.
G. H. Golub, C. F. Van Loan, Matrix Computations, Johns Hopkins University Press, 2013, sections 7.4 and 7.5.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nonlinear.contact.fourier import ComplexArray
from nonlinear.contact.numba_cache import compiled, inlined, inner
from nonlinear.stability.general_eigenvalues import general_eigenvalues

Matrix = NDArray[Any]
ROUND_OFF = float(np.finfo(float).eps)
MOST_STEPS = 30  # QR steps for one eigenvalue
EXCEPTIONAL = 10  # steps from one with an arbitrary shift, which breaks a cycle, to the next
MOST_ROWS = 100  # beyond them LAPACK takes as long, by blocks
AWAY = 0.75 + 0.4j  # of that shift from the last entry, in sizes of the one beside it


def qr_eigenvalues(matrices: Matrix) -> ComplexArray:
    """Eigenvalues of matrices (..., n, n) in no order, (..., n).

    Those of LAPACK for matrices with more than `MOST_ROWS` rows, and where the iteration does not converge.
    """
    n = matrices.shape[-1]
    every = np.ascontiguousarray(matrices, dtype=complex).reshape(matrices.size // max(n * n, 1), n, n)
    values, converged = np.zeros(every.shape[:2], dtype=complex), np.zeros(len(every), dtype=np.bool_)
    if n <= MOST_ROWS:
        _all_eigenvalues(every, values, converged)
    if not converged.all():
        values[~converged] = general_eigenvalues(every[~converged])
    return values.reshape(matrices.shape[:-1])


@compiled
def _all_eigenvalues(matrices: Matrix, values: Matrix, converged: NDArray[np.bool_]) -> None:
    """Write the eigenvalues (K, n) of matrices (K, n, n), and of which the iteration has converged (K,)."""
    count, n, _ = matrices.shape
    work, rotations = np.empty((n, n), np.complex128), np.empty((n, 2), np.complex128)
    for k in range(count):
        total = 0.0
        for i in range(n):
            for j in range(n):
                total += _size(matrices[k, i, j])
        if total == 0.0:  # the values are zero already
            converged[k] = True
        if not 0.0 < total < np.inf:  # nor with a NaN
            continue
        scale = 1.0 / total
        for i in range(n):  # squares of entries shall neither overflow nor vanish
            for j in range(n):
                work[i, j] = matrices[k, i, j] * scale
        _to_hessenberg(work)
        converged[k] = _iterate(work, rotations, values[k])
        for i in range(n):
            values[k, i] *= total


@inlined
def _size(value: complex) -> float:
    return abs(value.real) + abs(value.imag)


@inner
def _to_hessenberg(a: Matrix) -> None:
    """Eliminate what is below the subdiagonal with similarity transforms N^-1 A N, pivots from the same column.

    The multipliers are left there.
    """
    n = a.shape[0]
    for m in range(1, n - 1):
        pivot = m
        for i in range(m + 1, n):
            if _size(a[i, m - 1]) > _size(a[pivot, m - 1]):
                pivot = i
        if a[pivot, m - 1] == 0.0:
            continue
        if pivot != m:
            for j in range(m - 1, n):
                a[m, j], a[pivot, j] = a[pivot, j], a[m, j]
            for i in range(n):
                a[i, m], a[i, pivot] = a[i, pivot], a[i, m]
        inverse = 1.0 / a[m, m - 1]
        for i in range(m + 1, n):
            a[i, m - 1] *= inverse
            factor = a[i, m - 1]
            if factor != 0.0:
                for j in range(m, n):
                    a[i, j] -= factor * a[m, j]
        for i in range(n):
            added = a[i, m]
            for j in range(m + 1, n):
                added += a[j, m - 1] * a[i, j]
            a[i, m] = added


@inner
def _iterate(h: Matrix, rotations: Matrix, values: Matrix) -> bool:
    """Write the eigenvalues (n,) of a Hessenberg matrix of size 1 or less; False: one took too many steps."""
    last, step = h.shape[0] - 1, 0
    while last >= 0:
        first = last
        while first > 0:
            diagonal = _size(h[first - 1, first - 1]) + _size(h[first, first])
            if _size(h[first, first - 1]) <= ROUND_OFF * (diagonal or 1.0):
                break
            first -= 1
        if first == last:
            values[last] = h[last, last]
            last, step = last - 1, 0
            continue
        if step == MOST_STEPS:
            return False
        step += 1
        shift = h[last, last]
        if step % EXCEPTIONAL == 0:
            shift += AWAY * _size(h[last, last - 1])
        else:  # the eigenvalue of the last 2 x 2 block next to its last entry (Wilkinson)
            half, product = 0.5 * (h[last - 1, last - 1] - shift), h[last - 1, last] * h[last, last - 1]
            root = np.sqrt(half * half + product)
            if half.real * root.real + half.imag * root.imag < 0.0:
                root = -root
            if half + root != 0.0:
                shift -= product / (half + root)
        _qr_step(h, first, last, shift, rotations)
    return True


@inner
def _qr_step(h: Matrix, first: int, last: int, shift: complex, rotations: Matrix) -> None:
    """H - shift = Q R, and R Q + shift in its place, of the rows `first` to `last`; Q of Givens rotations."""
    for i in range(first, last + 1):
        h[i, i] -= shift
    for k in range(first, last):
        x, y = h[k, k], h[k + 1, k]
        length = np.sqrt(x.real * x.real + x.imag * x.imag + y.real * y.real + y.imag * y.imag)
        cosine, sine = (x * (1.0 / length), y * (1.0 / length)) if length > 0.0 else (complex(1.0), complex(0.0))
        rotations[k, 0], rotations[k, 1] = cosine, sine
        h[k, k], h[k + 1, k] = length, 0.0
        for j in range(k + 1, last + 1):
            upper, lower = h[k, j], h[k + 1, j]
            h[k, j] = cosine.conjugate() * upper + sine.conjugate() * lower
            h[k + 1, j] = cosine * lower - sine * upper
    for k in range(first, last):
        cosine, sine = rotations[k, 0], rotations[k, 1]
        for i in range(first, k + 2):
            left, right = h[i, k], h[i, k + 1]
            h[i, k] = left * cosine + right * sine
            h[i, k + 1] = right * cosine.conjugate() - left * sine.conjugate()
    for i in range(first, last + 1):
        h[i, i] += shift
