"""Fill-reducing order of the unknowns of a large mesh: nested dissection by METIS.

References
----------
G. Karypis, V. Kumar, A fast and high quality multilevel scheme for partitioning irregular graphs,
SIAM J. Sci. Comput. 20 (1998) 359-392.
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.linear_algebra.threads import SHARED_FROM

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

# Below this size minimum degree is as good and METIS takes longer than it saves (docs/developers/dependencies.md).
DISSECT_FROM = 60_000
BISECT_FROM = SHARED_FROM
_PER_NODE = 3  # unknowns, ordered node by node


@dataclass(frozen=True)
class Bisection:
    """A separator that cuts the unknowns of a symmetric matrix into two halves without couplings."""

    # (a,), unknowns of each half, in an order of elimination by nested dissection
    halves: tuple[NDArray[np.int64], NDArray[np.int64]]
    separator: NDArray[np.int64]  # (s,), the other unknowns, ascending


def nested_dissection(matrix: csr_matrix, from_size: int | None = None) -> NDArray[np.int64] | None:
    """Elimination order (n,) of the unknowns of a symmetric matrix; None where METIS does not pay.

    There are three unknowns for each node; the nodes are ordered, and their unknowns with them. None for a matrix of
    fewer than `from_size` unknowns (by default `DISSECT_FROM`), for a number of unknowns that is not a multiple of
    three, and where pymetis is missing.
    """
    if matrix.shape[0] < (DISSECT_FROM if from_size is None else from_size) or not _can_dissect(matrix):
        return None
    return _unknowns(_dissected(*_node_graph(matrix)))


def bisection(matrix: csr_matrix) -> Bisection | None:
    """A cut of the unknowns of a symmetric matrix into halves of like size; None as in `nested_dissection`.

    METIS cuts the graph of the nodes with few edges between both parts. The separator are the nodes of one part that
    have neighbours in the other, of the part that has fewer of them. None too where a half is empty.
    """
    if matrix.shape[0] < BISECT_FROM or not _can_dissect(matrix):
        return None
    import pymetis

    starts, neighbours = _node_graph(matrix)
    _, part = pymetis.part_graph(2, pymetis.CSRAdjacency(starts, neighbours))
    side = np.asarray(part)
    node = np.repeat(np.arange(len(side)), np.diff(starts))
    crossing = node[side[node] != side[neighbours]]
    edges = [np.unique(crossing[side[crossing] == k]) for k in (0, 1)]
    separator = min(edges, key=len)
    side[separator] = 2
    halves = [np.flatnonzero(side == k) for k in (0, 1)]
    if not all(map(len, (separator, *halves))):
        return None
    first, second = (_unknowns(half[_dissected(*_part_of_graph(starts, neighbours, half))]) for half in halves)
    return Bisection((first, second), _unknowns(separator))


def _can_dissect(matrix: csr_matrix) -> bool:
    """Whether there are three unknowns for each node, and the package that dissects."""
    return matrix.shape[0] % _PER_NODE == 0 and importlib.util.find_spec("pymetis") is not None


def _unknowns(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Unknowns of nodes, in their order."""
    return (_PER_NODE * nodes[:, None] + np.arange(_PER_NODE)).ravel()


def _dissected(starts: NDArray[np.int32], neighbours: NDArray[np.int32]) -> NDArray[np.int64]:
    """Order of the nodes of a graph in compressed form by nested dissection."""
    import pymetis

    order, _ = pymetis.nested_dissection(pymetis.CSRAdjacency(starts, neighbours))
    return np.asarray(order, dtype=np.int64)


def _part_of_graph(
    starts: NDArray[np.int32], neighbours: NDArray[np.int32], nodes: NDArray[np.int64]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The graph of some nodes (k,) alone, numbered in their order."""
    from scipy.sparse import csr_matrix

    count = len(starts) - 1
    graph = csr_matrix((np.ones(len(neighbours), np.int8), neighbours, starts), shape=(count, count))
    part = graph[nodes][:, nodes]
    return part.indptr.astype(np.int32), part.indices.astype(np.int32)


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
