"""Quadrature points on a contact face with the shape functions there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import REFERENCE_CORNERS, Discretisation, shape_functions

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh

Rule = tuple[NDArray[np.float64], NDArray[np.float64]]
_NORMALISED = 1e-12


@dataclass(frozen=True)
class FacePoints:
    """Quadrature points on one contact face.

    Attributes
    ----------
    position : (q, 3) array
        Points, m.
    area : (q,) array
        Their shares of the area, m^2.
    interpolation : (q, n) CSR matrix
        Shape functions N_j of the n mesh nodes at the points.
    """

    position: NDArray[np.float64]
    area: NDArray[np.float64]
    interpolation: csr_matrix


def face_points(discretisation: Discretisation, sector: SectorMesh, side: str, kind: str, rule: Rule) -> FacePoints:
    """Quadrature points on the face of a `side` ("right", "left").

    The rule, points (p,) and weights (p,) on [0, 1], is applied in both directions of each element's side.
    Raises RomParameterError, about the contact dofs of a `kind`, where the mesh has no node set of the face or no
    element has a side on it.
    """
    from scipy.sparse import vstack

    name = f"face_{side}"
    if name not in sector.node_sets:
        raise RomParameterError("rom", "contact_dofs", kind, f'needs a mesh with the node set "{name}"')
    on_face = np.zeros(discretisation.n_nodes, dtype=bool)
    on_face[discretisation.vertex_node[sector.node_sets[name]]] = True
    corner_on_face = on_face[discretisation.element_nodes[:, : len(REFERENCE_CORNERS)]]
    corners = np.array(REFERENCE_CORNERS)
    parts = []
    for axis in range(3):
        for end in (0, 1):
            elements = np.flatnonzero(corner_on_face[:, corners[:, axis] == end].all(axis=1))
            if len(elements):
                parts.append(_points_on_sides(discretisation, elements, axis, end, rule))
    if not parts:
        raise RomParameterError("rom", "contact_dofs", kind, f'needs elements with a side in the node set "{name}"')
    return FacePoints(
        np.concatenate([part.position for part in parts]),
        np.concatenate([part.area for part in parts]),
        vstack([part.interpolation for part in parts], format="csr"),
    )


def _points_on_sides(
    discretisation: Discretisation, elements: NDArray[np.int64], axis: int, end: int, rule: Rule
) -> FacePoints:
    """Points on the side at `end` (0, 1) of the reference `axis` of some elements (e,)."""
    from scipy.sparse import csr_matrix

    line, weight = rule
    x, y = np.meshgrid(line, line, indexing="ij")
    points = np.insert(np.stack([x.ravel(), y.ravel()]), axis, float(end), axis=0)
    weights = np.outer(weight, weight).ravel()
    values, _ = shape_functions(discretisation.element, points)
    geometry, slopes = shape_functions("hex8", points)
    corners = discretisation.corners[elements]
    first, second = (np.einsum("qc,eci->eqi", slopes[:, :, a], corners) for a in range(3) if a != axis)
    area = weights * np.linalg.norm(np.cross(first, second), axis=-1)
    nodes = discretisation.element_nodes[elements]
    shape = (len(elements), len(weights), nodes.shape[1])
    row = np.broadcast_to(np.arange(area.size).reshape(*area.shape, 1), shape)
    columns = np.broadcast_to(nodes[:, None, :], shape)
    entries = np.broadcast_to(values, shape)
    used = np.abs(entries) > _NORMALISED  # the other shape functions vanish on this side
    interpolation = csr_matrix((entries[used], (row[used], columns[used])), shape=(area.size, discretisation.n_nodes))
    return FacePoints(np.einsum("qc,eci->eqi", geometry, corners).reshape(-1, 3), area.ravel(), interpolation)
