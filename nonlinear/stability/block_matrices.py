"""Matrices of the contact dofs in all harmonics: block diagonal in the harmonics or in the nodes, or of few motions.

A product with a full matrix is written `blocks @ matrix` or `matrix @ blocks`.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[Any]  # real or complex


@dataclass(frozen=True)
class HarmonicBlocks:
    """Block diagonal matrix with one block a harmonic."""

    static: Matrix  # (k_0, k_0), block of harmonic 0; of size 0 without that harmonic
    dynamic: Matrix  # (b, k, k), blocks of the other harmonics, all of one size
    __array_ufunc__: ClassVar[None] = None  # `array @ blocks` calls `__rmatmul__`

    def __matmul__(self, matrix: Matrix) -> Matrix:
        size = self.static.shape[0]
        result = np.empty(matrix.shape, dtype=np.result_type(matrix, self.static))
        result[:size] = self.static @ matrix[:size]
        below = matrix[size:].reshape(*self.dynamic.shape[:2], matrix.shape[1])
        result[size:] = (self.dynamic @ below).reshape(matrix.shape[0] - size, matrix.shape[1])
        return result

    def __rmatmul__(self, matrix: Matrix) -> Matrix:
        transposed: Matrix = HarmonicBlocks(self.static.T, self.dynamic.transpose(0, 2, 1)) @ matrix.T
        return transposed.T


@dataclass(frozen=True)
class NodeBlocks:
    """Matrix that couples the S coefficients and 3 directions of each contact node; rows and columns (S, n_c, 3)."""

    values: Matrix  # (n_c, S, 3, S, 3), block of each node
    __array_ufunc__: ClassVar[None] = None

    def __matmul__(self, matrix: Matrix) -> Matrix:
        nodes, size = self.values.shape[:2]
        columns = matrix.shape[1]
        parts = matrix.reshape(size, nodes, 3, columns).transpose(1, 0, 2, 3).reshape(nodes, 3 * size, columns)
        product = self.values.reshape(nodes, 3 * size, 3 * size) @ parts
        return product.reshape(nodes, size, 3, columns).transpose(1, 0, 2, 3).reshape(matrix.shape)

    def __rmatmul__(self, matrix: Matrix) -> Matrix:
        transposed: Matrix = NodeBlocks(self.values.transpose(0, 3, 4, 1, 2)) @ matrix.T
        return transposed.T

    def return_difference(self, flexibility: HarmonicBlocks) -> Matrix:
        """I - G_0 K as a full matrix, K these blocks and G_0 the `flexibility`."""
        nodes, size = self.values.shape[:2]
        full = np.zeros((size, nodes, 3, size, nodes, 3), dtype=self.values.dtype)  # -K
        for node, values in enumerate(self.values):
            np.negative(values, out=full[:, node, :, :, node])
        result: Matrix = flexibility @ full.reshape(3 * nodes * size, -1)
        result[np.diag_indices_from(result)] += 1.0
        return result


@dataclass(frozen=True)
class MotionBlocks:
    """Full matrix that couples all coefficients of a few contact motions; rows and columns (S, r)."""

    values: Matrix  # (S r, S r), the matrix
    __array_ufunc__: ClassVar[None] = None

    def __matmul__(self, matrix: Matrix) -> Matrix:
        result: Matrix = self.values @ matrix
        return result

    def __rmatmul__(self, matrix: Matrix) -> Matrix:
        result: Matrix = matrix @ self.values
        return result

    def return_difference(self, flexibility: HarmonicBlocks) -> Matrix:
        """I - G_0 K as a full matrix, K this one and G_0 the `flexibility`."""
        result: Matrix = flexibility @ -self.values
        result[np.diag_indices_from(result)] += 1.0
        return result
