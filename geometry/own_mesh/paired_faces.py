"""The two contact faces of a sector: checked, paired, with contact points, frames and areas."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from geometry.elements import IntArray
from geometry.errors import OwnMeshError
from geometry.frames import contact_frames, rotate_about_axis
from geometry.own_mesh.contact_points import cell_centres, evened, on_nodes, tributary_areas
from geometry.own_mesh.face_checks import check_alike, check_pitch
from geometry.own_mesh.face_pairing import Surface, gap_along, overlap, partners
from geometry.own_mesh.sector_choice import SectorChoice
from geometry.own_mesh.side_quadrature import SidePoints
from geometry.own_mesh.smooth_normals import normals_at
from geometry.sector import ContactFace, FloatArray

_GAP = 0.05  # largest gap, over the size of a face
_LEAST_OVERLAP = 0.9
# A mean gap counts from so many standard deviations, and from this part of the size of a face.
_SCATTER, _NO_GAP = 3.0, 1e-7


@dataclass(frozen=True)
class FacePair:
    """Right and left surface of a sector in our axes, and the numbers that tell how they fit."""

    right: Surface  # the surfaces
    left: Surface  # the surfaces
    pitch: float  # angle of a sector, rad
    # (k,), for each node of the right surface its partner, a row of the mesh; None where the nodes are no pairs
    partner: IntArray | None
    mismatch: float  # see `SectorFindings`
    gap: tuple[float, float]  # smallest and largest gap, m
    # mean of the gap, m; 0 where it is no more than the scatter that sides of elements on a curved face cause
    mean_gap: float
    overlap: float  # see `SectorFindings`
    areas: tuple[float, float]  # areas, m^2
    normal_angle: float  # see `SectorFindings`


def pair_faces(right: Surface, left: Surface, choice: SectorChoice) -> FacePair:
    """The faces paired; OwnMeshError where one is not the other turned by one pitch."""
    at_right, at_left = right.quadrature(), left.quadrature()
    size = float(np.sqrt(at_right.area.sum()))
    reach = _GAP * size if choice.tolerance is None else choice.tolerance * choice.metres
    check_pitch(at_right, at_left, choice.n_blades, 2.0 * reach)
    angle = check_alike(at_right, at_left, choice.n_blades)
    pitch = 2.0 * np.pi / choice.n_blades
    gap, share = _gap(right, left, pitch, reach)
    mean = float(np.nanmean(gap))
    at = right.points[right.nodes]
    normal = rotate_about_axis(normals_at(at, at_right, right.n_sides), -pitch)
    others = left.points[left.nodes]
    row, mismatch = partners(rotate_about_axis(at, -pitch), others, normal)
    if row is not None:
        apart = np.sum((others[row] - rotate_about_axis(at, -pitch)) * normal, axis=1)
        gap = apart
    areas = float(at_right.area.sum()), float(at_left.area.sum())
    return FacePair(
        right=right,
        left=left,
        pitch=pitch,
        partner=None if row is None else left.nodes[row],
        mismatch=mismatch,
        gap=(float(np.nanmin(gap)), float(np.nanmax(gap))),
        mean_gap=mean if abs(mean) > _SCATTER * float(np.nanstd(gap)) + _NO_GAP * size else 0.0,
        overlap=share,
        areas=areas,
        normal_angle=angle,
    )


def contact_faces(pair: FacePair, grid: tuple[int, int] | None, clamped: IntArray) -> tuple[ContactFace, ContactFace]:
    """Contact points, frames and areas of both faces; the left ones are the right ones turned back by one pitch.

    Without a grid all corner nodes of the sides are contact nodes but those that are `clamped`.
    With matching nodes the contact points are nodes where the grid falls on nodes. Else the nodes of a contact face
    are those nearest to its contact points.
    """
    right, left = pair.right, pair.left
    points = right.quadrature()
    if grid is None:
        if pair.partner is None:
            told = "must be two numbers: the nodes of the contact faces are no pairs under the pitch"
            raise OwnMeshError("mesh.contact_grid", None, told)
        corners = np.unique(np.concatenate([table[:, : _corners(table)].ravel() for table in right.tables]))
        corners = np.setdiff1d(corners, clamped)
        row: IntArray | None = np.searchsorted(right.nodes, corners)
        centres = right.points[corners]
    else:
        centres = evened(cell_centres(points, grid), points)
        row = None if pair.partner is None else on_nodes(centres, right.points[right.nodes], points.area.sum())
    if row is not None and pair.partner is not None:
        at, nodes, others = right.points[right.nodes[row]], right.nodes[row], pair.partner[row]
        opposite = left.points[others]
    else:
        at = _on_surface(centres, points, right)
        opposite = rotate_about_axis(at, -pair.pitch)
        normal = rotate_about_axis(normals_at(at, points, right.n_sides), -pair.pitch)
        opposite = opposite + pair.mean_gap * normal
        nodes, others = _nearest(at, right), _nearest(opposite, left)
    frame = contact_frames(at, normals_at(at, points, right.n_sides))
    area = tributary_areas(at, points)
    if area.min() <= 0.0:
        raise OwnMeshError("mesh.contact_grid", grid, "is too fine for the shape of this face; take fewer points")
    back = rotate_about_axis(frame, -pair.pitch)
    return ContactFace(nodes, at, frame, area), ContactFace(others, opposite, back, area.copy())


def _gap(right: Surface, left: Surface, pitch: float, reach: float) -> tuple[FloatArray, float]:
    """The gap at points of the right face, m, and the smaller share of the area of a face with the other opposite."""
    at_right, at_left = right.samples(), left.samples()
    back, normal = (rotate_about_axis(each, -pitch) for each in (at_right.position, at_right.normal))
    gap = gap_along(back, normal, left.triangles(), reach)
    turned = right.triangles().turned(rotate_about_axis(np.eye(3), -pitch).T)
    shares = (overlap(at_right, gap), overlap(at_left, gap_along(at_left.position, at_left.normal, turned, reach)))
    share = min(shares)
    if share < _LEAST_OVERLAP:
        told = f"must lie opposite the right face turned back by one pitch; only {100.0 * shares[0]:.3g} % of the "
        told += f"right and {100.0 * shares[1]:.3g} % of the left face have the other within {1e3 * reach:.3g} mm"
        raise OwnMeshError("mesh.sets.contact_left", None, told)
    return gap, share


def _on_surface(at: FloatArray, points: SidePoints, surface: Surface) -> FloatArray:
    """Points (k, 3) moved along the normal onto the surface."""
    normal = normals_at(at, points, surface.n_sides)
    move = gap_along(at, normal, surface.triangles(), float(np.sqrt(points.area.sum())))
    return at + np.nan_to_num(move)[:, None] * normal


def _nearest(at: FloatArray, surface: Surface) -> IntArray:
    from scipy.spatial import cKDTree

    return surface.nodes[cKDTree(surface.points[surface.nodes]).query(at)[1]]


def _corners(table: IntArray) -> int:
    return 3 if table.shape[1] in (3, 6) else 4
