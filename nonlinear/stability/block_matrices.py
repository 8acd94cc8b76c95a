"""Matrices of the contact motions in all harmonics that are block diagonal: in the harmonics, or in the nodes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[Any]  # real or complex


@dataclass(frozen=True)
class HarmonicBlocks:
    """A block for harmonic 0, static (k_0, k_0), of size 0 without that; then equal ones, turning (b, k, k)."""

    static: Matrix
    turning: Matrix

    def times(self, matrix: Matrix) -> Matrix:
        """Product with a matrix on the right."""
        size = self.static.shape[0]
        result = np.empty(matrix.shape, dtype=np.result_type(matrix, self.static))
        result[:size] = self.static @ matrix[:size]
        below = matrix[size:].reshape(*self.turning.shape[:2], matrix.shape[1])
        result[size:] = (self.turning @ below).reshape(matrix.shape[0] - size, matrix.shape[1])
        return result

    def after(self, matrix: Matrix) -> Matrix:
        """Product with a matrix on the left."""
        return HarmonicBlocks(self.static.T, self.turning.transpose(0, 2, 1)).times(matrix.T).T


@dataclass(frozen=True)
class NodeBlocks:
    """Values (n_c, S, 3, S, 3) of each node; the rows and columns of the matrix are (S, n_c, 3)."""

    values: Matrix

    def times(self, matrix: Matrix) -> Matrix:
        """Product with a matrix on the right."""
        nodes, size = self.values.shape[:2]
        columns = matrix.shape[1]
        parts = matrix.reshape(size, nodes, 3, columns).transpose(1, 0, 2, 3).reshape(nodes, 3 * size, columns)
        product = self.values.reshape(nodes, 3 * size, 3 * size) @ parts
        return product.reshape(nodes, size, 3, columns).transpose(1, 0, 2, 3).reshape(matrix.shape)

    def after(self, matrix: Matrix) -> Matrix:
        """Product with a matrix on the left."""
        return NodeBlocks(self.values.transpose(0, 3, 4, 1, 2)).times(matrix.T).T

    def loop(self, flexibility: HarmonicBlocks) -> Matrix:
        """I - G K as a full matrix, G the flexibility."""
        first = flexibility.static.shape[0] // (3 * self.values.shape[0])
        upper = self._product(flexibility.static[None], self.values[:, :first])
        lower = self._product(flexibility.turning, self.values[:, first:])
        result = -np.concatenate([upper, lower])
        result[np.diag_indices_from(result)] += 1.0
        return result

    @staticmethod
    def _product(blocks: Matrix, rows: Matrix) -> Matrix:
        """Product of blocks (b, k, k) with the `rows` (n_c, b k / (3 n_c), 3, S, 3) of the nodes."""
        count, size, _ = blocks.shape
        nodes, _, _, columns, _ = rows.shape
        each = size // (3 * nodes)  # rows of harmonics in a block: one, or real and imaginary part
        left = blocks.reshape(count, size, each, nodes, 3).transpose(0, 3, 1, 2, 4)
        right = rows.reshape(nodes, count, 3 * each, 3 * columns).transpose(1, 0, 2, 3)
        product = left.reshape(count, nodes, size, 3 * each) @ right
        shape = count, nodes, size, columns, 3
        return product.reshape(shape).transpose(0, 2, 3, 1, 4).reshape(count * size, 3 * nodes * columns)
