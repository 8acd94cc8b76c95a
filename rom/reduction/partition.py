"""Matrices of the mesh partitioned at the boundary dofs.

With averaged contact dofs the variables z of the displacements u = T z hold the averages in the places of a few nodes
p. T is the identity but for their rows. On the interior i, with the selections J of its unknowns and P of those of p,
T_i = J + P W, so that

    (T^T A T)_ii = J^T A J + C + C^T,    C = (J^T A P + W^T A_pp / 2) W,

where only the first term has the size of the mesh.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from rom.reduction.boundary_dofs import BoundaryDofs


def partitioned(
    matrix: csr_matrix, interior: NDArray[np.int64], boundary: BoundaryDofs, per_node: int
) -> tuple[csr_matrix, csr_matrix, csr_matrix]:
    """Blocks ii, ib and bb of T^T A T for a symmetric A with `per_node` unknowns for each node of the mesh.

    The boundary unknowns are along x, y, z, not in their frames.
    """
    inside = _unknowns(interior, per_node)
    rows = matrix[inside]
    if boundary.variables is None:
        held = _unknowns(boundary.nodes, per_node)
        return rows[:, inside], rows[:, held], matrix[held][:, held]
    at_boundary = _for_each(boundary.variables[:, boundary.nodes], per_node)
    product = (matrix @ at_boundary).tocsr()
    replaced = boundary.nodes[: 2 * boundary.n_contacts]
    weights = _for_each(boundary.variables[replaced][:, interior], per_node)
    p = _unknowns(replaced, per_node)
    correction = ((rows[:, p] + 0.5 * (weights.T @ matrix[p][:, p])) @ weights).tocsr()
    correction = (correction + correction.T).tocsr()
    correction.sum_duplicates()
    return (
        _added(rows[:, inside], correction),
        (product[inside] + weights.T @ product[p]).tocsr(),
        (at_boundary.T @ product).tocsr(),
    )


def _added(matrix: csr_matrix, correction: csr_matrix) -> csr_matrix:
    """Sum of a matrix (n, n) and one with few rows that are not empty; the other rows are only copied."""
    from scipy.sparse import csr_matrix

    changed = np.flatnonzero(np.diff(correction.indptr))
    sums = (matrix[changed] + correction[changed]).tocsr()
    lengths = np.diff(matrix.indptr)
    lengths[changed] = np.diff(sums.indptr)
    starts = np.concatenate([[0], np.cumsum(lengths)]).astype(matrix.indptr.dtype)
    before, after = matrix.indptr[np.append(changed, matrix.shape[0])], np.append(0, matrix.indptr[changed + 1])

    def joined(of_matrix: NDArray[np.generic], of_sums: NDArray[np.generic]) -> NDArray[np.generic]:
        pieces = [of_matrix[after[0] : before[0]]]
        for k in range(len(changed)):
            pieces += [of_sums[sums.indptr[k] : sums.indptr[k + 1]], of_matrix[after[k + 1] : before[k + 1]]]
        return np.concatenate(pieces)

    arrays = joined(matrix.data, sums.data), joined(matrix.indices, sums.indices), starts
    return csr_matrix(arrays, shape=matrix.shape)


def _unknowns(nodes: NDArray[np.int64], per_node: int) -> NDArray[np.int64]:
    """Numbers of the unknowns of nodes (k,)."""
    return (per_node * nodes[:, None] + np.arange(per_node)).ravel()


def _for_each(matrix: csr_matrix, per_node: int) -> csr_matrix:
    """A matrix between nodes, for each of their unknowns alike."""
    from scipy.sparse import identity, kron

    return kron(matrix, identity(per_node), format="csr")
