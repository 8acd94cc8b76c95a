"""Quadrature points on a contact face with the shape functions there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from geometry import sides_on
from rom.errors import RomParameterError
from rom.finite_elements.discretisation import Discretisation
from rom.finite_elements.side_integrals import Rule, SidePoints, points_on_sides

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh

_NORMALISED = 1e-12


@dataclass(frozen=True)
class FacePoints:
    """Quadrature points on one contact face."""

    position: NDArray[np.float64]  # (q, 3), points, m
    area: NDArray[np.float64]  # (q,), their shares of the area, m^2
    interpolation: csr_matrix  # (q, n), shape functions N_j of the n mesh nodes at the points


def face_points(discretisation: Discretisation, sector: SectorMesh, side: str, kind: str, rule: Rule) -> FacePoints:
    """Quadrature points on the face of a `side` ("right", "left").

    The face is the surface of that name where the mesh has one, else the sides of elements between the nodes of the
    node set. The rule, points (p,) and weights (p,) on [0, 1], is applied in both directions of each side.
    Raises RomParameterError, about the contact dofs of a `kind`, where the mesh has no node set of the face or no
    element has a side on it.
    """
    from scipy.sparse import vstack

    name = f"face_{side}"
    if name not in sector.node_sets and name not in sector.surfaces:
        raise RomParameterError("rom", "contact_dofs", kind, f'needs a mesh with the node set "{name}"')
    face = sector.surfaces.get(name)
    if face is None:
        face = sides_on(sector.blocks, np.asarray(sector.node_sets[name]))
    parts = [_interpolated(discretisation, points) for points in points_on_sides(discretisation, face, rule)]
    if not parts:
        raise RomParameterError("rom", "contact_dofs", kind, f'needs elements with a side in the node set "{name}"')
    return FacePoints(
        np.concatenate([part.position for part in parts]),
        np.concatenate([part.area for part in parts]),
        vstack([part.interpolation for part in parts], format="csr"),
    )


def _interpolated(discretisation: Discretisation, points: SidePoints) -> FacePoints:
    """The points with the matrix of their shape functions."""
    from scipy.sparse import csr_matrix

    area = points.area
    shape = (*area.shape, points.nodes.shape[1])
    row = np.broadcast_to(np.arange(area.size).reshape(*area.shape, 1), shape)
    columns = np.broadcast_to(points.nodes[:, None, :], shape)
    entries = np.broadcast_to(points.values, shape)
    used = np.abs(entries) > _NORMALISED  # the other shape functions vanish on this side
    interpolation = csr_matrix((entries[used], (row[used], columns[used])), shape=(area.size, discretisation.n_nodes))
    return FacePoints(points.position.reshape(-1, 3), area.ravel(), interpolation)
