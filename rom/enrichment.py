"""Vectors that complete a basis: orthonormal in the mass, without what is linearly dependent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Smallest eigenvalue kept of the vectors' scaled Gram matrix: what lies below is round-off of the others.
_DEPENDENT = 1e-11


def independent(gram: NDArray[np.float64]) -> NDArray[np.float64]:
    """Combinations (k, r), r <= k, of k vectors with Gram matrix (k, k) that are orthonormal in its inner product."""
    scale = np.sqrt(np.diag(gram))
    used = scale > 0.0
    factor = np.zeros_like(scale)
    factor[used] = 1.0 / scale[used]
    values, vectors = np.linalg.eigh(factor[:, None] * gram * factor)
    kept = values > _DEPENDENT
    return factor[:, None] * vectors[:, kept] / np.sqrt(values[kept])
