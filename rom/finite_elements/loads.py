"""Loads of the full model as vectors: forces on nodes, pressures and tractions on surfaces, thermal strains.

The mean displacement along d of the nodes of a set is the row of the force 1 N along d shared by them: both are the
same vector.

Pressures and tractions act on the undeformed body. Thermal strains are eps = alpha T I: the temperature T is counted
from the one at which the body is free of stress. With beta = E alpha / (1 - 2 nu) the stress of a displacement is
sigma = D eps(u) - beta T I.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import DiscreteBlock, Discretisation, discretise, points_on_sides
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.finite_elements.material import Materials, material_of

if TYPE_CHECKING:
    from geometry.elements import ElementSides
    from geometry.sector import SectorMesh
    from rom.finite_elements.full_model import FullModel

Array = NDArray[np.float64]
# Gauss points in a direction: exact for a quadratic pressure on a flat side, and a uniform one on a curved side.
_POINTS = 4
Vector = NDArray[np.float64] | NDArray[np.complex128]


def pressure_force(full: FullModel, sector: SectorMesh, surface: ElementSides, pressure: float | Array) -> Array:
    """Nodal forces of a pressure on a surface, f_a = -int N_a p n dA with the outward normal n.

    `pressure` (V,): N/m^2, uniform or at the points of the mesh; positive towards the body. Returns (N,): nodal
    forces, N.
    """
    nodal = _at_points("pressure", pressure, (), len(sector.points))
    return _integrated(discretise(sector, full.element), surface, "pressure", nodal)


def traction_force(full: FullModel, sector: SectorMesh, surface: ElementSides, traction: Array) -> Array:
    """Nodal forces of a force per area on a surface, f_a = int N_a t dA.

    `traction` (V, 3): force per area in x, y and z, N/m^2, uniform or at the points of the mesh. Returns (N,): nodal
    forces, N.
    """
    nodal = _at_points("traction", traction, (3,), len(sector.points))
    return _integrated(discretise(sector, full.element), surface, "traction", nodal)


def _at_points(name: str, value: float | Array, shape: tuple[int, ...], count: int) -> Array:
    """A uniform value of some shape or values at the points, as (V, ...)."""
    found = np.asarray(value, dtype=float)
    if found.shape not in (shape, (count, *shape)):
        allowed = f"must have the shape {shape} or {(count, *shape)}"
        raise RomParameterError("load", name, f"array of shape {found.shape}", allowed)
    return np.broadcast_to(found, (count, *shape))


def _integrated(discretisation: Discretisation, surface: ElementSides, name: str, nodal: Array) -> Array:
    """int N_a t dA (3n,) of nodal tractions (V, 3), or of t = -p n with nodal pressures (V,)."""
    if not len(surface):
        raise RomParameterError("load", name, "an empty surface", "must act on at least one side of an element")
    point, weight = np.polynomial.legendre.leggauss(_POINTS)
    force = np.zeros((discretisation.n_nodes, 3))
    for points in points_on_sides(discretisation, surface, (0.5 + 0.5 * point, 0.5 * weight)):
        used = np.abs(points.geometry).max(axis=0) > 1e-12  # the other points do not lie on this side
        values = np.einsum("qg,sg...->sq...", points.geometry[:, used], nodal[points.vertices[:, used]])
        if not np.isfinite(values).all():
            raise RomParameterError(
                "load", name, float("nan"), "must be a finite number at every node of the surface"
            )
        if nodal.ndim == 1:
            traction = -values[..., None] * points.normal * points.weights[:, None]
        else:
            traction = values * points.area[..., None]
        np.add.at(force, points.nodes, np.einsum("qa,sqi->sai", points.values, traction))
    return force.ravel()


def thermal_force(full: FullModel, sector: SectorMesh, material: Materials, temperature: float | Array) -> Array:
    """Nodal forces of a temperature field, f_a = int B_a^T D alpha T dV = int beta T grad N_a dV.

    `temperature` (V,): temperature less that of the stress-free state, K, uniform or at the points of the mesh.
    Returns (N,): nodal forces, N.
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


def nodal_force(full: FullModel, nodes: ArrayLike, forces: ArrayLike) -> Vector:
    """The vector of forces on nodes; forces on one node add up.

    `forces`: forces x, y, z on each of the nodes, N, real or complex; one for all nodes, or one for each. Returns
    (N,): the force on each dof, N. What acts on clamped dofs goes into the support.
    """
    chosen = np.asarray(nodes, dtype=np.int64).reshape(-1)
    values = np.asarray(forces)
    if len(chosen) == 0 or chosen.min() < 0 or chosen.max() >= len(full.positions):
        raise RomParameterError("force", "nodes", len(chosen), f"must be nodes 0 to {len(full.positions) - 1}")
    if values.shape not in ((3,), (len(chosen), 3)) or not np.all(np.isfinite(values)):
        raise RomParameterError("force", "forces", values.shape, "must be three finite numbers, or three a node")
    vector = np.zeros(full.n_dofs, dtype=complex if np.iscomplexobj(values) else float)
    np.add.at(vector, node_dofs(chosen), np.broadcast_to(values, (len(chosen), 3)))
    return vector


def nearest_vertices(full: FullModel, positions: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The mesh vertices nearest to some points, as nodes of the full model.

    `positions`: points, m. Returns `nodes` (k,): nodes of the full model; `distance` (k,): distances to them, m.
    """
    from scipy.spatial import cKDTree

    distance, vertices = cKDTree(full.positions[full.vertex_node]).query(np.asarray(positions, dtype=float))
    return np.asarray(full.vertex_node[vertices], dtype=np.int64), np.asarray(distance)
