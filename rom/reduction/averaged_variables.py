"""Averages of the displacement as variables of the full model, each in the place of the displacement of one node.

With the averages W u for variables the reduction needs nothing new: they are held, kept and loaded like nodes. The
condition W u = u_k is solved for as many nodes p as there are averages, u_p = W_p^-1 (u_k - W_r u_r): a change of
variables u = T z that is the identity but for the rows of those nodes. Which nodes they are changes the variables,
not the model; those with the largest share keep W_p well conditioned.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_DEPENDENT = 1e-6


def averaged_variables(averages: csr_matrix, taken: NDArray[np.int64]) -> tuple[NDArray[np.int64], csr_matrix]:
    """Nodes (k,) in whose places the averages W (k, n) stand, and T (3n, 3n) with displacements u = T z.

    z holds at those nodes the averages (x, y, z), elsewhere the displacement. taken: nodes whose displacement must
    stay a variable. Raises RomParameterError where the mesh cannot tell the averages from each other.
    """
    from scipy.linalg import qr
    from scipy.sparse import coo_matrix, identity, kron

    count, n = averages.shape
    candidates = np.setdiff1d(np.unique(averages.indices), taken)
    triangle, order = qr(averages[:, candidates].toarray(), mode="r", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    if len(candidates) < count or diagonal.min() < _DEPENDENT * diagonal.max():
        allowed = "needs a finer mesh or fewer contact nodes: these averages depend on each other"
        raise RomParameterError("rom", "contact_dofs", "patch", allowed)
    nodes = candidates[order[:count]]
    others = np.setdiff1d(np.unique(averages.indices), nodes)
    own = np.linalg.inv(averages[:, nodes].toarray())
    block = np.hstack([own, -own @ averages[:, others].toarray()])
    used, plain = np.concatenate([nodes, others]), np.setdiff1d(np.arange(n), nodes)
    rows = np.concatenate([plain, np.repeat(nodes, len(used))])
    columns = np.concatenate([plain, np.tile(used, count)])
    change = coo_matrix((np.concatenate([np.ones(len(plain)), block.ravel()]), (rows, columns)), shape=(n, n)).tocsr()
    change.eliminate_zeros()  # one face has no part in the other
    return nodes, kron(change, identity(3), format="csr")
