"""Sparse matrices over pairs of nodes: one sparsity pattern for all matrices, filled component by component."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


# Components (i, j) on and above the diagonal of a 3 x 3 block; the others follow from symmetry.
UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))


@dataclass(frozen=True)
class NodePattern:
    """CSR pattern of the p node pairs that share an element, each row sorted."""

    indptr: NDArray[np.int32]  # (n + 1,), the CSR pattern
    indices: NDArray[np.int32]  # (n + 1,), the CSR pattern
    keys: NDArray[np.int64]  # (p,), row * n + column of each pair, ascending: a pair is found by bisection

    @property
    def n_pairs(self) -> int:
        """Number of stored node pairs."""
        return len(self.indices)

    def locate(self, element_nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        """Slots (e b b,) of the pairs (row node, column node) of elements given as (e, b) nodes."""
        n = len(self.indptr) - 1
        return np.searchsorted(self.keys, (element_nodes[:, :, None] * n + element_nodes[:, None, :]).ravel())

    def transposed_slots(self) -> NDArray[np.int64]:
        """Slot of pair (b, a) for every pair (a, b), shape (p,)."""
        from scipy.sparse import csr_matrix

        n = len(self.indptr) - 1
        slots = csr_matrix((np.arange(self.n_pairs), self.indices, self.indptr), shape=(n, n))
        return slots.tocsc().data  # column by column, rows ascending: the pairs of the transposed pattern in order

    def symmetric_matrix(self, upper: NDArray[np.float64]) -> csr_matrix:
        """CSR matrix (3n, 3n) from the components `UPPER` (6, p) of the block of every pair."""
        swap = self.transposed_slots()
        blocks = np.empty((self.n_pairs, 3, 3))
        for row, (i, j) in enumerate(UPPER):
            if i == j:
                # The round-off of batched products is not symmetric, but factorisation and modes rely on symmetry.
                blocks[:, i, i] = 0.5 * (upper[row] + upper[row][swap])
            else:
                blocks[:, i, j] = upper[row]
                blocks[:, j, i] = upper[row][swap]
        return self.block_matrix(blocks)

    def block_matrix(self, blocks: NDArray[np.float64]) -> csr_matrix:
        """CSR matrix (3n, 3n) from one 3 x 3 block for each pair, (p, 3, 3); dofs are node-major x, y, z."""
        from scipy.sparse import bsr_matrix

        n = 3 * (len(self.indptr) - 1)
        return bsr_matrix((blocks, self.indices, self.indptr), shape=(n, n)).tocsr()

    def isotropic_matrix(self, values: NDArray[np.float64]) -> csr_matrix:
        """CSR matrix (3n, 3n) with values (p,) times the 3 x 3 identity as blocks, off-diagonal zeros not stored."""
        from scipy.sparse import csr_matrix, identity, kron

        n = len(self.indptr) - 1
        return kron(csr_matrix((values, self.indices, self.indptr), shape=(n, n)), identity(3), format="csr")


def node_pattern(tables: Sequence[NDArray[np.int64]], n_nodes: int) -> NodePattern:
    """Pattern of all node pairs of elements, given as tables (E, b) of nodes; symmetric, each row sorted."""
    from scipy.sparse import csr_matrix

    nodes = np.concatenate([table.ravel() for table in tables])
    starts = np.concatenate([[0], *(np.full(len(table), table.shape[1]) for table in tables)]).cumsum()
    incidence = csr_matrix((np.ones(len(nodes), dtype=np.int32), nodes, starts), shape=(len(starts) - 1, n_nodes))
    pairs = (incidence.T @ incidence).tocsr()
    pairs.sort_indices()
    keys = np.repeat(np.arange(n_nodes), np.diff(pairs.indptr)) * n_nodes + pairs.indices
    # 32-bit indices make every product with the matrices, which is bound by memory, a quarter faster.
    return NodePattern(pairs.indptr.astype(np.int32), pairs.indices.astype(np.int32), keys)
