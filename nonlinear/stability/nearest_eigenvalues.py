"""Eigenvalues next to zero of many matrices at once, by Krylov subspaces of their inverses.

References
----------
Y. Saad, Numerical Methods for Large Eigenvalue Problems, SIAM, 2011, chapters 6 and 8.
"""

import numpy as np

from nonlinear.contact.fourier import ComplexArray

DIMENSION = 30  # of a subspace; 24 had all of 19 600 eigenvalues sought in matrices of 42 to 78 rows to 0.002
BESIDE = 0.01 + 0.01j  # of the shift from zero: an eigenvalue at the shift itself would spoil all others
LARGE = 45  # rows from which the subspaces take less time than all eigenvalues


def nearest_eigenvalues(matrix: ComplexArray, descriptor: ComplexArray) -> ComplexArray:
    """Eigenvalues of sigma E z = A z, those next to zero if there are many.

    Of matrices with `LARGE` or more rows as many as the subspace has dimensions. Those nearest to zero are accurate,
    the last few are not eigenvalues yet.
    Shapes: `matrix` (K, n, n), `descriptor` (K, n, n), returns (n, m).
    """
    if matrix.shape[-1] >= LARGE:
        try:
            return BESIDE + _of_subspaces(np.asarray(np.linalg.solve(matrix - BESIDE * descriptor, descriptor)))
        except np.linalg.LinAlgError:  # the shift is an eigenvalue, or a subspace is invariant
            pass
    return np.asarray(np.linalg.eigvals(np.linalg.solve(descriptor, matrix)), dtype=complex)


def _of_subspaces(inverse: ComplexArray) -> ComplexArray:
    """Inverses of the eigenvalues of (K, n, n) in Krylov subspaces, (K, m): Arnoldi's method, orthogonal twice."""
    count, size, _ = inverse.shape
    basis = np.zeros((count, DIMENSION + 1, size), dtype=complex)  # rows
    projected = np.zeros((count, DIMENSION, DIMENSION), dtype=complex)
    basis[:, 0] = np.exp(1j * np.arange(size) ** 2) / np.sqrt(size)
    for step in range(DIMENSION):
        known = basis[:, : step + 1]
        vector = inverse @ basis[:, step, :, None]
        for _ in range(2):
            part = known.conj() @ vector
            vector -= known.transpose(0, 2, 1) @ part
            projected[:, : step + 1, step] += part[:, :, 0]
        length = np.linalg.norm(vector[:, :, 0], axis=1)
        if step + 1 < DIMENSION:
            projected[:, step + 1, step] = length
            basis[:, step + 1] = vector[:, :, 0] / length[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1.0 / np.linalg.eigvals(projected))
