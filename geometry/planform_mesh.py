"""Quadrilateral mesh of a whole planform: two upper halves by gmsh, the second one rotated by 180 degrees.

Without camber the two halves are the same mesh.
"""

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
Half = tuple[Layout, QuadMesh]
FAIR_QUALITY = 0.2  # scaled Jacobian above which no finer mesh is tried
ANY_QUALITY = 0.0
# Size over that of the elements, quality that is enough, whether only the unstructured layout is tried.
TRIES = (
    (1.0, GOOD_QUALITY, False),
    *((fineness, FAIR_QUALITY, True) for fineness in (2.0, 3.0, 4.0, 6.0)),
    *((fineness, ANY_QUALITY, False) for fineness in (1.4, 1.2, 0.8, 1.7, 2.5, 5.0)),
)


@dataclass(frozen=True)
class PlanformMesh:
    """A mesh that without camber is its own image, bit for bit, under (x, s) -> (-x, -s)."""

    points: FloatArray  # (n, 2), nodes, m
    quads: IntArray  # (q, 4), quadrilaterals, counterclockwise
    airfoil: NDArray[np.bool_]  # (q,), which quadrilaterals belong to the section of the airfoil
    right: IntArray  # (n_t1,), contact nodes of the two sides along +x, opposite each other
    left: IntArray  # (n_t1,), contact nodes of the two sides along +x, opposite each other
    right_face: IntArray  # (k,), all nodes on the contact segments
    left_face: IntArray  # (k,), all nodes on the contact segments
    origin: int  # the node at (0, 0), with camber the nearest to it
    # (k,), places of the nodes on the upper and on the lower flank of the airfoil along the section, ascending, m
    flanks: tuple[FloatArray, FloatArray]


def mesh_planform(plan: Planform, size: float, contact_nodes: int) -> PlanformMesh:
    """Mesh with elements of about ``size`` (m) and ``contact_nodes`` grid nodes on each contact segment.

    Raises ``MeshingError`` where no layout gives a valid mesh.
    """
    (layout, upper), (other_layout, lower) = _best_halves(plan, size, contact_nodes)
    cut, other_cut = upper.along(layout.cut), lower.along(other_layout.cut)
    contact, other_contact = (half.along(("CB", "CT")) for half in (upper, lower))
    points = _exact_points(plan, layout, upper)
    others = points.copy() if lower is upper else _exact_points(plan.turned, other_layout, lower)
    joint = (points[cut] - others[other_cut][::-1]) / 2
    if plan.section.camber:
        airfoil = np.isin(cut, upper.along(_between_ends(layout.cut)))
        along = plan.unplace(joint[airfoil])[:, 0]
        joint[airfoil] = plan.place(np.stack([along, 0 * along], axis=-1))
    points[cut], others[other_cut] = joint, -joint[::-1]

    # the lower half rotated by 180 degrees; the nodes on the cut exist already
    n = len(points)
    inner = np.setdiff1d(np.arange(len(others)), other_cut)
    turned = np.empty(len(others), dtype=np.int64)
    turned[other_cut] = cut[::-1]
    turned[inner] = n + np.arange(len(inner))
    in_airfoil = [
        np.full(len(quads), patch.airfoil)
        for half in (upper, lower)
        for quads, patch in zip(half.quads, layout.patches, strict=True)
    ]
    fractions = layout.curves["CB", "CT"].fractions
    grid = np.array([np.argmin(np.abs(fractions - f)) for f in grid_fractions(contact_nodes)])
    left_face = turned[other_contact][::-1]
    everything = np.vstack([points, -others[inner]])
    return PlanformMesh(
        points=everything,
        quads=np.vstack([*upper.quads, turned[np.vstack(lower.quads)]]),
        airfoil=np.concatenate(in_airfoil),
        right=contact[grid],
        left=left_face[grid],
        right_face=contact,
        left_face=left_face,
        origin=int(np.argmin(np.hypot(*everything.T))),
        flanks=(
            plan.unplace(points[upper.along(layout.flank)])[:, 0],
            -plan.turned.unplace(others[lower.along(layout.flank)])[::-1, 0],
        ),
    )


def _between_ends(cut: tuple[str, ...]) -> tuple[str, ...]:
    """The part of the cut in the airfoil, from leading to trailing edge."""
    return cut[cut.index("LE") : cut.index("TE") + 1]


def _best_halves(plan: Planform, size: float, contact_nodes: int) -> tuple[Half, Half]:
    """The layout and mesh whose worst element is best: upper half, and that of the planform rotated by 180 degrees.

    Layouts are tried until one is good enough: first meshes in rows, then an unstructured one of the same size, then
    finer ones for features much smaller than the size; where none is valid, all layouts with other sizes.
    """
    best: tuple[float, Half, Half] | None = None
    tried, highest = 0, -1.0
    for fineness, wanted, free_only in TRIES:
        if best is not None and best[0] > wanted:
            continue
        layouts = half_layouts(plan, size / fineness, contact_nodes)
        others = half_layouts(plan.turned, size / fineness, contact_nodes) if plan.section.camber else layouts
        for layout, other in zip(layouts, others, strict=True):
            enough = best is not None and best[0] > wanted
            if (free_only and not layout.free) or (enough and (layout.free or wanted == ANY_QUALITY)):
                continue
            tried += 1
            try:
                upper = mesh_layout(layout, size / fineness)
                lower = upper if other is layout else mesh_layout(other, size / fineness)
            except MeshingError:
                continue
            quality = min(
                float(quadrilateral_scaled_jacobian(half.points, np.vstack(half.quads)).min())
                for half in (upper, lower)
            )
            highest = max(highest, quality)
            if quality > 0 and (best is None or quality > best[0]):
                best = quality, (layout, upper), (other, lower)
    if best is None:
        raise MeshingError(f"{tried} layouts tried, worst scaled Jacobian {highest:.2g} at best")
    return best[1], best[2]


def _exact_points(plan: Planform, layout: Layout, half: QuadMesh) -> FloatArray:
    """The points of the half with exact positions on contact segment and flank."""
    points = half.points.copy()
    _, start, end, _ = plan.right_profile()
    points[half.along(("CB", "CT"))] = start + layout.curves["CB", "CT"].fractions[:, None] * (end - start)
    flank = half.along(layout.flank)
    along = plan.unplace(points[flank])[:, 0]
    across = straight_edged_half_thickness(plan.section, along)
    points[flank] = plan.place(np.stack([along, across], axis=-1))
    return points
