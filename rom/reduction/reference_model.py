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

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rom.cyclic.reduced_model import ReducedModel
from rom.errors import ReducedModelError, RomParameterError
from rom.finite_elements.full_model import FullModel
from rom.linear_algebra.factorisation import Factor, factorise
from rom.linear_algebra.orthonormalisation import orthonormal_combinations
from rom.linear_algebra.threads import one_blas_thread
from rom.reduction.boundary_dofs import AT_TIP, BoundaryChoice, choose_boundary_dofs
from rom.reduction.boundary_selection import boundary_selection
from rom.reduction.contact_dofs import ContactDofs, averaged_dofs
from rom.reduction.fixed_interface_modes import ModalBasis, lowest_modes
from rom.reduction.mortar_dofs import Grid, coarser_mortar, contact_grid
from rom.reduction.substructure import symmetric

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from geometry import SectorMesh

_FIRST_GUESS = 24
_MOST_MODES = 384
# Mortar that stands for springs spread over the face, along t1 and along the radius: on a steel face of 12 x 5 mm its
# frequencies are within 0.02 % of those with the shape functions of all nodes up to kn = 1e10 N/m, tied within 0.1 %.
_LEAST_ON_FACE = (8, 6)
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
    face : ReducedModel or None
        The same with other contact dofs: a mortar so fine that its springs are as good as spread over the face. None
        where it was not asked for or the mesh has no node sets of the faces.
    face_grid : (int, int)
        Contact nodes of `face` along t1 and along the radius.
    """

    model: ReducedModel
    flexibility: NDArray[np.float64]
    modes: int
    face: ReducedModel | None = None
    face_grid: Grid = (0, 0)

    def with_mortar(self, grid: Grid) -> ReducedModel:
        """The model of `face` with a mortar of another, coarser grid.

        Parameters
        ----------
        grid : (int, int)
            Contact nodes along t1 and along the radius, at most those of `face_grid`.

        Raises
        ------
        ReducedModelError
            There is no `face`.
        """
        if self.face is None or self.face.contact_left is None:
            raise ReducedModelError("face: missing, allowed: a reference made with it")
        rows, shares = coarser_mortar(self.face_grid, grid)
        each = np.kron(rows, np.eye(3))
        area = self.face.contact_area
        return replace(
            self.face,
            contact_right=each @ self.face.contact_right,
            contact_left=each @ self.face.contact_left,
            contact_position=rows @ self.face.contact_position,
            contact_area=None if area is None else shares * float(area.sum()),
        )


@one_blas_thread()
def full_reference(
    full: FullModel,
    sector: SectorMesh,
    highest_hz: float,
    boundary: BoundaryChoice = AT_TIP,
    *,
    backend: str = "auto",
    with_face: bool = False,
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
    with_face : bool
        Whether to make the model with springs spread over the face too, which takes one more static solution for each
        of its contact dofs.

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
    stiffness, mass = (matrix[free][:, free] for matrix in (full.stiffness, full.mass))
    motion = dofs.motion(len(full.positions))[:, free]
    face = _spread_over_face(full, sector) if with_face else None
    factor = factorise(stiffness, backend)
    forces = motion.T.toarray()
    static = factor.solve(forces)
    modes = _modes_beyond(mass, factor, highest_hz)
    first = _without_modes(static, forces, modes)
    second = factor.solve(mass @ first)
    vectors = [modes.shapes, first, second - modes.shapes @ (modes.shapes.T @ (mass @ second))]
    if face is not None:
        on_face = face[0].motion[:, free].T.toarray()
        vectors.append(_without_modes(factor.solve(on_face), on_face, modes))
    basis = np.hstack(vectors)
    basis = basis @ orthonormal_combinations(basis.T @ (mass @ basis))
    contact = 6 * dofs.n_contacts
    model = ReducedModel(
        mass=symmetric(basis.T @ (mass @ basis)),
        stiffness=symmetric(basis.T @ (stiffness @ basis)),
        contact_position=dofs.contact.position,
        contact_area=dofs.contact.area,
        n_blades=sector.n_blades,
        producer=f"shroud: {full.element}, {full.n_dofs} dofs, {len(modes)} free modes and static responses",
        **boundary_selection(dofs, motion @ basis),
    )
    flexibility = (motion @ static)[:contact, :contact]
    if face is None:
        return FullReference(model, flexibility, len(modes))
    contact_dofs, grid = face
    spread = _with_contact(model, contact_dofs, contact_dofs.motion[:, free] @ basis)
    return FullReference(model, flexibility, len(modes), spread, grid)


def _without_modes(
    static: NDArray[np.float64], forces: NDArray[np.float64], modes: ModalBasis
) -> NDArray[np.float64]:
    """Static responses (n, k) to forces (n, k) less the part of the modes."""
    return static - modes.shapes @ ((modes.shapes.T @ forces) / modes.omega[:, None] ** 2)


def _spread_over_face(full: FullModel, sector: SectorMesh) -> tuple[ContactDofs, Grid] | None:
    """Contact dofs of a mortar finer than the contact grid, and its grid; None where the mesh has no faces for it."""
    try:
        along, radial = contact_grid(sector.right)
        grid = max(_LEAST_ON_FACE[0], 2 * ((along + 1) // 2) + 2), max(_LEAST_ON_FACE[1], 2 * ((radial + 1) // 2) + 2)
        return averaged_dofs(sector, full.element, "mortar", grid), grid
    except RomParameterError:
        return None


def _with_contact(model: ReducedModel, contact: ContactDofs, motion: NDArray[np.float64]) -> ReducedModel:
    """A model with other contact dofs, whose motion is (6 n_c, n)."""
    right, left = np.split(motion, 2)
    return replace(
        model,
        contact_right=right,
        contact_left=left,
        contact_position=contact.position,
        contact_area=contact.area,
    )


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
