"""Quadrature points on a contact face with the shape functions there.

Two faces with different meshes get the same points, so that forces there are equivalent. A force f on contact point k
goes to the nodes of a face by the weights W_kj. Its resultant is f where sum_j W_kj = 1, and its moment is that of f
at the point sum_j W_kj x_j. On meshes that differ these points differ a little. With functions phi_k of a small
correction

    W_kj + int phi_k N_j dA,    phi_k = a_k + b_k . x,    int phi_k dA = 0,    int phi_k x dA = x_k - sum_j W_kj x_j,

the left points are the right ones turned back by one pitch, and contact forces have the same resultant and the same
moment on both faces. Where the faces are apart, the distance along the normal stays: there the moment is that of the
gap.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from geometry.elements import sides_on
from geometry.frames import rotate_about_axis
from rom.errors import RomParameterError
from rom.finite_elements.discretisation import Discretisation, Rule, SidePoints, points_on_sides

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry.sector import ContactFace, SectorMesh

_NORMALISED = 1e-12
Array = NDArray[np.float64]
_EQUAL = 1e-10  # points this near to each other, over the size of the face, are the same
_INDEPENDENT = 1e-6  # directions in which the contact nodes spread less, over the others, carry no linear function
_SMALL = 0.3  # largest correction, over the spread of the points that carry it, in each principal direction


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


def sides_of(sector: SectorMesh) -> list[tuple[str, ContactFace]]:
    """The faces of a sector seen from one pair, by the side; the ground has none."""
    faces = [("right", sector.right), ("left", sector.left)]
    return faces[:1] if sector.kind == "ground" else faces


def opposite_points(position: Array, sector: SectorMesh) -> Array:
    """Points (k, 3) of the left face that lie opposite points of the right face.

    Between neighbours they are turned back by one pitch; where the contact nodes of the left face stand beside the
    right ones so turned, as with a gap along the circumference, they are moved as those are, by a linear function of
    the position.
    """
    there, known = (rotate_about_axis(each, -sector.turn) for each in (position, sector.right.position))
    shift = sector.left.position - known
    if np.abs(shift).max() <= _EQUAL * float(np.sqrt(sector.right.area.sum())):
        return there
    centre = known.mean(axis=0)
    basis = [np.column_stack([np.ones(len(each)), each - centre]) for each in (known, there)]
    return there + basis[1] @ np.linalg.lstsq(basis[0], shift, rcond=_INDEPENDENT)[0]


def with_points_at(
    weights: csr_matrix, targets: Array, nodes: Array, points: FacePoints, owner: NDArray[np.int64] | None = None
) -> csr_matrix:
    """Weights (n_c, n) corrected so that sum_j W_kj x_j are the targets (n_c, 3), m.

    `nodes` (n, 3) are the positions x_j. The correction of contact node k is spread over the quadrature points that
    it owns, `owner` (q,); what these cannot carry, or without `owner` all, is spread over the whole face. Weights
    whose points are the targets already stay as they are, bit for bit.
    """
    from scipy.sparse import csr_matrix

    size = float(np.sqrt(points.area.sum()))
    for owned in (owner, None) if owner is not None else (None,):
        offset = targets - weights @ nodes
        if np.abs(offset).max() <= _EQUAL * size:
            break
        share = _shares(offset, points, owned)
        weights = (weights + csr_matrix(share) @ points.interpolation).tocsr()
    return weights


def _shares(offset: Array, points: FacePoints, owner: NDArray[np.int64] | None) -> Array:
    """phi_k dA (n_c, q) at the quadrature points that move the points of the weights by offsets (n_c, 3)."""
    share = np.zeros((len(offset), len(points.area)))
    for k in range(len(offset)):
        chosen = np.arange(len(points.area)) if owner is None else np.flatnonzero(owner == k)
        share[k, chosen] = _correction(points.position[chosen], points.area[chosen], offset[k])
    return share


def _correction(position: Array, area: Array, offset: Array) -> Array:
    """phi dA (q,) at quadrature points with int phi dA = 0 and int phi x dA = offset (3,), of least norm.

    Principal directions in which the points hardly spread, as along the normal of a flat face, are left alone.
    """
    total = area.sum()
    arm = position - area @ position / total
    spread, directions = np.linalg.eigh((arm.T * area) @ arm)
    along = directions.T @ offset
    carried = np.abs(along) < _SMALL * np.sqrt(np.maximum(spread, 0.0) / total)
    slope = np.where(carried, along / np.where(carried, spread, 1.0), 0.0)
    return np.asarray(area * (arm @ (directions @ slope)))
