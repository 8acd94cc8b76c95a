"""Rows that tell the families of the modes of a bladed disk, from the mesh of its sector."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.mode_families import ModeFamilies
from rom.cyclic.mode_names import section_motion
from rom.cyclic_sector.part_stiffness import part_stiffness, strain_rows, within_rim
from rom.finite_elements.full_model import FullModel
from rom.finite_elements.material import Materials
from rom.linear_algebra.threads import one_blas_thread

if TYPE_CHECKING:
    from geometry import SectorMesh


@one_blas_thread()
def mode_families(
    full: FullModel, sector: SectorMesh, material: Materials, basis: NDArray[np.float64], rim_radius: float
) -> ModeFamilies:
    """Rows of a reduced model that tell the families of its modes.

    Parameters
    ----------
    full : FullModel
        The full model.
    sector : SectorMesh
        Its mesh.
    material : Material or mapping of str to Material
        Its material, or its materials as in `assemble`.
    basis : (N, n) array
        Mesh displacements of the reduced coordinates, `ReducedModel.basis`.
    rim_radius : float
        Outer radius of the disk, m: its elements have no node beyond it. The airfoil is what stands on it, up to the
        contact faces.

    Returns
    -------
    ModeFamilies
        The rows.

    Examples
    --------
    Of a blade the lowest part of which is called its disk:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, ReductionOptions, assemble, mode_families, reduce_sector
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector, steel = build_sector(blade, shroud, MeshParameters(size=0.02)), Material(2e11, 0.3, 7800.0)
    >>> full = assemble(sector, steel, element="hex8")
    >>> model = reduce_sector(full, sector, ReductionOptions(modes=4)).model
    >>> families = mode_families(full, sector, steel, model.basis, rim_radius=0.34)
    >>> frequency, names, share = families.modes(model, phase=0.0, count=2)
    >>> names, bool(0.5 < share.min() and share.max() < 1.0)
    (['1D', '2D'], True)
    """
    positions = full.positions
    inside = within_rim(full, rim_radius)
    below = min(float(sector.points[face.nodes, 2].min()) for face in (sector.right, sector.left))
    airfoil = np.flatnonzero(~inside & (positions[:, 2] < below))
    displacement = basis.T.reshape(basis.shape[1], -1, 3)
    sections = section_motion(positions[airfoil], displacement[:, airfoil])
    rows = strain_rows(part_stiffness(full, sector, material, basis, inside, disk=True))
    return ModeFamilies(sections.reshape(len(sections), -1).T.copy(), rows)
