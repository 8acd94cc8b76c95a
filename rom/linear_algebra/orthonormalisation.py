"""Vectors made orthonormal in the mass, without what is linearly dependent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Smallest eigenvalue kept of the vectors' scaled Gram matrix: what lies below is round-off of the others.
_DEPENDENT = 1e-11
# Smallest length of a vector after others were taken out of it, over the length before.
_LOST = 1e-7


def independent(gram: NDArray[np.float64], before: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Combinations (k, r), r <= k, of k vectors with Gram matrix (k, k) that are orthonormal in its inner product.

    before (k,): squared lengths of the vectors before other ones were taken out of them; where next to nothing is
    left, it is round-off and left out.
    """
    squared = np.maximum(np.diag(gram), 0.0)
    scale = np.sqrt(squared)
    used = squared > (0.0 if before is None else _LOST**2 * before)
    factor = np.zeros_like(scale)
    factor[used] = 1.0 / scale[used]
    values, vectors = np.linalg.eigh(factor[:, None] * gram * factor)
    kept = values > _DEPENDENT
    return factor[:, None] * vectors[:, kept] / np.sqrt(values[kept])
