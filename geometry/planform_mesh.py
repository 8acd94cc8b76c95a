"""Quadrilateral mesh of a whole planform: the upper half by gmsh, the lower half by a rotation of 180 degrees."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from geometry.divisions import grid_fractions
from geometry.gmsh_quads import QuadMesh, mesh_layout
from geometry.layout import Layout, MeshingError
from geometry.layouts import half_layouts
from geometry.planform import Planform
from geometry.quality import quadrilateral_scaled_jacobian
from geometry.sector import FloatArray, IntArray
from geometry.straight_edges import straight_edged_half_thickness

GOOD_QUALITY = 0.4  # scaled Jacobian above which a mesh in rows is accepted and no unstructured one is tried
FAIR_QUALITY = 0.2  # scaled Jacobian above which no finer mesh is tried


@dataclass(frozen=True)
class PlanformMesh:
    """A mesh that is its own image, bit for bit, under (x, s) -> (-x, -s).

    Attributes
    ----------
    points : (n, 2) array
        Nodes, m.
    quads : (q, 4) array
        Quadrilaterals, counterclockwise.
    airfoil : (q,) bool array
        Which quadrilaterals belong to the section of the airfoil.
    right, left : (n_t1,) array
        Contact nodes of the two sides along +x, opposite each other.
    right_face, left_face : (k,) array
        All nodes on the contact segments.
    origin : int
        The node at (0, 0).
    flanks : ((k,), (k,)) arrays
        Places of the nodes on the upper and on the lower flank of the airfoil along the section, ascending, m.
    """

    points: FloatArray
    quads: IntArray
    airfoil: NDArray[np.bool_]
    right: IntArray
    left: IntArray
    right_face: IntArray
    left_face: IntArray
    origin: int
    flanks: tuple[FloatArray, FloatArray]


def mesh_planform(plan: Planform, size: float, contact_nodes: int) -> PlanformMesh:
    """Mesh with elements of about ``size`` (m) and ``contact_nodes`` grid nodes on each contact segment.

    Raises ``MeshingError`` where no layout gives a valid mesh.
    """
    layout, half = _best_half(plan, size, contact_nodes)
    cut = half.along(layout.cut)
    contact = half.along(("CB", "CT"))
    points = _exact_points(plan, layout, half, cut, contact)

    flank = plan.unplace(points[half.along(layout.flank)])[:, 0]
    # lower half: the same nodes rotated by 180 degrees; those on the cut exist already
    n = len(points)
    inner = np.setdiff1d(np.arange(n), cut)
    turned = np.empty(n, dtype=np.int64)
    turned[cut] = cut[::-1]
    turned[inner] = n + np.arange(len(inner))
    in_airfoil = np.concatenate(
        [np.full(len(quads), patch.airfoil) for quads, patch in zip(half.quads, layout.patches, strict=True)]
    )
    quads = np.vstack(half.quads)
    fractions = layout.curves["CB", "CT"].fractions
    grid = np.array([np.argmin(np.abs(fractions - f)) for f in grid_fractions(contact_nodes)])
    left_face = turned[contact][::-1]
    return PlanformMesh(
        points=np.vstack([points, -points[inner]]),
        quads=np.vstack([quads, turned[quads]]),
        airfoil=np.concatenate([in_airfoil, in_airfoil]),
        right=contact[grid],
        left=left_face[grid],
        right_face=contact,
        left_face=left_face,
        origin=int(cut[len(cut) // 2]),
        flanks=(flank, -flank[::-1]),
    )


def _best_half(plan: Planform, size: float, contact_nodes: int) -> tuple[Layout, QuadMesh]:
    """The layout whose worst element is best; layouts are tried until one is good enough.

    First meshes in rows, then an unstructured one of the same size, then finer ones for features much smaller than
    the size.
    """
    best: tuple[float, Layout, QuadMesh] | None = None
    reasons = []
    for fineness, wanted in ((1, GOOD_QUALITY), *((k, FAIR_QUALITY) for k in (2, 3, 4, 6))):
        for layout in half_layouts(plan, size / fineness, contact_nodes):
            enough = best is not None and best[0] > wanted
            if (fineness > 1 and not layout.free) or (layout.free and enough):
                continue
            try:
                half = mesh_layout(layout, size / fineness)
            except MeshingError as error:
                reasons.append(f"{layout.name}/{fineness}: {error}")
                continue
            quality = float(quadrilateral_scaled_jacobian(half.points, np.vstack(half.quads)).min())
            reasons.append(f"{layout.name}/{fineness}: worst scaled Jacobian {quality:.2g}")
            if quality > 0 and (best is None or quality > best[0]):
                best = quality, layout, half
    if best is None:
        raise MeshingError("no layout gives a valid mesh: " + "; ".join(reasons))
    return best[1], best[2]


def _exact_points(plan: Planform, layout: Layout, half: QuadMesh, cut: IntArray, contact: IntArray) -> FloatArray:
    """The points of the half with exact positions on cut, contact segment and flank."""
    points = half.points.copy()
    points[cut] = (points[cut] - points[cut][::-1]) / 2
    _, start, end, _ = plan.right_profile()
    points[contact] = start + layout.curves["CB", "CT"].fractions[:, None] * (end - start)
    flank = half.along(layout.flank)
    along = plan.unplace(points[flank])[:, 0]
    across = straight_edged_half_thickness(plan.section, along)
    points[flank] = plan.place(np.stack([along, across], axis=-1))
    return points
