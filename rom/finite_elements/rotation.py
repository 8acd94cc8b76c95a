"""What a steady rotation about the engine axis does to the stiffness: stress stiffening and spin softening."""

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

if TYPE_CHECKING:
    from geometry import SectorMesh


@one_blas_thread()
def spin(full: FullModel, sector: SectorMesh, material: Material, speed_rpm: float) -> FullModel:
    """The full model of a sector at `speed_rpm` [rev/min] about the x axis; the model itself when the speed is 0.

    sector, material: what the model was assembled from. K + W^2 (K_g - M_yz) with W in rad/s: K_g is the geometric
    stiffness of the linear static stress under the centrifugal force at 1 rad/s, contacts free, root clamped; -W^2
    M_yz (mass of the y and z motions) is the centrifugal force that follows the displacement. Coriolis forces are
    left out. Raises RomParameterError for a speed that is not a finite number or for a model that is spinning
    already.
    """
    require_between("load", "speed_rpm", speed_rpm, -math.inf, math.inf, "must be a finite number (rev/min)")
    if speed_rpm == 0.0:
        return full
    if full.speed_rpm != 0.0:
        raise RomParameterError("load", "speed_rpm", full.speed_rpm, "spin starts from a model at rest")
    discretisation = discretise(sector.points, sector.hexahedra, full.element)
    stress = stress_at_quadrature(discretisation, material, centrifugal_displacement(full))
    squared = (speed_rpm * math.pi / 30.0) ** 2
    softening = full.mass.copy()
    # Rows and columns of a mass entry have the same direction, so dropping the x rows drops the x columns too.
    softening.data[np.repeat(np.arange(full.n_dofs) % 3 == 0, np.diff(softening.indptr))] = 0.0
    stiffness = full.stiffness + squared * (geometric_stiffness(discretisation, stress) - softening)
    return replace(full, stiffness=stiffness.tocsr(), speed_rpm=float(speed_rpm))


def centrifugal_displacement(full: FullModel, backend: str = "auto") -> NDArray[np.float64]:
    """Linear static displacement (N,) [m] of a full model under its centrifugal force at 1 rad/s, contacts free.

    backend: of the factorisation, see `factorise`. Raises FactorisationError when the structure is not held.
    """
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    # In two steps, between which the matrix goes: beside the factor of a large mesh there is little room.
    factor = analyse(full.stiffness[free][:, free], backend).factor()
    displacement = np.zeros(full.n_dofs)
    displacement[free] = factor.solve(full.centrifugal[free])
    return displacement
