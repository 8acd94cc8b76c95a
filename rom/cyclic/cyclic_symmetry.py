"""Travelling waves in a ring of identical blades: inter-blade phase angle and relative contact motion.

In a travelling wave blade j+1 moves like blade j, with its harmonic h ahead by the phase h psi. The right face of one
blade touches the left face of the next.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

SPARSE = 0.1  # share of entries that are not zero below which products are sparse


def inter_blade_phase(engine_order: int, n_blades: int | None) -> float:
    """Inter-blade phase angle of an engine-order excitation, psi = 2 pi EO / N_b.

    Parameters
    ----------
    engine_order : int
        Engine order EO.
    n_blades : int or None
        Number of blades N_b of the ring; None for a single structure.

    Returns
    -------
    float
        psi in rad, 0 <= psi < 2 pi; 0 for a single structure.

    Examples
    --------
    >>> from rom import inter_blade_phase
    >>> inter_blade_phase(36, 72) == np.pi
    True
    """
    return 0.0 if n_blades is None else 2.0 * np.pi * (engine_order % n_blades) / n_blades


def relative_contact_motion(
    right: NDArray[Any], left: NDArray[Any] | None, phase: ArrayLike
) -> NDArray[np.complex128]:
    """Relative displacement of facing contact nodes in a travelling wave, B = right - exp(i phase) left.

    With phase = h psi this is the operator B_h of Gulisano et al. 2011, eq. 17: d^(h) = B_h q^(h).

    `left` (3 n_c, n): the same for the left nodes; None for contact against ground; `phase` (k,): phase from one
    blade to the next, rad. Returns (k, 3 n_c, n): B, one matrix for each phase.
    """
    ahead: NDArray[np.complex128] = np.exp(1j * np.asarray(phase, dtype=complex))[..., None, None]
    if left is None:
        return np.ones_like(ahead) * right
    return right - left * ahead


def wave_coordinates(
    right: NDArray[np.float64] | None, left: NDArray[np.float64] | None, phase: float
) -> NDArray[np.complex128] | None:
    """Coordinates of a sector that is joined to its neighbours, in a travelling wave: right q = exp(i phase) left q.

    `right`, `left` (r, n): motions of the two cut faces for unit coordinates, as `ReducedModel.cyclic_right` and
    `cyclic_left`; `phase`: phase from one sector to the next, rad. Returns (n, k): orthonormal vectors T, q = T z;
    None where the sector has no cut faces.
    """
    from scipy.linalg import null_space

    if right is None or left is None:
        return None
    factor = complex(np.cos(phase), np.sin(phase))
    factor = factor.real if abs(factor.imag) < 1e-12 else factor
    joined = right.any(axis=0) | left.any(axis=0)
    right, left = right[:, joined], left[:, joined]
    both = np.concatenate([right, left])
    if len(both) == both.shape[1] and np.array_equal(both @ both.T, np.eye(len(both))):  # a coordinate each
        following = (factor * right + left).T / np.sqrt(2.0)
    else:
        following = null_space(right - factor * left, rcond=1e-9)
    free, count = np.flatnonzero(~joined), following.shape[1]
    found = np.zeros((joined.size, count + free.size), dtype=complex)
    found[joined, :count] = following
    found[free, count + np.arange(free.size)] = 1.0
    return found


def in_wave(matrix: NDArray[Any], wave: NDArray[Any]) -> NDArray[Any]:
    """T^H A T of a matrix A (n, n) with the coordinates T (n, k) of a wave; zeros in T cost nothing."""
    columns = sparse_wave(wave)
    return np.asarray(columns.conj().T @ (columns.T @ matrix.T).T)


def sparse_wave(wave: NDArray[Any]) -> Any:
    """The coordinates of a wave as a sparse matrix, where few of them are not zero."""
    from scipy.sparse import csr_matrix

    return csr_matrix(wave) if np.count_nonzero(wave) < SPARSE * wave.size else wave
