"""Surfaces of the airfoil by name: pressure side, suction side, leading and trailing edge, for pressures on them."""

from __future__ import annotations

import numpy as np

from geometry.elements import ElementBlock, ElementSides, IntArray, sides_on
from geometry.planform import Planform
from geometry.planform_mesh import PlanformMesh

_ON_EDGE = 1e-6  # of half the length of the section


def airfoil_surfaces(
    plan: Planform, flat: PlanformMesh, blocks: tuple[ElementBlock, ...], levels: IntArray, mirrored: bool
) -> dict[str, ElementSides]:
    """The four surfaces of the airfoil, from the root to the shroud.

    The suction side is the one on the side of +y, to which a positive camber bulges; the leading edge is the end of
    the section at -x.
    Shapes: `levels` (l,).
    """
    foot = np.unique(flat.quads[flat.airfoil])
    along, across = plan.unplace(flat.points[foot]).T
    outline = _outline(flat.quads[flat.airfoil], foot)
    end = np.abs(np.abs(along) - np.abs(along).max()) < _ON_EDGE * np.abs(along).max()
    middle = across[outline].mean(axis=1)
    first = -1.0 if mirrored else 1.0
    at_end = end[outline].all(axis=1)
    chosen = {
        "suction_side": ~at_end & (middle > 0.0),
        "pressure_side": ~at_end & (middle < 0.0),
        "leading_edge": at_end & (first * along[outline].mean(axis=1) < 0.0),
        "trailing_edge": at_end & (first * along[outline].mean(axis=1) > 0.0),
    }
    found = {}
    for name, edges in chosen.items():
        local = np.unique(outline[edges])
        nodes = np.concatenate([foot[local], (levels[:, None] + local).ravel()])
        found[name] = sides_on(blocks, nodes)
    return found


def _outline(quads: IntArray, foot: IntArray) -> IntArray:
    """Edges (e, 2) of quadrilaterals that belong to one of them only, as places in `foot`."""
    edges = np.concatenate([quads[:, [k, (k + 1) % 4]] for k in range(4)])
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    return np.searchsorted(foot, edges[first[count == 1]])
