"""From reduced coordinates to displacements of the mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.reduced_model import ReducedModel
from rom.errors import ReducedModelError


def expand_to_mesh(model: ReducedModel, coordinates: NDArray[Any]) -> NDArray[Any]:
    """Displacements of all mesh nodes from reduced coordinates, u = basis q.

    Parameters
    ----------
    model : ReducedModel
        A model with its basis.
    coordinates : (..., n) array
        Reduced coordinates q, real or complex.

    Returns
    -------
    (..., n_nodes, 3) array
        Displacements in m. The mesh vertices are the first nodes, in their own order; mid-side nodes follow.

    Raises
    ------
    ReducedModelError
        The model was stored without its basis, or the basis is not that of a mesh.

    Examples
    --------
    >>> from rom import ReducedModel, expand_to_mesh
    >>> up, one = np.array([[0.0], [0.0], [1.0]]), np.ones(1)
    >>> basis = np.vstack([0 * up, up])  # node 0 is held, node 1 moves along z
    >>> model = ReducedModel(np.eye(1), np.eye(1), up, np.zeros((1, 3)), one, {"tip": one}, basis=basis)
    >>> print(expand_to_mesh(model, [0.002]))
    [[0.    0.    0.   ]
     [0.    0.    0.002]]
    """
    if model.basis is None:
        raise ReducedModelError(
            "basis: missing, allowed: a model reduced with it (`shroud run SCENE --until render`, or store_basis)"
        )
    if model.basis.shape[0] % 3:
        raise ReducedModelError(f"basis: {model.basis.shape[0]} rows, allowed: three for each node of a mesh")
    coordinates = np.asarray(coordinates)
    return (coordinates @ model.basis.T).reshape(*coordinates.shape[:-1], -1, 3)
