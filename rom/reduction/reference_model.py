"""A model of a few hundred coordinates that responds like the full one: the reference of reduced models.

Its basis holds free natural modes of the full model far beyond the frequencies of interest, the static responses to
forces at the boundary dofs (attachment modes), and the quasi-static responses to the inertia of those. It shares
nothing with the Craig-Bampton basis. The receptance at the boundary dofs is exact to the third power of
(w / w_next)^2, w_next the first mode left out, and this error is squared because the space holds both the response
and its adjoint.

References
----------
R. R. Craig, C.-J. Chang, On the use of attachment modes in substructure coupling for dynamic analysis,
18th Structures, Structural Dynamics and Materials Conference (1977), AIAA 77-405.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.reduced_model import ReducedModel
from rom.errors import ReducedModelError, RomParameterError
from rom.finite_elements.full_model import FullModel
from rom.linear_algebra.factorisation import Factor, factorise
from rom.linear_algebra.orthonormalisation import orthonormal_combinations
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_dofs import NODAL_TIP, BoundaryChoice, choose_boundary_dofs
from rom.reduction.boundary_selection import boundary_selection
from rom.reduction.fixed_interface_modes import ModalBasis, lowest_modes
from rom.reduction.substructure import symmetric

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh

_FIRST_GUESS = 24
_MOST_MODES = 384
_BEYOND = 3.0  # highest mode over the highest frequency of interest, at least


@dataclass(frozen=True)
class FullReference:
    """Reference for the reduced models of one full model.

    Attributes
    ----------
    model : ReducedModel
        Responds like the full model at the boundary dofs.
    flexibility : (6 n_c, 6 n_c) array
        Displacements of right, then left contact dofs for unit forces there, m/N; solved on the mesh itself.
    modes : int
        Free natural modes of the full model in `model`.
    """

    model: ReducedModel
    flexibility: NDArray[np.float64]
    modes: int


@one_blas_thread()
def full_reference(
    full: FullModel,
    sector: SectorMesh,
    highest_hz: float,
    boundary: BoundaryChoice = NODAL_TIP,
    *,
    backend: str = "auto",
) -> FullReference:
    """The reference of a full model for frequencies up to `highest_hz`.

    Parameters
    ----------
    full : FullModel
        The full model.
    sector : SectorMesh
        Its mesh.
    highest_hz : float
        Highest frequency of interest, Hz.
    boundary : BoundaryChoice
        Excitation and contact dofs; the outputs are those of `reduce_sector`.
    backend : str
        Backend of the factorisation, see `factorise`.

    Returns
    -------
    FullReference
        The reference.

    Raises
    ------
    RomParameterError
        There are too many modes in the range.
    FactorisationError
        The structure is not held or not stable.
    """
    dofs = choose_boundary_dofs(full, sector, boundary)
    free = np.setdiff1d(np.arange(full.n_dofs), full.fixed)
    stiffness, mass = (dofs.transform_matrix(matrix)[free][:, free] for matrix in (full.stiffness, full.mass))
    rows = np.searchsorted(free, dofs.dofs)
    forces = np.zeros((len(free), dofs.size))
    forces[rows] = dofs.rotation.T
    factor = factorise(stiffness, backend)
    static = factor.solve(forces)
    flexibility = dofs.rotation @ static[rows]
    modes = _modes_beyond(mass, factor, highest_hz)
    shapes = modes.shapes
    first = static - shapes @ ((shapes.T @ forces) / modes.omega[:, None] ** 2)
    second = factor.solve(mass @ first)
    vectors = np.hstack([shapes, first, second - shapes @ (shapes.T @ (mass @ second))])
    basis = vectors @ orthonormal_combinations(vectors.T @ (mass @ vectors))
    contact = 6 * dofs.n_contacts
    model = ReducedModel(
        mass=symmetric(basis.T @ (mass @ basis)),
        stiffness=symmetric(basis.T @ (stiffness @ basis)),
        contact_position=sector.right.position,
        contact_area=sector.right.area,
        n_blades=sector.n_blades,
        producer=f"shroud: {full.element}, {full.n_dofs} dofs, {len(modes)} free modes and static responses",
        **boundary_selection(dofs, dofs.rotation @ basis[rows]),
    )
    return FullReference(model, flexibility[:contact, :contact], len(modes))


def _modes_beyond(mass: csr_matrix, factor: Factor, highest_hz: float) -> ModalBasis:
    """The lowest free modes, up to three times the highest frequency of interest at least."""
    count = _FIRST_GUESS
    while True:
        modes = lowest_modes(mass, factor, count)
        if len(modes) < count or modes.omega[-1] > 2.0 * np.pi * _BEYOND * highest_hz:
            return modes
        if count >= _MOST_MODES:
            raise RomParameterError("response", "frequency", highest_hz, f"a range below {count} modes of the blade")
        count *= 2


def static_error(model: ReducedModel, flexibility: NDArray[np.float64]) -> float:
    """Relative error of the static contact flexibility of a model, in the Frobenius norm.

    Only round-off for a reduced model whose boundary dofs hold the contact dofs.

    Parameters
    ----------
    model : ReducedModel
        The model.
    flexibility : (6 n_c, 6 n_c) array
        The exact flexibility, m/N, as in `FullReference`.

    Raises
    ------
    ReducedModelError
        The model has no left contacts.
    """
    if model.contact_left is None:
        raise ReducedModelError("contact/left: missing, allowed: a blade with both faces")
    rows = np.vstack([model.contact_right, model.contact_left])
    found = rows @ np.linalg.solve(model.stiffness, rows.T)
    return float(np.linalg.norm(found - flexibility) / np.linalg.norm(flexibility))
