"""Contact motions, outputs and excitation of a reduced model, selected from its boundary dofs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rom.reduction.boundary_dofs import BoundaryDofs
from rom.reduction.substructure import Substructure


def load_selection(parts: Substructure, shapes: NDArray[np.float64]) -> dict[str, Any]:
    """Contact motions, outputs and forces of a model with the boundary dofs and shapes (3i, m) of the interior."""
    b = parts.boundary.size
    selected = boundary_selection(parts.boundary, np.eye(b, b + shapes.shape[1]))
    return selected if parts.loads is None else parts.loads.selection(selected, parts.constraint, shapes)


def boundary_selection(boundary: BoundaryDofs, motion: NDArray[np.float64]) -> dict[str, Any]:
    """Contact motions, outputs and excitation in n reduced coordinates, by argument of `ReducedModel`.

    motion (b, n): the boundary dofs, in their frames, for unit reduced coordinates.
    """
    load = boundary.direction @ boundary.node_displacement(boundary.loaded) @ motion
    tip = boundary.node_displacement(boundary.tip) @ motion
    right, left = motion[: 6 * boundary.n_contacts].reshape(2, 3 * boundary.n_contacts, -1)
    interface = boundary.interface
    inner = motion[boundary.size - interface.size :] if interface is not None else motion[:0]
    return {
        "cyclic_right": None if interface is None else interface.right @ inner,
        "cyclic_left": None if interface is None else interface.left @ inner,
        "contact_right": right,
        "contact_left": left,
        "force_excitation": load,
        "outputs": {"tip": load, "tip_x": tip[0], "tip_y": tip[1], "tip_z": tip[2]},
    }
