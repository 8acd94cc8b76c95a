"""Averages of the displacement over the patches of a contact face.

Every contact node stands for a patch: the points of the face that are nearer to it than to any other contact node. On
the meshes of `geometry` the patches are equal parts of the face. The average over patch k is

    u_k = int_patch u dA / int_patch dA = sum_j W_kj u_j,       W_kj = int_patch N_j dA / int_patch dA,

with the shape functions N_j of the mesh nodes j. The force that does work with u_k is a uniform traction on the
patch: W^T spreads it over the nodes with the same resultant and the same moment about the patch's centroid W x.
Springs at n equal patches along an edge lose 1/n^2 of the rotational stiffness of the face.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import Discretisation
from rom.reduction.face_integrals import FacePoints, Rule, face_points
from rom.reduction.static_equivalence import opposite_points, with_points_at

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh

# Between two grid nodes the mesh has equal steps, so a patch ends on an edge or on the middle line of an element:
# with the points of a quarter of an element on one side of it the integrals are exact.
_QUARTER = 3  # Gauss points a direction: exact for quadratic shape functions on a bilinear face
_NORMALISED = 1e-12


def patch_averages(discretisation: Discretisation, sector: SectorMesh) -> csr_matrix:
    """W (2 n_c, n) of the patches of the right, then of the left face, from n mesh nodes; each row sums to 1.

    On faces whose meshes differ the left patches get linear weights with the centroids of the right patches turned
    back by one pitch.
    Raises RomParameterError where the mesh has no node sets of the faces, or a contact node has no patch on its face.
    """
    from scipy.sparse import vstack

    rows: list[csr_matrix] = []
    for side, face in (("right", sector.right), ("left", sector.left)):
        points = face_points(discretisation, sector, side, "patch", _halves())
        owner = _owner(points, face.position)
        average = _averages(points, owner, len(face.position))
        if rows:
            targets = opposite_points(rows[0] @ discretisation.positions, sector)
            average = with_points_at(average, targets, discretisation.positions, points, owner)
        rows.append(average)
    return vstack(rows, format="csr")


def _owner(points: FacePoints, centres: NDArray[np.float64]) -> NDArray[np.int64]:
    """The contact node (q,) that each quadrature point is nearest to, of those at `centres` (n_c, 3) in m."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(centres).query(points.position)[1], dtype=np.int64)


def _averages(points: FacePoints, owner: NDArray[np.int64], count: int) -> csr_matrix:
    """W (n_c, n) of one face with `count` contact nodes."""
    from scipy.sparse import csr_matrix

    area = np.bincount(owner, points.area, count)
    if not np.all(area > _NORMALISED * area.max(initial=0.0)):
        node = int(np.argmin(area))
        raise RomParameterError("rom", "contact_dofs", "patch", f"needs a face around contact node {node}")
    share = csr_matrix((points.area / area[owner], (owner, np.arange(len(owner)))), shape=(count, len(owner)))
    return (share @ points.interpolation).tocsr()


def _halves() -> Rule:
    """Gauss points (p,) and weights (p,) of the two halves of [0, 1]."""
    point, weight = np.polynomial.legendre.leggauss(_QUARTER)
    return np.concatenate([0.25 + 0.25 * point, 0.75 + 0.25 * point]), np.concatenate([weight, weight]) / 4.0
