"""The blade in steady rotation about the engine axis: static displacement, stiffness at speed, Coriolis forces.

Small vibrations about the static displacement u have the stiffness K_T(u) - W^2 M_yz: the tangent stiffness with its
initial-displacement and geometric (stress stiffening) parts, less the spin softening.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.checks import require_between
from rom.errors import RomParameterError
from rom.finite_elements.assembly import stress_at_quadrature
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.full_model import FullModel
from rom.finite_elements.material import Materials
from rom.finite_elements.static_equilibrium import LARGEST_STRAIN, RotatingBody, static_equilibrium
from rom.finite_elements.total_lagrangian import ElasticBody
from rom.linear_algebra.factorisation import analyse, factorise
from rom.linear_algebra.threads import one_blas_thread
from rom.units import angular_speed

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh

EQUILIBRIA = ("nonlinear", "linear")


@one_blas_thread()
def stiffen_by_rotation(
    full: FullModel,
    sector: SectorMesh,
    material: Materials,
    speed_rpm: float,
    equilibrium: str = "nonlinear",
    motion: csr_matrix | None = None,
) -> FullModel:
    """The full model of a sector in steady rotation about the x axis, for small vibrations about its equilibrium.

    The contacts are free and the root is clamped; cut faces of a disk move as `motion` lets them. With
    `equilibrium = "nonlinear"` the static displacement u solves f_int(u) = W^2 (f_0 + M_yz u) at large displacements,
    W in rad/s; the stiffness becomes K_T(u) - W^2 M_yz. With "linear" it is u = W^2 K^-1 f_0, and the geometric part
    of K_T(u) has the stress of its small strains: no iterations, an error of order W^4. Coriolis forces are no part
    of the stiffness.

    Parameters
    ----------
    full : FullModel
        The full model at rest.
    sector : SectorMesh
        Its mesh.
    material : Material or mapping of str to Material
        Its material, or its materials as in `assemble`.
    speed_rpm : float
        Rotational speed, rev/min.
    equilibrium : {"nonlinear", "linear"}
        The static equilibrium.
    motion : (N, f) CSR matrix, optional
        Admissible displacements u = T z: `static_motion` of a sector with cut faces; of the free dofs by default.

    Returns
    -------
    FullModel
        The model at speed, its `centrifugal` such that `centrifugal_displacement` is u / W^2; `full` itself when the
        speed is 0.

    Raises
    ------
    RomParameterError
        A value is not allowed, the model is at speed already, `motion` is missing, or there is no equilibrium within
        the strains of linear elasticity.
    FactorisationError
        The structure is not held.

    Examples
    --------
    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble, stiffen_by_rotation
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector, steel = build_sector(blade, shroud, MeshParameters(size=0.02)), Material(2e11, 0.3, 7800.0)
    >>> full = assemble(sector, steel, element="hex8")
    >>> tilt = np.outer(full.positions[:, 2] - 0.3, [1.0, 0.0, 0.0]).ravel()  # the tension resists it
    >>> stiffness = stiffen_by_rotation(full, sector, steel, speed_rpm=3000.0).stiffness
    >>> bool(tilt @ stiffness @ tilt > tilt @ full.stiffness @ tilt)
    True
    """
    _check(full, sector, speed_rpm, equilibrium, cut_faces_move=motion is not None)
    if speed_rpm == 0.0:
        return full
    discretisation, squared = discretise(sector, full.element), angular_speed(speed_rpm) ** 2
    rotating = RotatingBody.of(ElasticBody.of(discretisation, material), full, motion)
    linear = equilibrium == "linear"
    displacement = squared * centrifugal_displacement(full, motion=motion) if linear else _found(rotating, speed_rpm)
    stress = stress_at_quadrature(discretisation, material, displacement) if linear else None
    stiffness = rotating.stiffness(displacement, squared, stress)
    force = full.centrifugal.copy()
    force[rotating.free] = (stiffness @ displacement)[rotating.free] / squared  # what neighbours exert included
    return replace(full, stiffness=stiffness, centrifugal=force, speed_rpm=float(speed_rpm))


def _check(full: FullModel, sector: SectorMesh, speed_rpm: float, equilibrium: str, *, cut_faces_move: bool) -> None:
    """Check what `stiffen_by_rotation` is given. Raises RomParameterError."""
    require_between("load", "speed_rpm", speed_rpm, -math.inf, math.inf, "must be a finite number (rev/min)")
    if equilibrium not in EQUILIBRIA:
        raise RomParameterError("load", "equilibrium", equilibrium, f"must be one of {', '.join(EQUILIBRIA)}")
    if speed_rpm == 0.0:
        return
    if full.speed_rpm != 0.0:
        raise RomParameterError("load", "speed_rpm", full.speed_rpm, "only a model at rest can be set in rotation")
    if not cut_faces_move and len(sector.node_sets.get("cyclic_right", ())):
        allowed = "must come with the motion of the cut faces of the disk (motion = static_motion(full, faces))"
        raise RomParameterError("load", "speed_rpm", speed_rpm, allowed)


def _found(rotating: RotatingBody, speed_rpm: float) -> NDArray[np.float64]:
    """Displacement (N,) of the static equilibrium at large displacements, m."""
    found = static_equilibrium(rotating, angular_speed(speed_rpm) ** 2)
    if found is None:
        allowed = f"a lower speed: no static equilibrium with strains below {100 * LARGEST_STRAIN:g} % was found"
        raise RomParameterError("load", "speed_rpm", speed_rpm, allowed)
    return found


def centrifugal_displacement(
    full: FullModel, backend: str = "auto", motion: csr_matrix | None = None
) -> NDArray[np.float64]:
    """Static displacement of a full model under its centrifugal force at 1 rad/s, with free contacts.

    At rest it is the linear one. At speed, times the speed squared, it is that of the equilibrium.

    Parameters
    ----------
    full : FullModel
        The full model.
    backend : str
        Backend of the factorisation, see `factorise`.
    motion : (N, f) CSR matrix, optional
        Admissible displacements, as in `stiffen_by_rotation`.

    Returns
    -------
    (N,) array
        Displacement of all dofs, m.

    Raises
    ------
    FactorisationError
        The structure is not held.

    Examples
    --------
    At rest the displacement of the free dofs balances the centrifugal force, K u = f:

    >>> from geometry import BladeParameters, MeshParameters, ShroudParameters, build_sector
    >>> from rom import Material, assemble, centrifugal_displacement
    >>> blade, shroud = BladeParameters(40, 0.3, 0.1, 0.02, 0.008), ShroudParameters(45.0, 0.01, 0.04, 0.01)
    >>> sector = build_sector(blade, shroud, MeshParameters(size=0.02))
    >>> full = assemble(sector, Material(2e11, 0.3, 7800.0), element="hex8")
    >>> residual = np.delete(full.stiffness @ centrifugal_displacement(full) - full.centrifugal, full.fixed)
    >>> bool(abs(residual).max() < 1e-9 * abs(full.centrifugal).max())
    True
    """
    if motion is not None:
        factor = factorise((motion.T @ full.stiffness @ motion).tocsr(), backend)
        return np.asarray(motion @ factor.solve(motion.T @ full.centrifugal))
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    # In two steps, between which the matrix is freed: on a large mesh there is little memory beside the factor.
    factor = analyse(full.stiffness[free][:, free], backend).factor()
    displacement = np.zeros(full.n_dofs)
    displacement[free] = factor.solve(full.centrifugal[free])
    return displacement


def coriolis_acceleration(velocity: NDArray[np.float64]) -> NDArray[np.float64]:
    """2 w x v at 1 rad/s of velocities (3k,) or (3k, m), node-major x, y, z: 2 (0, v_z, -v_y) at each node.

    The ring turns towards +y, w = -e_x: blade j+1 meets a disturbance at rest before blade j, which is the phase
    +EO phi of an engine order.
    """
    nodal = velocity.reshape(len(velocity) // 3, 3, -1)
    acceleration = np.zeros_like(nodal)
    acceleration[:, 1], acceleration[:, 2] = 2.0 * nodal[:, 2], -2.0 * nodal[:, 1]
    return acceleration.reshape(velocity.shape)
