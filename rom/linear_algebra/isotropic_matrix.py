"""Matrices over nodes that act alike on x, y and z, such as the mass: one number for each pair of nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_PER_NODE = 3


@dataclass(frozen=True)
class IsotropicMatrix:
    """Matrix A (3n, 3n) of n nodes whose block for a pair of nodes is a number times the identity.

    A product with k columns is that of the numbers with 3k columns: a third of the entries is read.

    Attributes
    ----------
    pairs : (n, n) CSR matrix
        The number of each pair.
    """

    pairs: csr_matrix

    @classmethod
    def of(cls, matrix: csr_matrix) -> IsotropicMatrix:
        """From the matrix (3n, 3n) itself, of which only the x components are read."""
        return cls(matrix[::_PER_NODE][:, ::_PER_NODE].tocsr())

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, (3n, 3n)."""
        rows, columns = self.pairs.shape
        return _PER_NODE * rows, _PER_NODE * columns

    def __matmul__(self, columns: NDArray[np.float64]) -> NDArray[np.float64]:
        """A x for x (3n,) or (3n, k), node-major x, y, z."""
        rows, inner = self.pairs.shape
        together = np.ascontiguousarray(columns).reshape(inner, columns.size // max(inner, 1))
        return np.asarray(self.pairs @ together).reshape(_PER_NODE * rows, *columns.shape[1:])
