"""Orthonormalisation of vectors by the eigenvectors of their Gram matrix (SVQB).

References
----------
A. Stathopoulos, K. Wu, A block orthogonalization procedure with constant synchronization requirements,
SIAM J. Sci. Comput. 23 (2002) 2165-2182.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

# Smallest eigenvalue of the scaled Gram matrix that is not round-off of the others.
_DEPENDENT = 1e-11
# Smallest length of a vector after others were taken out of it, over its length before.
_LOST = 1e-7


def svqb(
    gram: NDArray[Any], lengths: NDArray[np.float64], smallest: float, most: int | None = None
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Combinations of k vectors that are orthonormal, from their Gram matrix G.

    With D = diag(lengths) and D^-1 G D^-1 = V S V^H the combinations are X = D^-1 V S^-1/2: X^H G X = I. Linearly
    dependent directions are dropped.
    Shapes: `gram` (k, k), `lengths` (k,), returns `combinations` (k, r), `components` (r, k).
    """
    squares, directions = np.linalg.eigh(0.5 * (gram + gram.conj().T) / np.outer(lengths, lengths))
    chosen = np.flatnonzero(squares > smallest)
    if most is not None:
        chosen = chosen[len(chosen) - min(most, len(chosen)) :]
    roots, directions = np.sqrt(squares[chosen]), directions[:, chosen]
    return (directions / roots) / lengths[:, None], (roots * directions).conj().T * lengths


def orthonormal_combinations(gram: NDArray[Any], before: NDArray[np.float64] | None = None) -> NDArray[Any]:
    """Combinations (k, r), r <= k, of k vectors with Gram matrix (k, k), real or Hermitian, that are orthonormal.

    before (k,): squared lengths of the vectors before they were made orthogonal to others. A vector of which next to
    nothing is left is round-off; it is left out.
    """
    squared = np.maximum(np.diag(gram).real, 0.0)
    used = squared > (0.0 if before is None else _LOST**2 * before)
    found, _ = svqb(gram[np.ix_(used, used)], np.sqrt(squared[used]), _DEPENDENT)
    combinations = np.zeros((len(gram), found.shape[1]), found.dtype)
    combinations[used] = found
    return combinations
