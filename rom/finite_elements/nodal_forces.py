"""Forces on nodes of the full model as vectors, and the displacement of a node or the mean of several as rows.

The mean displacement along d of the nodes of a set is the row of the force 1 N along d shared by them: both are the
same vector.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import RomParameterError
from rom.finite_elements.full_model import FullModel, node_dofs

Vector = NDArray[np.float64] | NDArray[np.complex128]


def nodal_force(full: FullModel, nodes: ArrayLike, forces: ArrayLike) -> Vector:
    """The vector of forces on nodes; forces on one node add up.

    Parameters
    ----------
    full : FullModel
        The full model.
    nodes : (k,) sequence of int
        Nodes of the full model; of a mesh vertex v that is ``full.vertex_node[v]``.
    forces : (3,) or (k, 3) sequence
        Forces x, y, z on each of the nodes, N, real or complex; one for all nodes, or one for each.

    Returns
    -------
    (N,) array
        The force on each dof, N. What acts on clamped dofs goes into the support.

    Raises
    ------
    RomParameterError
        A node is not one of the model, or a force is not finite.

    Examples
    --------
    A force of 1 N shared by two nodes:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble, nodal_force
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(1, 1)))
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> print(nodal_force(full, [3, 5], [0.0, 0.5, 0.0]).sum())
    1.0
    """
    chosen = np.asarray(nodes, dtype=np.int64).reshape(-1)
    values = np.asarray(forces)
    if len(chosen) == 0 or chosen.min() < 0 or chosen.max() >= len(full.positions):
        raise RomParameterError("force", "nodes", len(chosen), f"must be nodes 0 to {len(full.positions) - 1}")
    if values.shape not in ((3,), (len(chosen), 3)) or not np.all(np.isfinite(values)):
        raise RomParameterError("force", "forces", values.shape, "must be three finite numbers, or three a node")
    vector = np.zeros(full.n_dofs, dtype=complex if np.iscomplexobj(values) else float)
    np.add.at(vector, node_dofs(chosen), np.broadcast_to(values, (len(chosen), 3)))
    return vector


def nearest_vertices(full: FullModel, positions: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The mesh vertices nearest to some points, as nodes of the full model.

    Parameters
    ----------
    full : FullModel
        The full model.
    positions : (k, 3) sequence of float
        Points, m.

    Returns
    -------
    nodes : (k,) array
        Nodes of the full model.
    distance : (k,) array
        Distances to them, m.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble, nearest_vertices
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02, contact_grid=(1, 1)))
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> nodes, distance = nearest_vertices(full, [[0.0, 0.0, 0.401]])
    >>> full.positions[nodes].round(6).tolist(), distance.round(6).tolist()
    ([[0.0, 0.0, 0.4]], [0.001])
    """
    from scipy.spatial import cKDTree

    distance, vertices = cKDTree(full.positions[full.vertex_node]).query(np.asarray(positions, dtype=float))
    return np.asarray(full.vertex_node[vertices], dtype=np.int64), np.asarray(distance)
