"""Interface modes: the relative motions of the contact nodes in which a receptance is large.

The receptance G = B D B^H is a sum over modes. With weights W >= ``|D|`` over a band of frequencies, the eigenvectors
of B W B^H with the largest eigenvalues span a space outside which G is small in the whole band.
"""

import numpy as np

from rom.cyclic.reduced_model import Array, ComplexArray

LARGEST_DENSE = 150  # relative displacements, above which a random subspace is iterated in place of all eigenvectors
SUBSPACE = 64
ITERATIONS = 3
NO_DAMPING = 1e-5  # damping coefficient over natural frequency that limits the weights


def band_weights(frequency: Array, damping: Array, order: float, band: tuple[float, float]) -> Array:
    """Bounds of the modal receptances ``|1 / (w_m^2 + i c_m x - x^2)|`` for x = h w and w in a band.

    Shapes: `frequency` (m,), `damping` (m,), returns (m,).
    """
    low, high = order * band[0], order * band[1]
    nearest = np.clip(frequency, low, high)
    damped = np.maximum(damping, NO_DAMPING * frequency) * nearest
    return 1.0 / np.maximum(np.hypot(frequency**2 - nearest**2, damped), np.finfo(float).tiny)


def interface_modes(relative: ComplexArray, weights: Array) -> tuple[ComplexArray, Array]:
    """The leading eigenvectors of B W B^H and their eigenvalues, descending.

    Shapes: `relative` (3 n_c, m), `weights` (m,), returns `basis` (3 n_c, r), `values` (r,).
    """
    size = relative.shape[0]
    if size <= LARGEST_DENSE:
        values, vectors = np.linalg.eigh((relative * weights) @ relative.conj().T)
        return vectors[:, ::-1], values[::-1]
    adjoint = relative.conj().T
    basis = np.random.default_rng(0).standard_normal((size, SUBSPACE)).astype(relative.dtype)
    for _ in range(ITERATIONS):
        basis = relative @ (weights[:, None] * (adjoint @ np.linalg.qr(basis)[0]))
    basis = np.linalg.qr(basis)[0]
    projected = adjoint @ basis
    values, vectors = np.linalg.eigh((projected.conj().T * weights) @ projected)
    return basis @ vectors[:, ::-1], values[::-1]
