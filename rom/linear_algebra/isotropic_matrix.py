"""Matrices over nodes that act alike on x, y and z, such as the mass: one number for each pair of nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.linear_algebra.threads import at_once, shared

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_PER_NODE = 3


@dataclass(frozen=True)
class IsotropicMatrix:
    """Matrix A (3n, 3n) of n nodes whose block for a pair of nodes is a number times the identity.

    A product with k columns is that of the numbers with 3k columns: a third of the entries is read.
    """

    pairs: csr_matrix  # (n, n), the number of each pair

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
        product = np.empty((rows, together.shape[1]))

        def multiply(part: slice) -> None:
            product[part] = self._rows(part) @ together

        at_once(multiply, [slice(s.start // _PER_NODE, s.stop // _PER_NODE) for s in shared(_PER_NODE * rows)])
        return product.reshape(_PER_NODE * rows, *columns.shape[1:])

    def _rows(self, part: slice) -> csr_matrix:
        """Some rows of the pairs, not copied."""
        from scipy.sparse import csr_matrix

        pairs, starts = self.pairs, self.pairs.indptr[part.start : part.stop + 1]
        place = slice(starts[0], starts[-1])
        shape = part.stop - part.start, pairs.shape[1]
        return csr_matrix((pairs.data[place], pairs.indices[place], starts - starts[0]), shape=shape)
