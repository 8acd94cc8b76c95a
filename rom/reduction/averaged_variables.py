"""Averages of the displacement as variables of the full model, each in the place of the displacement of one node.

With the averages W u among the variables the reduction needs no change: they are held, are coordinates and are loaded
like nodes. The condition W u = u_k is solved for as many nodes p as there are averages,
u_p = W_p^-1 (u_k - W_r u_r). This is a change of variables u = T z that is the identity but for the rows of those
nodes. The choice of the nodes changes the variables, not the model; with large shares W_p is well conditioned.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_DEPENDENT = 1e-6


def averaged_variables(
    averages: csr_matrix, reserved: NDArray[np.int64], kind: str
) -> tuple[NDArray[np.int64], csr_matrix]:
    """Nodes (k,) in whose places the averages W u stand, and T (n, n) with displacements u = T z, for x, y, z alike.

    z holds at those nodes the averages, elsewhere the displacement. W has the shape (k, n); the
    displacement of the `reserved` nodes stays a variable. Raises RomParameterError, about contact dofs of a `kind`,
    where the averages are linearly dependent on this mesh.
    """
    from scipy.linalg import qr
    from scipy.sparse import coo_matrix

    count, n = averages.shape
    candidates = np.setdiff1d(np.unique(averages.indices), reserved)
    triangle, order = qr(averages[:, candidates].toarray(), mode="r", pivoting=True)
    diagonal = np.abs(np.diag(triangle))
    if len(candidates) < count or diagonal.min() < _DEPENDENT * diagonal.max():
        allowed = "needs a finer mesh or fewer contact nodes: these averages depend on each other"
        raise RomParameterError("rom", "contact_dofs", kind, allowed)
    nodes = candidates[order[:count]]
    others = np.setdiff1d(np.unique(averages.indices), nodes)
    own = np.linalg.inv(averages[:, nodes].toarray())
    block = np.hstack([own, -own @ averages[:, others].toarray()])
    used, plain = np.concatenate([nodes, others]), np.setdiff1d(np.arange(n), nodes)
    rows = np.concatenate([plain, np.repeat(nodes, len(used))])
    columns = np.concatenate([plain, np.tile(used, count)])
    change = coo_matrix((np.concatenate([np.ones(len(plain)), block.ravel()]), (rows, columns)), shape=(n, n)).tocsr()
    change.eliminate_zeros()  # averages of one face do not depend on the other face
    return nodes, change
