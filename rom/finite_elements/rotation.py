"""Stress stiffening and spin softening by a steady rotation about the engine axis.

References
----------
K. J. Bathe, Finite Element Procedures, Prentice Hall (1996), chapter 6.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.checks import require_between
from rom.errors import RomParameterError
from rom.finite_elements.assembly import geometric_stiffness, stress_at_quadrature
from rom.finite_elements.discretisation import discretise
from rom.finite_elements.full_model import FullModel
from rom.finite_elements.material import Material
from rom.linear_algebra.factorisation import analyse
from rom.linear_algebra.threads import one_blas_thread
from rom.units import angular_speed

if TYPE_CHECKING:
    from geometry import SectorMesh


@one_blas_thread()
def stiffen_by_rotation(full: FullModel, sector: SectorMesh, material: Material, speed_rpm: float) -> FullModel:
    """The full model of a sector in steady rotation about the x axis: stress stiffening and spin softening.

    The stiffness becomes K + W^2 (K_g - M_yz) with W in rad/s. K_g is the geometric stiffness of the linear static
    stress under the centrifugal force at 1 rad/s, with free contacts and clamped root. -W^2 M_yz, with the mass M_yz
    of the y and z motions, is the centrifugal force that follows the displacement. Coriolis forces are left out.

    Parameters
    ----------
    full : FullModel
        The full model at rest.
    sector : SectorMesh
        Its mesh.
    material : Material
        Its material.
    speed_rpm : float
        Rotational speed, rev/min.

    Returns
    -------
    FullModel
        The stiffened model; `full` itself when the speed is 0.

    Raises
    ------
    RomParameterError
        The speed is not a finite number, or the model is stiffened already.
    FactorisationError
        The structure is not held.
    """
    require_between("load", "speed_rpm", speed_rpm, -math.inf, math.inf, "must be a finite number (rev/min)")
    if speed_rpm == 0.0:
        return full
    if full.speed_rpm != 0.0:
        raise RomParameterError("load", "speed_rpm", full.speed_rpm, "only a model at rest can be stiffened")
    discretisation = discretise(sector.points, sector.hexahedra, full.element)
    stress = stress_at_quadrature(discretisation, material, centrifugal_displacement(full))
    squared = angular_speed(speed_rpm) ** 2
    softening = full.mass.copy()
    # Rows and columns of a mass entry have the same direction, so dropping the x rows drops the x columns too.
    softening.data[np.repeat(np.arange(full.n_dofs) % 3 == 0, np.diff(softening.indptr))] = 0.0
    stiffness = full.stiffness + squared * (geometric_stiffness(discretisation, stress) - softening)
    return replace(full, stiffness=stiffness.tocsr(), speed_rpm=float(speed_rpm))


def centrifugal_displacement(full: FullModel, backend: str = "auto") -> NDArray[np.float64]:
    """Linear static displacement of a full model under its centrifugal force at 1 rad/s, with free contacts.

    Parameters
    ----------
    full : FullModel
        The full model.
    backend : str
        Backend of the factorisation, see `factorise`.

    Returns
    -------
    (N,) array
        Displacement of all dofs, m.

    Raises
    ------
    FactorisationError
        The structure is not held.
    """
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    # In two steps, between which the matrix is freed: on a large mesh there is little memory beside the factor.
    factor = analyse(full.stiffness[free][:, free], backend).factor()
    displacement = np.zeros(full.n_dofs)
    displacement[free] = factor.solve(full.centrifugal[free])
    return displacement
