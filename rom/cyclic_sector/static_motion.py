"""Motions of a sector that are the same in all sectors of the wheel: those of a steady load."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rom.cyclic_sector.condensed_sector import CondensedSector
from rom.cyclic_sector.cyclic_faces import CyclicFaces
from rom.cyclic_sector.cyclic_modes import WaveProblem
from rom.finite_elements.full_model import FullModel

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


def static_motion(full: FullModel, faces: CyclicFaces) -> csr_matrix:
    """Displacements u = T z of a sector that moves as its neighbours do, turned by the pitch: nodal diameter 0.

    A disk that nothing holds is supported without reactions: a load alike on all sectors, without a force along the
    axis or a moment about it, cannot move it, and one node is held along x and y.

    Parameters
    ----------
    full : FullModel
        The full model of the sector.
    faces : CyclicFaces
        The cut faces.

    Returns
    -------
    (N, f) CSR matrix
        T, for `stiffen_by_rotation` and `centrifugal_displacement`.

    Examples
    --------
    A disk spins freely: the displacements of both faces are the same, turned by the pitch.

    >>> from geometry import BladeParameters, DiskParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble, centrifugal_displacement, cyclic_faces, static_motion
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> disk, steel = DiskParameters(bore_radius=0.1, rim_width=0.03, bore="free"), Material(2e11, 0.3, 7800.0)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02), disk)
    >>> full = assemble(sector, {"": steel, "disk": steel}, element="hex8")
    >>> faces = cyclic_faces(full, sector)
    >>> moved = centrifugal_displacement(full, motion=static_motion(full, faces)).reshape(-1, 3)
    >>> bool(np.allclose(moved[faces.left] @ faces.turn.T, moved[faces.right], atol=1e-9 * abs(moved).max()))
    True
    """
    sector = CondensedSector(full, faces)
    motion = WaveProblem(sector, 0).constraint
    if full.fixed.size:
        return motion
    inside = np.flatnonzero(np.isin(sector.inside % 3, 0))  # columns of motions along x, one for each node inside
    highest = inside[np.argmax(np.abs(full.positions[sector.inside[inside] // 3, 2]))]
    return motion[:, np.delete(np.arange(motion.shape[1]), [highest, highest + 1])]
