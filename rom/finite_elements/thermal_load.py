"""Thermal strains of an isotropic body, eps = alpha T I: their nodal forces and their stress.

The temperature T is counted from the one at which the body is free of stress. With beta = E alpha / (1 - 2 nu) the
stress of a displacement is sigma = D eps(u) - beta T I.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import DiscreteBlock, Discretisation, discretise
from rom.finite_elements.material import Materials, material_of

if TYPE_CHECKING:
    from geometry import SectorMesh
    from rom.finite_elements.full_model import FullModel

Array = NDArray[np.float64]


def thermal_force(full: FullModel, sector: SectorMesh, material: Materials, temperature: float | Array) -> Array:
    """Nodal forces of a temperature field, f_a = int B_a^T D alpha T dV = int beta T grad N_a dV.

    Parameters
    ----------
    full : FullModel
        The full model.
    sector : SectorMesh
        Its mesh.
    material : Material or mapping of str to Material
        Its material, or its materials as in `assemble`.
    temperature : float or (V,) array
        Temperature less that of the stress-free state, K, uniform or at the points of the mesh.

    Returns
    -------
    (N,) array
        Nodal forces, N.

    Raises
    ------
    RomParameterError
        The temperature is not finite, or a material is not given.

    Examples
    --------
    A free body expands without stress, K u = f with u = alpha T x:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble, thermal_force
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> steel = Material(2e11, 0.3, 7800.0, expansion=12e-6)
    >>> full = assemble(sector, steel, element="hex8")
    >>> force = thermal_force(full, sector, steel, 100.0)
    >>> expanded = 12e-6 * 100.0 * full.positions.ravel()
    >>> bool(np.allclose(full.stiffness @ expanded, force, atol=1e-9 * abs(force).max()))
    True
    """
    nodal = temperature_at_points(temperature, len(sector.points))
    discretisation = discretise(sector, full.element)
    force = np.zeros((discretisation.n_nodes, 3))
    for batch in discretisation.batches():
        block = discretisation.blocks[batch.block]
        modulus = material_of(material, block.material).thermal_stress_modulus
        pressure = modulus * batch.weights * _at_quadrature(block, batch.part, nodal)
        np.add.at(force, batch.nodes, np.einsum("eq,eqka->eak", pressure, batch.gradients, optimize=True))
    return force.ravel()


def thermal_stress(discretisation: Discretisation, materials: Materials, temperature: Array) -> tuple[Array, ...]:
    """beta T (E, q) in Pa at the quadrature points of each block, from temperatures (V,) at the points of the mesh.

    It is to be subtracted from the three normal stresses of `stress_at_quadrature`.
    """
    return tuple(
        material_of(materials, block.material).thermal_stress_modulus
        * _at_quadrature(block, slice(0, len(block)), temperature)
        for block in discretisation.blocks
    )


def temperature_at_points(temperature: float | Array, count: int) -> Array:
    """Temperatures (V,) at the points of a mesh; a number is that of all.

    Raises RomParameterError where they are of another number or not finite.
    """
    found = np.asarray(temperature, dtype=float)
    if found.shape not in ((), (count,)):
        allowed = f"must be a number or {count} numbers, one for each point of the mesh"
        raise RomParameterError("load", "temperature", f"array of shape {found.shape}", allowed)
    if not np.isfinite(found).all():
        raise RomParameterError("load", "temperature", float("nan"), "must be finite at every point of the mesh (K)")
    return np.broadcast_to(found, (count,))


def _at_quadrature(block: DiscreteBlock, part: slice, nodal: Array) -> Array:
    """Values (e, q) at the quadrature points of some elements."""
    return np.asarray(nodal[block.vertices[part]] @ block.table.geometry.T)
