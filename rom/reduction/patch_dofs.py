"""Averages of the displacement over the patches of a contact face.

Every contact node stands for a patch: the points of the face that are nearer to it than to any other contact node. On
the meshes of `geometry` the patches are equal parts of the face. The average over patch k is

    u_k = int_patch u dA / int_patch dA = sum_j W_kj u_j,       W_kj = int_patch N_j dA / int_patch dA,

with the shape functions N_j of the mesh nodes j. The force that does work with u_k is a uniform traction on the
patch: W^T spreads it over the nodes with the same resultant and the same moment about the patch's centroid W x.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import REFERENCE_CORNERS, Discretisation, shape_functions

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh

# Between two grid nodes the mesh has equal steps, so a patch ends on an edge or on the middle line of an element:
# with the points of a quarter of an element on one side of it the integrals are exact.
_QUARTER = 3  # Gauss points a direction: exact for quadratic shape functions on a bilinear face
_NORMALISED = 1e-12


def patch_averages(discretisation: Discretisation, sector: SectorMesh) -> csr_matrix:
    """W (2 n_c, n) of the patches of the right, then of the left face, from n mesh nodes; each row sums to 1.

    Raises RomParameterError where the mesh has no node sets of the faces, or a contact node has no patch on its face.
    """
    from scipy.sparse import vstack

    rows = []
    for side, face in (("right", sector.right), ("left", sector.left)):
        name = f"face_{side}"
        if name not in sector.node_sets:
            raise RomParameterError("rom", "contact_dofs", "patch", f'needs a mesh with the node set "{name}"')
        rows.append(_averages(discretisation, sector.node_sets[name], face.position))
    return vstack(rows, format="csr")


def _averages(
    discretisation: Discretisation, vertices: NDArray[np.int64], centres: NDArray[np.float64]
) -> csr_matrix:
    """W (n_c, n) of one face; `vertices` (v,) of the mesh on it, contact nodes at `centres` (n_c, 3) in m."""
    from scipy.sparse import csr_matrix, diags

    on_face = np.zeros(discretisation.n_nodes, dtype=bool)
    on_face[discretisation.vertex_node[vertices]] = True
    corner_on_face = on_face[discretisation.element_nodes[:, : len(REFERENCE_CORNERS)]]
    total = csr_matrix((len(centres), discretisation.n_nodes))
    corners = np.array(REFERENCE_CORNERS)
    for axis in range(3):
        for end in (0, 1):
            elements = np.flatnonzero(corner_on_face[:, corners[:, axis] == end].all(axis=1))
            if len(elements):
                total = total + _integrals(discretisation, elements, axis, end, centres)
    area = np.asarray(total.sum(axis=1)).ravel()
    if not np.all(area > _NORMALISED * area.max(initial=0.0)):
        node = int(np.argmin(area))
        raise RomParameterError("rom", "contact_dofs", "patch", f"needs a face around contact node {node}")
    return (diags(1.0 / area) @ total).tocsr()


def _integrals(
    discretisation: Discretisation, elements: NDArray[np.int64], axis: int, end: int, centres: NDArray[np.float64]
) -> csr_matrix:
    """int N_j dA (n_c, n) [m^2] over the side at `end` (0, 1) of the reference `axis` of some elements (e,)."""
    from scipy.sparse import csr_matrix
    from scipy.spatial import cKDTree

    points, weights = _quarters()
    points = np.insert(points, axis, float(end), axis=0)
    values, _ = shape_functions(discretisation.element, points)
    geometry, slopes = shape_functions("hex8", points)
    corners = discretisation.corners[elements]
    places = np.einsum("qc,eci->eqi", geometry, corners)
    first, second = (np.einsum("qc,eci->eqi", slopes[:, :, a], corners) for a in range(3) if a != axis)
    area = weights * np.linalg.norm(np.cross(first, second), axis=-1)
    owner = cKDTree(centres).query(places)[1]
    nodes = discretisation.element_nodes[elements]
    shape = (len(elements), len(weights), nodes.shape[1])
    rows, columns = np.broadcast_to(owner[:, :, None], shape), np.broadcast_to(nodes[:, None, :], shape)
    used = np.broadcast_to(np.abs(values) > _NORMALISED, shape)  # the other shape functions vanish on this side
    entries = area[:, :, None] * values
    return csr_matrix((entries[used], (rows[used], columns[used])), shape=(len(centres), discretisation.n_nodes))


def _quarters() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss points (2, q) and weights (q,) of the four quarters of the unit square."""
    point, weight = np.polynomial.legendre.leggauss(_QUARTER)
    line = np.concatenate([0.25 + 0.25 * point, 0.75 + 0.25 * point])
    weights = np.concatenate([weight, weight]) / 4.0
    x, y = np.meshgrid(line, line, indexing="ij")
    return np.stack([x.ravel(), y.ravel()]), np.outer(weights, weights).ravel()
