"""Loads of the full model as vectors: forces on nodes, pressures and tractions on surfaces, thermal strains.

The mean displacement along d of the nodes of a set is the row of the force 1 N along d shared by them: both are the
same vector.

Pressures and tractions act on the undeformed body. Thermal strains are alpha T, with the temperature T counted from
the one at which the body is free of stress, or those of a table. The stress of a displacement is sigma = C (eps(u) -
eps_T).

The strain of a gauge, the component along a direction of the strain at a point, is a row on the displacements too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import DiscreteBlock, Discretisation, discretise, points_on_sides
from rom.finite_elements.full_model import FullModel, node_dofs
from rom.finite_elements.material import Materials, law_of

if TYPE_CHECKING:
    from geometry.elements import ElementSides
    from geometry.sector import SectorMesh
    from rom.finite_elements.full_model import FullModel

Array = NDArray[np.float64]
# Gauss points in a direction: exact for a quadratic pressure on a flat side, and a uniform one on a curved side.
_POINTS = 4
Vector = NDArray[np.float64] | NDArray[np.complex128]
_CANDIDATES = 32  # elements with the nearest centres
_NEWTON_STEPS = 20
_FARTHEST = 0.01  # distance of the gauge from the mesh, of the size of the mesh


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


def thermal_force(
    full: FullModel,
    sector: SectorMesh,
    material: Materials,
    temperature: float | Array,
    equilibrium: Array | None = None,
) -> Array:
    """Nodal forces of a temperature field, f_a = int F (C eps_T) grad N_a dV.

    `temperature` (V,): temperature less that of the stress-free state, K, uniform or at the points of the mesh.
    `equilibrium` (N,): static displacement at speed about which the blade expands, m: F is its deformation gradient.
    Without F the stiffness at speed would bend a blade that expands freely. Returns (N,): nodal forces, N.
    """
    nodal = temperature_at_points(temperature, len(sector.points))
    discretisation = discretise(sector, full.element)
    force = np.zeros((discretisation.n_nodes, 3))
    moved = None if equilibrium is None else equilibrium.reshape(-1, 3)
    for batch in discretisation.batches():
        block = discretisation.blocks[batch.block]
        rise = at_quadrature(block, batch.part, nodal)
        stress = law_of(material, block, batch.part).restrained_stress(rise) * batch.weights[..., None, None]
        if moved is not None:
            gradient = np.einsum("eai,eqla->eqil", moved[batch.nodes], batch.gradients, optimize=True)
            stress = stress + gradient @ stress
        np.add.at(force, batch.nodes, np.einsum("eqik,eqka->eai", stress, batch.gradients, optimize=True))
    return force.ravel()


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


def at_quadrature(block: DiscreteBlock, part: slice, nodal: Array) -> Array:
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


def strain_row(full: FullModel, sector: SectorMesh, at: ArrayLike, direction: ArrayLike) -> Array:
    """Row o with the strain o @ u = d . eps(u) d at a point, d of length 1; the small strain of the element there.

    `at`: the point, m; one outside of the mesh is moved to the nearest point of an element. Returns (N,): the row,
    1/m.
    """
    point, along = np.asarray(at, dtype=float), np.asarray(direction, dtype=float)
    if along.shape != (3,) or not np.all(np.isfinite(along)) or not np.any(along):
        raise RomParameterError("output", "direction", along.tolist(), "must be three finite numbers, not all 0")
    if point.shape != (3,) or not np.all(np.isfinite(point)):
        raise RomParameterError("output", "at", point.tolist(), "must be three finite numbers (m)")
    along = along / np.linalg.norm(along)
    blocks = discretise(sector, full.element).blocks
    found = [_nearest(block, point) for block in blocks]
    best = min(range(len(found)), key=lambda k: found[k][0])
    distance, element, place = found[best]
    extent = float(np.ptp(full.positions, axis=0).max())
    if distance > _FARTHEST * extent:
        raise RomParameterError(
            "output", "at", point.tolist(), f"must lie on the mesh (m); the nearest element is {distance:.3g} m away"
        )
    block = blocks[best]
    _, gradients = block.reference.shape_functions(place[:, None])
    slope = np.linalg.solve(_jacobian(block, element, place).T, gradients[0].T)  # (3, b): gradients in x, y, z
    row = np.zeros(full.n_dofs)
    row[node_dofs(block.nodes[element])] = np.outer(along @ slope, along)
    return row


def _jacobian(block: DiscreteBlock, element: int, place: Array) -> Array:
    _, slopes = block.reference.geometry_functions(place[:, None])
    return np.asarray(block.geometry[element].T @ slopes[0])


def _nearest(block: DiscreteBlock, point: Array) -> tuple[float, int, Array]:
    """Distance of the nearest point of a block, its element, and its place on the reference cell."""
    centres = block.geometry.mean(axis=1)
    order = np.argsort(np.sum((centres - point) ** 2, axis=1))[:_CANDIDATES]
    found = [(*_inverted(block, int(element), point), int(element)) for element in order]
    distance, place, element = min(found, key=lambda each: each[0])
    return distance, element, place


def _inverted(block: DiscreteBlock, element: int, point: Array) -> tuple[float, Array]:
    """Distance of a point from an element and its place there: Newton's method, kept on the reference cell."""
    place = _on_cell(block, block.reference.nodes.mean(axis=0))
    best = np.inf, place
    for _ in range(_NEWTON_STEPS):
        values, _ = block.reference.geometry_functions(place[:, None])
        rest = point - values[0] @ block.geometry[element]
        distance = float(np.linalg.norm(rest))
        if distance >= best[0] * (1.0 - 1e-12):
            break
        best = distance, place
        step = np.linalg.lstsq(_jacobian(block, element, place), rest, rcond=None)[0]
        place = _on_cell(block, place + step)
    return best


def _on_cell(block: DiscreteBlock, place: Array) -> Array:
    """A place moved onto the reference cell."""
    kind = block.reference.kind
    if kind.startswith("hex"):
        return np.clip(place, 0.0, 1.0)
    flat = 3 if kind.startswith("tet") else 2
    kept = np.clip(place, 0.0, 1.0)
    total = kept[:flat].sum()
    if total > 1.0:
        kept[:flat] /= total
    return kept
