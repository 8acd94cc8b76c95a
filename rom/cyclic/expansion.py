"""From reduced coordinates back to the mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.reduced_model import ReducedModel, ReducedModelError


def expand(model: ReducedModel, coordinates: NDArray[Any]) -> NDArray[Any]:
    """Displacements (..., n_nodes, 3) [m] of all nodes from reduced coordinates (..., n), real or complex.

    The mesh vertices are the first nodes, in their own order; mid-side nodes follow.
    Raises ReducedModelError when the model was stored without its basis or that is none of a mesh.
    """
    if model.basis is None:
        raise ReducedModelError(
            "basis: missing, allowed: a model reduced with it (a scene with [render], store_basis)"
        )
    if model.basis.shape[0] % 3:
        raise ReducedModelError(f"basis: {model.basis.shape[0]} rows, allowed: three for each node of a mesh")
    coordinates = np.asarray(coordinates)
    return (coordinates @ model.basis.T).reshape(*coordinates.shape[:-1], -1, 3)
