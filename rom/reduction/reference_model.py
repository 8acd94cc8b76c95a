"""A model of a few hundred coordinates that answers like the full one: what reduced models are measured against.

Free natural modes of the full model far beyond the frequencies of interest, the static answers to forces at the kept
dofs, and what the inertia of those answers gives rise to. Nothing of it is shared with the Craig-Bampton basis. The
receptance at the kept dofs is then exact to the third power of the frequency squared over that of the first mode
left out, squared again because the space holds both the answer and its adjoint.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rom.cyclic.reduced_model import ReducedModel, ReducedModelError
from rom.errors import RomParameterError
from rom.finite_elements.full_model import FullModel
from rom.linear_algebra.factorisation import factorise
from rom.linear_algebra.orthonormalisation import independent
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_dofs import choose_boundary_dofs
from rom.reduction.boundary_selection import boundary_selection, unit_vector
from rom.reduction.fixed_interface_modes import lowest_modes

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh

_FIRST_GUESS = 24
_MOST_MODES = 384
_BEYOND = 3.0  # the modes reach to this many times the highest frequency of interest


@dataclass(frozen=True)
class FullReference:
    """model: the full model's answers at the kept dofs; flexibility: statics solved on the mesh itself.

    flexibility (6 n_c, 6 n_c) in m/N: displacements of right, then left contact dofs for unit forces there.
    modes: free modes of the full model in the model.
    """

    model: ReducedModel
    flexibility: NDArray[np.float64]
    modes: int


@one_blas_thread()
def full_reference(
    full: FullModel,
    sector: SectorMesh,
    highest_hz: float,
    *,
    excitation_direction: ArrayLike = (0.0, 1.0, 0.0),
    excitation_at: str | ArrayLike = "tip",
    backend: str = "auto",
    contact_dofs: str = "nodal",
) -> FullReference:
    """The reference of a full model of a sector for frequencies up to `highest_hz`.

    excitation_direction, excitation_at and the outputs as in `reduce`; backend, contact_dofs as in
    `ReductionOptions`.

    Raises RomParameterError when there are too many modes in the range, FactorisationError when the structure is not
    held or not stable.
    """
    kept = choose_boundary_dofs(full, sector, excitation_at, contact_dofs)
    direction = unit_vector(excitation_direction)
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    stiffness, mass = (kept.quadratic_form(matrix)[free][:, free] for matrix in (full.stiffness, full.mass))
    rows = np.searchsorted(free, kept.dofs)
    forces = np.zeros((len(free), kept.size))
    forces[rows] = kept.rotation.T
    factor = factorise(stiffness, backend)
    static = factor.solve(forces)
    flexibility = kept.rotation @ static[rows]
    count = _FIRST_GUESS
    while True:
        angular, modes = lowest_modes(mass, factor, count)
        if len(angular) < count or angular[-1] > 2.0 * np.pi * _BEYOND * highest_hz:
            break
        if count >= _MOST_MODES:
            raise RomParameterError("response", "frequency", highest_hz, f"a range below {count} modes of the blade")
        count *= 2
    first = static - modes @ ((modes.T @ forces) / angular[:, None] ** 2)
    second = factor.solve(mass @ first)
    basis = _independent_columns(np.hstack([modes, first, second - modes @ (modes.T @ (mass @ second))]), mass)
    contact = 6 * kept.n_contacts
    model = ReducedModel(
        mass=_projected(mass, basis),
        stiffness=_projected(stiffness, basis),
        contact_position=sector.right.position,
        contact_area=sector.right.area,
        n_blades=sector.n_blades,
        producer=f"shroud: {full.element}, {full.n_dofs} dofs, {len(angular)} free modes and static answers",
        **boundary_selection(kept, kept.rotation @ basis[rows], direction),
    )
    return FullReference(model, flexibility[:contact, :contact], len(angular))


def static_error(model: ReducedModel, flexibility: NDArray[np.float64]) -> float:
    """Relative difference of a model's static contact flexibility from another, `flexibility` (6 n_c, 6 n_c) m/N.

    In the Frobenius norm. Only round-off for a reduced model that keeps the contact dofs. Raises ReducedModelError
    without left contacts.
    """
    if model.contact_left is None:
        raise ReducedModelError("contact/left: missing, allowed: a blade with both faces")
    rows = np.vstack([model.contact_right, model.contact_left])
    found = rows @ np.linalg.solve(model.stiffness, rows.T)
    return float(np.linalg.norm(found - flexibility) / np.linalg.norm(flexibility))


def _independent_columns(vectors: NDArray[np.float64], mass: csr_matrix) -> NDArray[np.float64]:
    return vectors @ independent(vectors.T @ (mass @ vectors))


def _projected(matrix: csr_matrix, basis: NDArray[np.float64]) -> NDArray[np.float64]:
    product = basis.T @ (matrix @ basis)
    return 0.5 * (product + product.T)
