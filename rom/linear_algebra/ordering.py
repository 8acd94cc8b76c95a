"""Fill-reducing order of the unknowns of a large mesh: nested dissection by METIS.

References
----------
G. Karypis, V. Kumar, A fast and high quality multilevel scheme for partitioning irregular graphs,
SIAM J. Sci. Comput. 20 (1998) 359-392.
"""

from __future__ import annotations

import importlib.util
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

# Below this size minimum degree is as good and METIS takes longer than it saves (docs/dependencies.md).
DISSECT_FROM = 60_000
_PER_NODE = 3  # unknowns, ordered node by node


def nested_dissection(matrix: csr_matrix) -> NDArray[np.int64] | None:
    """Elimination order (n,) of the unknowns of a symmetric matrix; None where METIS does not pay.

    There are three unknowns for each node; the nodes are ordered, and their unknowns with them. None for a small
    matrix, for a number of unknowns that is not a multiple of three, and where the package pymetis is missing.
    """
    size = matrix.shape[0]
    if size < DISSECT_FROM or size % _PER_NODE or importlib.util.find_spec("pymetis") is None:
        return None
    import pymetis

    starts, neighbours = _node_graph(matrix)
    order, _ = pymetis.nested_dissection(pymetis.CSRAdjacency(starts, neighbours))
    return (_PER_NODE * np.asarray(order)[:, None] + np.arange(_PER_NODE)).ravel()


def _node_graph(matrix: csr_matrix) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Adjacency of the nodes in compressed form: where the list of each node starts (n + 1,), and all lists."""
    from scipy.sparse import csr_matrix

    entries = np.ones(matrix.nnz, dtype=np.int8)
    pattern = csr_matrix((entries, matrix.indices, matrix.indptr), shape=matrix.shape)
    blocks = pattern.tobsr(blocksize=(_PER_NODE, _PER_NODE))
    count = matrix.shape[0] // _PER_NODE
    nodes = np.repeat(np.arange(count, dtype=np.int32), np.diff(blocks.indptr))
    others = blocks.indices != nodes
    starts = np.concatenate([[0], np.cumsum(np.bincount(nodes[others], minlength=count))])
    return starts.astype(np.int32), blocks.indices[others].astype(np.int32)
