"""Consistent nodal forces of pressures and tractions on surfaces, on the undeformed body."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.errors import RomParameterError
from rom.finite_elements.discretisation import Discretisation, discretise
from rom.finite_elements.side_integrals import points_on_sides

if TYPE_CHECKING:
    from geometry import ElementSides, SectorMesh
    from rom.finite_elements.full_model import FullModel

Array = NDArray[np.float64]
# Gauss points in a direction: exact for a quadratic pressure on a flat side, and a uniform one on a curved side.
_POINTS = 4


def pressure_force(full: FullModel, sector: SectorMesh, surface: ElementSides, pressure: float | Array) -> Array:
    """Nodal forces of a pressure on a surface, f_a = -int N_a p n dA with the outward normal n.

    Parameters
    ----------
    full : FullModel
        The full model.
    sector : SectorMesh
        Its mesh.
    surface : ElementSides
        The loaded sides of its elements.
    pressure : float or (V,) array
        Pressure, N/m^2, uniform or at the points of the mesh; positive towards the body.

    Returns
    -------
    (N,) array
        Nodal forces, N.

    Raises
    ------
    RomParameterError
        The surface is empty, or a pressure on it is not a finite number.

    Examples
    --------
    The pressure on the outer surface of the shroud presses it towards the engine axis:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector, sides_on
    >>> from rom import Material, assemble, pressure_force
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> top = sides_on(sector.blocks, sector.node_sets["tip_surface"])
    >>> bool(pressure_force(full, sector, top, 1e5).reshape(-1, 3)[:, 2].sum() < 0.0)
    True
    """
    nodal = _at_points("pressure", pressure, (), len(sector.points))
    return _integrated(discretise(sector, full.element), surface, "pressure", nodal)


def traction_force(full: FullModel, sector: SectorMesh, surface: ElementSides, traction: Array) -> Array:
    """Nodal forces of a force per area on a surface, f_a = int N_a t dA.

    Parameters
    ----------
    full : FullModel
        The full model.
    sector : SectorMesh
        Its mesh.
    surface : ElementSides
        The loaded sides of its elements.
    traction : (3,) or (V, 3) array
        Force per area in x, y and z, N/m^2, uniform or at the points of the mesh.

    Returns
    -------
    (N,) array
        Nodal forces, N.

    Raises
    ------
    RomParameterError
        The surface is empty, or a traction on it is not a finite number.

    Examples
    --------
    The forces add up to the traction times the area:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector, sides_on
    >>> from rom import Material, assemble, traction_force
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> face = sides_on(sector.blocks, sector.node_sets["face_right"])  # 1 cm^2
    >>> force = traction_force(full, sector, face, np.array([1e5, 0.0, 0.0]))
    >>> print(force.reshape(-1, 3).sum(axis=0).round(3))
    [10.  0.  0.]
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
