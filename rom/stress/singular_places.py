"""Places where the stress of the model has no limit as the mesh is refined.

At a sharp re-entrant edge the stress of linear elasticity is infinite; so it is at the rim of a clamped surface,
under a force on one node, at the rim of a loaded contact face, and where two materials meet at the surface. A number
found there says more of the mesh than of the blade.

References
----------
M. L. Williams, Stress singularities resulting from various boundary conditions in angular corners of plates in
extension, J. Appl. Mech. 19 (1952) 526.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.stress.boundary_surface import BoundarySurface

if TYPE_CHECKING:
    from geometry import SectorMesh

IntArray = NDArray[np.int64]
# Angle inside the body, degrees, above which an edge counts as re-entrant. Sides of a fillet or of a curved surface
# meet at less.
REENTRANT = 210.0


def singular_vertices(sector: SectorMesh, reentrant_degrees: float = REENTRANT) -> Mapping[str, IntArray]:
    """Vertices of a sector at which the stress does not converge, by the cause.

    Parameters
    ----------
    sector : SectorMesh
        The mesh, with its node sets `root`, `contact_right`, `contact_left` and, where it has them, `face_right` and
        `face_left`.
    reentrant_degrees : float
        Angle inside the body above which an edge is re-entrant, degrees.

    Returns
    -------
    mapping of str to (k,) array
        Sorted rows of `sector.points` for "re-entrant edge", "clamped edge", "contact edge", "material interface".

    Examples
    --------
    The airfoil is clamped at the hub, and it meets the shroud in a sharp corner:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import singular_vertices
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> places = singular_vertices(sector)
    >>> print(list(places), sector.points[places["re-entrant edge"], 2].min() > 0.38)
    ['re-entrant edge', 'clamped edge', 'contact edge', 'material interface'] True
    """
    surface = BoundarySurface.of(sector.blocks, sector.points)
    sharp = surface.edges[np.degrees(surface.angle) > reentrant_degrees]
    faces = [
        _rim(surface, sector.node_sets[name]) for name in ("face_right", "face_left") if name in sector.node_sets
    ]
    return {
        "re-entrant edge": np.unique(np.concatenate([sharp.ravel(), surface.crossed.ravel()])),
        "clamped edge": _rim(surface, sector.node_sets["root"]),
        "contact edge": np.unique(np.concatenate([np.empty(0, dtype=np.int64), *faces])),
        "material interface": _interfaces(sector, surface),
    }


def point_loads(sector: SectorMesh, loaded: IntArray) -> IntArray:
    """Those of the loaded vertices (k,) with point forces: no side of an element there is loaded at all corners."""
    spread = []
    for block in sector.blocks:
        corners = block.nodes[:, : block.topology.corners]
        on = np.isin(corners, loaded)
        for side in block.topology.sides:
            spread.append(corners[on[:, side].all(axis=1)][:, side].ravel())
    return np.setdiff1d(loaded, np.concatenate(spread))


def _rim(surface: BoundarySurface, nodes: NDArray[np.integer]) -> IntArray:
    """Ends of the edges between a side with all its corners among some nodes and one that has not."""
    inside = np.asarray(np.isin(surface.sides, nodes).all(axis=1))
    one, other = surface.pairs.T
    return np.unique(surface.edges[inside[one] != inside[other]])


def _interfaces(sector: SectorMesh, surface: BoundarySurface) -> IntArray:
    """Vertices on the surface that elements of several materials share."""
    seen: dict[str, list[IntArray]] = {}
    for block in sector.blocks:
        seen.setdefault(block.material, []).append(np.unique(block.nodes))
    met = np.zeros(len(sector.points), dtype=np.int64)
    for parts in seen.values():
        met[np.unique(np.concatenate(parts))] += 1
    return np.intersect1d(np.flatnonzero(met > 1), surface.sides)
